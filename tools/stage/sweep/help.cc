// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/help.hh"

#include <string_view>

#include "stage/help.hh"
#include "world/run_option.hh"

namespace Stg::program {

namespace {

// The line that starts with @ stands for options of RunOptionTable().
constexpr char kSweepText[] =
    R"(Usage: stage sweep [OPTION]... WORLDFILE -o FOLDER
       stage sweep --resume FOLDER
       stage sweep --status FOLDER

Runs a world with every combination of some values, each with many seeds, and keeps a small record
of each run: its metrics, its state hash, and the command that repeats it.

Plan
  --set NAME=VALUE,VALUE...
                       an axis of the sweep. NAME is as for --set of stage: NAME.PROPERTY, or a type
                       or population, of which VALUE is the number: --set robots=10,100
                       --set world.resolution=0.02,0.1. Commas in quotes or brackets do not separate
                       values
  --runs FIRST:END     run numbers of each combination (default 0:1); 0:100 are 100 runs
  --seed N             seed of the sweep (default 1). The seed of a run depends on it, on the run's
                       values and on its number, not on the number of runs
  --common-seeds       run n has the same seed in every combination, for comparisons in pairs
  -a, --args STR       pass STR to every controller
  --threads N          threads of each worker (default 1); changes no result
@options
  --log                record each run as an MCAP file beside its record; --log-every SECONDS,
                       --log-models NAMES, --log-compression HOW, --log-ranges HOW as for stage
  --dry-run            print the plan and exit

Execution
  -o, --out FOLDER     folder for the plan and the records: a new one, or an empty one
  --jobs N             number of worker processes (default: one for each core)
  --resume             do the runs of FOLDER that have no record yet, however the sweep was ended
  --retry-failed       also repeat the failed runs
  --shard K/N          do only the Kth of N parts, from 1/N to N/N; other machines that see FOLDER
                       may do the other parts
  --only FIRST:END     do only the runs with these numbers
  --fresh              start a new process for each run instead of resetting and reusing worlds
  --limit-seconds S    a run that takes longer fails (default: a day, and ten minutes for loading
                       a world before the first run)
  --limit-mb MB        a run whose processes use more memory fails
  --tries N            a run fails when its process has died N times (default 3). A run that was
                       ended by a limit or for a wrong reply is not tried again
  --plan-only          write the plan, run nothing
  --worker COMMAND     command that starts another kind of worker; see docs/sweeps.md. The plan
                       keeps it; --resume can replace it
  --progress, --no-progress
                       show progress, or do not (default: if standard error is a terminal)
  -h, --help           print this help and exit

A failed run does not stop the sweep; its record contains the signal and the last lines of output.
The exit status is 0 if all runs succeeded, 1 if one failed. Ctrl-C or a kill loses at most the run
that each worker is doing.

Examples
  stage sweep worlds/cave.world --set robots=10,100 --set world.resolution=0.02,0.1 --runs 0:100
        --duration 60 -o out
      400 runs, on all cores
  stage merge out -o all.csv; stage report out
      the results as a table, and as a page with figures
)";

/// True for options that are described in kSweepText, as they have another meaning in sweeps.
bool IsOwn(const RunOption& option) {
  const std::string_view name = option.name;
  return name == "seed" || name == "settings" || name == "threads";
}

}  // namespace

std::string SweepHelpText() {
  std::string text = kSweepText, entries;
  for (const RunOption& option : RunOptionTable()) {
    if (IsOwn(option)) continue;
    entries += HelpEntry(option.Usage(),
                         option.Summary() + (option.changes_results ? "" : "; changes no result"));
  }
  const std::string mark = "@options\n";
  return text.replace(text.find(mark), mark.size(), entries);
}

const char kMergeHelpText[] =
    R"(Usage: stage merge [OPTION]... FOLDER... -o FILE

Writes the records of a sweep as one table: a row for each run, in the order of their numbers. The
same sweep gives the same bytes, whatever machines did the runs and however often it was
interrupted. Several FOLDERs must be parts of one sweep, such as those of several machines.

  -o, --out FILE   the table: .csv; or .parquet or .h5, which need Python with stagesim[sweep]
  --partial        merge the finished runs even if others are missing
  --timings        add columns that differ between repetitions: seconds, r_acc
  -h, --help       print this help and exit
)";

}  // namespace Stg::program
