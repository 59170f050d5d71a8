// SPDX-License-Identifier: GPL-2.0-or-later
//
// The program's command line.

#ifndef STAGE_TOOLS_STAGE_OPTIONS_HH
#define STAGE_TOOLS_STAGE_OPTIONS_HH

#include <optional>
#include <string>
#include <vector>

#include "gui/offscreen/pictures.hh"
#include "recording/recorder.hh"
#include "stage.hh"
#include "stage/option_values.hh"

namespace Stg::program {

struct Options {
  enum class Action { kRun, kExplain, kExplainRay, kBudget, kLive, kHelp, kVersion, kListDevices };

  Action action = Action::kRun;
  bool replay = false;  ///< the only file is a log instead of a world
  bool no_gui = false;
  std::string tags;             ///< options for the banner in order, such as "[GUI disabled]"
  std::string controller_args;  ///< value of --args
  RunOptions run;
  std::string stats_file;  ///< empty: no report; "-": standard output
  bool state_hash = false;
  std::string explained_ray;             ///< for kExplainRay, see RayChoice
  double budget_ms = 0, horizon = 5;     ///< for kBudget: real ms, simulated s
  bool foxglove = false;                 ///< for kLive
  std::string live_port, foxglove_port;  ///< for kLive; empty: default ports
  std::string first_snapshot;            ///< value of --from-snapshot; empty: none
  struct SnapshotOrder {
    std::string file;
    usec_t time;
  };
  std::optional<SnapshotOrder> snapshot;  ///< value of --save-snapshot
  recording::LogOptions log;              ///< no log if its file is empty
  bool explain_as_json = false;           ///< for kExplain; otherwise as text
  std::optional<bool> progress;           ///< unset: shown on terminals
  offscreen::PictureOptions pictures;     ///< times are final only after parsing
  std::vector<std::string> worldfiles;
};

/// Throws UsageError. Call it only once, because getopt has global state.
Options ParseOptions(int argc, char* argv[]);

}  // namespace Stg::program

#endif
