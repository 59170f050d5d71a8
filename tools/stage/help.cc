// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/help.hh"

#include <sstream>

#include "world/run_option.hh"

namespace Stg::program {

namespace {

// The lines that start with @ stand for options of RunOptionTable().
constexpr char kText[] =
    R"(Usage: stage [OPTION]... WORLDFILE...
       stage replay [OPTION]... LOG
       stage bag info LOG
       stage sweep [OPTION]... WORLDFILE -o FOLDER
       stage merge FOLDER -o FILE
       stage report FOLDER
       stage import FILE [-o WORLDFILE]
       stage export map WORLDFILE -o FILE

Simulates crowds of robots in the plane. A WORLDFILE describes a world: the surroundings, robots,
their sensors, and the controllers (plug-ins, or built-in ones such as stage/wander) that drive
them. Several worlds run side by side: each makes one step in turn, in the order given. A LOG is a
file that --log has recorded. "stage replay" shows it in the window, where < and > skip backward and
forward, or makes pictures of it with --screenshot and --record; no controllers run.
"stage bag info" lists the topics of a log, with types, numbers of messages, rates and sizes.
"stage import" makes a world of a map.yaml, a picture, an array, an SVG or a DXF. "stage export map"
makes a map.yaml and its picture of a world.

Run length and results
@results
  -a, --args STR       pass STR to every controller

Performance
  A world with a positive speedup runs at that multiple of real time, any other as fast as possible
  (in a window: in real time). None of these options changes any result.
@performance

Output
  -c, --clock          print the simulated time, every show_clock_interval steps of the world
  --progress           print progress messages to standard error: version, loaded files, messages
                       of controllers, whether --opencl helped, the end. On a terminal also how far
                       the run is, if its end is known and no clock is shown
  --no-progress        suppress progress messages. Default: print them only to a terminal. Standard
                       output contains only what options ask for
  --explain[=json]     load the worlds, which calls the controllers' Init, and make no step; print
                       what would be simulated, what would not because it has no subscriber, the
                       estimated time and memory (parts of a step are measured for 0.3 s), and
                       suggestions. As JSON too with --stats
  --explain-ray ROBOT:RANGER:SENSOR:SAMPLE@SECONDS
                       run to that simulated time and explain the reading of that sample of a
                       ranger: its fan, the cells of the walk, the bodies in them and the answer of
                       each, noise. RANGER is a name or a number from 0, and may be omitted if the
                       robot has one; SENSOR and SAMPLE are numbers from 0. As JSON too with --stats
  --budget-ms MS       print how many scenarios this machine simulates in MS milliseconds: what-if
                       runs of the world from its state after 1 s (or --duration), each of
                       --budget-horizon seconds, on all processors (or --threads); and how long a
                       decision of 30 candidates takes, and how many samples of each fit. Takes
                       up to half a minute, or 12 times MS if that is more. As JSON too with --stats
  --budget-horizon SECONDS
                       simulated seconds of a scenario of --budget-ms (default 5)
  --stats FILE         at the end write statistics of the run (robots, speed, rays, memory, times)
                       to FILE as JSON; - is standard output, to which nothing else is written then.
                       Like all outputs it replaces only an earlier output of its kind
  --state-hash         at the end print a line "state-hash DIGITS" for each world. Equal digits mean
                       that all poses, velocities and sensor readings are equal
  --save-snapshot FILE@SECONDS
                       write the state of the world at that simulated time to FILE. Without
                       --duration the run ends there
  --from-snapshot FILE start from that state of the same world file. The run continues exactly as
                       the run that wrote FILE, with its seed. --duration counts from the beginning
                       of the world
  --log FILE.mcap      record what robots sense, are told, touch and do, as messages of ROS 2 in an
                       MCAP file, for ROS tools, Foxglove and replay. Changes no result. One world
                       only. The file of a killed run is valid up to its last complete chunk
  --log-every SECONDS  simulated time between records (default: record at every update)
  --log-models NAMES   record only these robots: names or patterns with * and ?, separated by commas
  --log-compression HOW
                       lz4 (default), zstd (smaller) or none
  --log-ranges HOW     readings of rays that hit nothing. rep117 (default): infinity, and minus
                       infinity for bodies that are too near; stage: the maximum, and the distance
  --screenshot FILE.png[@SECONDS]
                       save a picture at that simulated time, without a window or display (default:
                       at the end of --duration, or at 1 s). May be given several times. Without
                       --duration the run ends with the last picture. The window section of the
                       world file sets the view
  --record FILE.mp4    save a film at simulated speed: one frame per step, at most 25 per simulated
                       second. Needs the program ffmpeg. Other formats: .m4v, .mov, .mkv, .webm,
                       .avi. Existing files are not replaced
  --record DIR         save the frames as stage-000000.png and so on in DIR, which must not contain
                       any yet
  --size WxH           pixels of these pictures (default: those of the world file's window)
  --live[=PORT]        serve a page at 127.0.0.1 that shows the running world in a browser, and
                       print its address: pause, step, speed, drag and drive robots. Needs Python
                       with the package stagesim[live]. See also python3 -m stagesim.live --help
  --foxglove[=PORT]    like --live, and serve Foxglove at PORT (default 8765); needs
                       stagesim[foxglove]
  -g, --gui            no window. (The name has historical reasons.) Without this option, with a
                       display and a single world file, the world runs in a window, and pauses at
                       its quit_time
  -h, -?, --help       print this help and exit
  --version            print the version and exit

Options and world files may be given in any order. Long options may be abbreviated. All words after
-- are world files.

Examples
  stage worlds/simple.world
      two robots explore a flat, in a window: p pauses, d shows what their sensors see
  stage --explain worlds/hospital.world
      time and memory of a long run, before it starts
  stage -g -c worlds/simple.world
      without a window; print the clock
  stage -g --duration 60 --threads 8 --stats run.json worlds/hospital.world
      one simulated minute with 8 threads; r_acc in run.json is the number of robots times simulated
      seconds per second of real time
  stage -g --duration 60 --opencl=gpu --state-hash worlds/cave.world
      on a GPU; the state hash shows that the result equals that of the CPU
  stage --screenshot flat.png@20 --size 640x480 worlds/simple.world
      a picture of the robots after 20 s
  stage -g --duration 60 --log run.mcap worlds/simple.world; stage replay run.mcap
      record one minute, then replay it
  stage --record film.mp4 --duration 10 worlds/simple.world
      a film of ten simulated seconds

World files
  Start with simple.world, in worlds/ of the source tree or in share/stage/worlds/ of the
  installation; its comments explain the format. The installed worlds, the files that they include
  and their pictures are found by name from any folder.

Environment
  DISPLAY              the X display of the window; without one, all runs are headless
  STAGEPATH            folders, separated by :, that are searched for world files, includes and
                       pictures that are missing at their own places, and for controllers, before
                       the folders of the installation
  LD_LIBRARY_PATH      further folders of controllers
  STAGE_LANES          vector instructions for rays on the host: avx512, avx2, neon or none
                       (default: the fastest of this processor). For measurements
  STAGE_PYTHON         the Python interpreter of --live and --foxglove (default: python3)
  STAGE_CL_DEVICE      DEVICE of an --opencl without one
  STAGE_CL_HITS        1 to 16: the device lists that many potential hits of each ray, and the host
                       decides or continues the walk, as Jones et al. did. Default: the device
                       finds the ranges of rangers, and lists one hit of other rays
  STAGE_CL_MEMORY      own or shared: whether the device has its own memory, instead of what the
                       driver reports
  STAGE_CL_OPTIONS     further options of the device's compiler
  STAGE_CL_TIMEOUT     seconds after which a call of an OpenCL driver is considered hung (default
                       120; 0: no limit)
  POSIXLY_CORRECT      if set, options count only before the first world file

Exit status
  0        all worlds have ended
  1        a world file is missing or invalid, the run cannot continue, or output was lost
  2        invalid options, no world file, or a FILE or DIR that cannot be written or replaced
  255      something that a world file names is missing or invalid: a controller, a bitmap, a tuple
  128+N    ended by signal N, such as 130 for Ctrl-C: the step is finished, statistics are written
  A controller that ends the program chooses its own status.
)";

}  // namespace

std::string HelpEntry(const std::string& head, const std::string& text) {
  constexpr size_t kIndent = 23, kWidth = 100;
  const std::string new_line = "\n" + std::string(kIndent, ' ');
  std::string entry = "  " + head;
  entry += entry.size() < kIndent ? std::string(kIndent - entry.size(), ' ') : new_line;
  std::istringstream lines(text);
  for (std::string line, start; std::getline(lines, line); start = new_line) {
    entry += start;
    if (line.starts_with(' ')) {
      entry += line;
      continue;
    }
    std::istringstream words(line);
    size_t column = kIndent;
    for (std::string word; words >> word; column += word.size()) {
      if (column > kIndent && column + 1 + word.size() > kWidth) {
        entry += new_line;
        column = kIndent;
      }
      if (column > kIndent) entry += ' ', column++;
      entry += word;
    }
  }
  return entry + "\n";
}

std::string HelpText() {
  std::string text = kText;
  for (const bool results : {true, false}) {
    std::string entries;
    for (const RunOption& option : RunOptionTable())
      if (option.changes_results == results) entries += HelpEntry(option.Usage(), option.help);
    const std::string mark = results ? "@results\n" : "@performance\n";
    text.replace(text.find(mark), mark.size(), entries);
  }
  return text;
}

}  // namespace Stg::program
