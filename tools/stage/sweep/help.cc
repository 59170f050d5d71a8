// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/help.hh"

namespace Stg::program {

const char kSweepHelpText[] =
    R"(Usage: stage sweep [OPTION]... WORLDFILE -o FOLDER
       stage sweep --resume FOLDER
       stage sweep --status FOLDER

Runs a world with every combination of some values, each with many seeds, and keeps a small record
of each run: its metrics, its state hash, and the command that does it again.

What to run
  --set NAME=VALUE,VALUE...
                       an axis of the sweep, as --set of stage: NAME is NAME.PROPERTY, or a type or
                       population, of which VALUE is the number: --set robots=10,100
                       --set world.resolution=0.02,0.1. Commas in quotes or brackets are no ends
  --runs FIRST:END     runs of each combination (default 0:1); 0:100 are 100
  --seed N             of the sweep (default 1). A run's seed comes from it, from the values and
                       from the number of the run, not from how many there are
  --common-seeds       run n has the same seed in every combination, to compare them in pairs
  --duration S         end each run after S simulated seconds, whatever the world's quit_time
  -a, --args STR       hand STR to every controller
  --ray-model MODEL    cell or exact
  --no-controllers     load no controllers
  --threads N          of each worker (default 1); --opencl[=DEVICE]: trace rays with that device.
                       Neither changes any result
  --log                record each run as an MCAP file beside its record; --log-every SECONDS,
                       --log-models NAMES, --log-compression HOW, --log-ranges HOW as those of stage
  --dry-run            say what would be run, and end

How to run it
  -o, --out FOLDER     where the plan and the records go: a new folder, or an empty one
  --jobs N             processes at work (default: one for each core)
  --resume             do those runs of FOLDER that have no record yet, whatever has ended the sweep
  --retry-failed       those that have failed, too
  --shard K/N          only the Kth part of N, from 1/N to N/N, each perhaps on another machine that
                       sees FOLDER
  --only FIRST:END     only the runs of these numbers
  --fresh              a new process for each run; otherwise worlds are reset and used again
  --limit-seconds S    a run that takes longer has failed (default: a day, and ten minutes for the
                       loading of a world before anything runs)
  --limit-mb MB        one whose process, and those that it has started, take more memory, too
  --tries N            a run whose process has died so often has failed (default 3)
  --plan-only          write the plan, run nothing
  --worker COMMAND     have the runs done by other workers than this program; see docs/sweeps.md.
                       The plan keeps it; --resume can be given another
  --progress, --no-progress
                       say how far it is; default: if standard error is a terminal
  -h, --help           print this and end

A failed run stops no other; its record has the signal and the last lines that were printed. The
status to exit with is 0 if all went well, 1 if a run has failed. Ctrl-C, or a kill, loses at most
the run that each process was at.

Examples
  stage sweep worlds/cave.world --set robots=10,100 --set world.resolution=0.02,0.1 --runs 0:100
        --duration 60 -o out
      400 runs, on all cores
  stage merge out -o all.csv; stage report out
      as a table, and as a page with pictures
)";

const char kMergeHelpText[] =
    R"(Usage: stage merge [OPTION]... FOLDER... -o FILE

Writes the records of a sweep as one table, a row for each run in the order of their numbers. The
same sweep gives the same bytes, whoever has run it and however often it was interrupted. With
several FOLDERs, each has a part of the same sweep, perhaps done by another machine.

  -o, --out FILE   ends in .csv; in .parquet or .h5, which needs Python with stagesim[sweep]
  --partial        merge what there is, though runs are missing
  --timings        columns for what differs from one time to the next: seconds, r_acc
  -h, --help       print this and end
)";

}  // namespace Stg::program
