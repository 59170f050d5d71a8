// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/help.hh"

namespace Stg::program {

const char kHelpText[] =
    R"(Usage: stage [OPTION]... WORLDFILE...
       stage replay [OPTION]... LOG
       stage sweep [OPTION]... WORLDFILE -o FOLDER
       stage merge FOLDER -o FILE
       stage report FOLDER

Simulates crowds of robots in the plane. A WORLDFILE describes what there is: surroundings, robots,
their sensors, and the controllers (plug-ins) that drive them. Several worlds run side by side, one
step each in turn, in the order given. A LOG is what --log has recorded: replay shows it again, in
the window, where < and > go back and on, or by --screenshot and --record; no controllers run.

How long, and what comes out
  --duration S         end after S simulated seconds, whatever the worlds' quit_time says;
                       a world without either runs until its controllers or Ctrl-C end it
  --seed N             begin the random numbers differently (default 1): the same seed gives the
                       same run, another seed another sample of it
  --ray-model MODEL    what ranges go to where the world leaves it open to its sensors, instead of
                       what the world says: cell, the grid cell that was hit (right to about a
                       cell), or exact, the outline itself, whatever the size of the cells
  -a, --args STR       hand STR to every controller
  --set NAME.PROPERTY=VALUE
                       use VALUE in place of what the world file says; NAME is "world", a type such
                       as ranger, a macro such as robot, or the name of one model; may be given
                       several times: --set world.resolution=0.05 --set robot.ctrl=wander
  --set NAME=COUNT     so many models of the population of that name or, without one, of that type,
                       in place of those of the file; at random on free ground: --set robots=100
  --no-controllers     load no controllers: a world file is a program, as its controllers are any
                       plug-ins; without them it can be looked at before it is trusted

How fast
  A world's speedup, if positive, keeps it to that multiple of real time; otherwise it runs as fast
  as it can (in a window: if it has none, in real time). None of these options changes any result.
  --threads N          simulate in N threads (1 to 1024; default: the world's threads, or else as
                       many as there are processors for the program, in steps that are faster
                       with them)
  --opencl[=DEVICE]    trace sensor rays with an OpenCL device wherever that is faster; pays from
                       some ten thousand rays a step. DEVICE is one of
                         auto            the best one; without any, the run goes on (default)
                         cpu, gpu        the first of that kind
                         NAME[:INDEX]    one whose name contains NAME; the INDEXth, from 0
                         list            none: print the devices that there are, and end
  --opencl-always      use the device for every step, even where it is slower: for measurements
  --no-batch           trace each sensor on its own instead of all at once: for comparisons

What you see
  -c, --clock          print the simulated time, every show_clock_interval steps of the world
  --progress           say on standard error, even if that is no terminal, what is done and how far
                       it is: version, files that are loaded, remarks of controllers, whether
                       --opencl has helped, the end
  --no-progress        say nothing of that; default: on a terminal (how far a run is if its end is
                       known and no clock is shown). Standard output has only what options ask for
  --explain[=json]     take no step: load, which calls the controllers' Init, say what would be
                       simulated and what is left out because nobody asks for it, what a step and
                       its memory will take (parts of a step are measured for 0.3 s), what
                       may pay; as JSON too with --stats
  --explain-ray ROBOT:RANGER:SENSOR:SAMPLE@SECONDS
                       run to that simulated time and say why that sample of a ranger reads what it
                       reads: its fan, the cells of the walk, the bodies in them and what each
                       answered, noise; as JSON too with --stats. RANGER is a name or a number
                       from 0, and may be left out if the robot has one; SENSOR and SAMPLE are
                       numbers from 0
  --budget-ms MS       say how many scenarios fit into so many milliseconds on this machine: what-if
                       runs of the world from its state after 1 s (or --duration), each of
                       --budget-horizon seconds, on all processors (or --threads); as JSON too with
                       --stats. Measuring takes some seconds, or six times MS if that is more
  --budget-horizon SECONDS
                       simulated seconds of a scenario of --budget-ms (default 5)
  --stats FILE         at the end write figures about the run (robots, speed, rays, memory, where
                       the time went) to FILE as JSON; - for standard output, where nothing else
                       goes then. Like the other outputs it replaces nothing but an earlier one of
                       its kind
  --state-hash         at the end print a line "state-hash DIGITS" for each world: equal digits mean
                       that all poses, velocities and sensor readings are equal
  --save-snapshot FILE@SECONDS
                       write the state of the world at that simulated time to FILE. Without a
                       --duration the run ends there
  --from-snapshot FILE begin with that state of the same world file instead of its beginning: the run
                       goes on to the bit as the one that FILE is from, with its seed. --duration
                       counts from the beginning of the world
  --log FILE.mcap      record what robots sense, believe and do, as messages of ROS 2 in an MCAP file,
                       for its tools, Foxglove and replay; changes no result. One world only. Killed
                       runs leave a file that is good up to its last whole chunk
  --log-every SECONDS  record every so many simulated seconds (default: whenever something updates)
  --log-models NAMES   record these robots alone: names with a comma between them, or patterns with
                       * and ?
  --log-compression HOW
                       lz4 (default), zstd (smaller) or none
  --log-ranges HOW     what ranges read where nothing is: rep117 (default): infinity, and minus
                       infinity where something is too near; stage: the maximum, and the distance
  --screenshot FILE.png[@SECONDS]
                       make a picture at that simulated time, without a window or a display (default:
                       at the end of --duration, or at 1 s); may be given several times. Without a
                       --duration the run ends with the last one. What is shown and from where is
                       what the window section of the world file says
  --record FILE.mp4    make a film, as quick as the simulated world: a frame for each step, 25 in a
                       simulated second at most. The program ffmpeg makes the file; .m4v, .mov, .mkv,
                       .webm and .avi are good too. What exists is not replaced
  --record DIR         the same as pictures stage-000000.png and so on in DIR, in which there are none
                       yet
  --size WxH           pixels of these pictures; default: those of the world file's window
  --live[=PORT]        serve a page at 127.0.0.1 that shows the running world in a browser, and print
                       its address: pause, step, speed, drag and drive robots. Needs Python with the
                       package stagesim[live]; python3 -m stagesim.live --help has more options
  --foxglove[=PORT]    the same, and serve Foxglove, at port 8765 unless another one is given; needs
                       stagesim[foxglove]
  -g, --gui            no window. (The name has historical reasons.) Without it, with a display and
                       a single world file, the world runs in a window, and pauses at its quit_time
  -h, -?, --help       print this and end
  --version            print the version and end

Options may stand anywhere and long ones may be shortened; after -- everything is a world file.

Examples
  stage worlds/simple.world
      two robots stroll about a flat, in a window: p pauses, d shows what their sensors see
  stage --explain worlds/hospital.world
      before a long run: how long, how much memory, and what for
  stage -g -c worlds/simple.world
      two robots stroll about a flat; print the clock
  stage -g --duration 60 --threads 8 --stats run.json worlds/hospital.world
      one simulated minute with 8 threads; then look up r_acc in run.json: simulated robot seconds
      for each second of real time
  stage -g --duration 60 --opencl=gpu --state-hash worlds/cave.world
      the same sort of run on a GPU; the state hash shows that the result is that of the CPU

  stage --screenshot flat.png@20 --size 640x480 worlds/simple.world
      where the robots are after 20 s, as a picture
  stage -g --duration 60 --log run.mcap worlds/simple.world; stage replay run.mcap
      one minute, recorded, and shown again
  stage --record film.mp4 --duration 10 worlds/simple.world
      ten simulated seconds as a film

World files
  simple.world is where to start: in worlds/ of the source tree, in share/stage/worlds/ below the
  place where Stage is installed. Their comments explain the format. These worlds, what they include
  and their pictures are found by their plain names from any folder.

Environment
  DISPLAY              the X display for the window; without one, all runs are headless
  STAGEPATH            folders, with : between them, for world files, includes and pictures that don't
                       lie where they are named, and for controllers, before those that come with Stage
  LD_LIBRARY_PATH      further folders for controllers
  STAGE_LANES          how the host walks rays side by side: avx512, avx2, neon or none; default:
                       the fastest one of this processor. For measurements
  STAGE_PYTHON         the Python interpreter of --live and --foxglove; default: python3
  STAGE_CL_DEVICE      DEVICE for an --opencl that names none
  STAGE_CL_HITS        potential hits that the device lists for each ray, 1 (default) to 16: where
                       none of them is a hit, the host walks on by itself
  STAGE_CL_MEMORY      own or shared: whether the device has memory of its own, instead of what it
                       says about itself
  STAGE_CL_OPTIONS     further options for the device's compiler
  STAGE_CL_TIMEOUT     seconds that a call of an OpenCL driver may take before the driver is taken for
                       hung, 120 by default; 0: no limit
  POSIXLY_CORRECT      if set, options only count before the first world file

Exit status
  0        all worlds have come to their end
  1        a world file is missing or wrong; or the run can't go on; or output is lost
  2        wrong options, or no world file, or a FILE or DIR can't be written or holds something else
  255      something that a world file names is missing or wrong: a controller, a bitmap, a tuple
  128+N    ended by signal N, such as 130 for Ctrl-C: the step is finished, figures are written
  A controller that ends the program chooses its own.
)";

}  // namespace Stg::program
