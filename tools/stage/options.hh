// SPDX-License-Identifier: GPL-2.0-or-later
//
// The command line.

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
  bool replay = false;  ///< the only file is no world but a log
  bool no_gui = false;
  std::string tags;             ///< of the options before: "[GUI disabled]", in their order
  std::string controller_args;  ///< the text of --args
  RunOptions run;
  std::string stats_file;  ///< empty: none; "-": standard output
  bool state_hash = false;
  std::string explained_ray;             ///< with kExplainRay: see RayChoice
  double budget_ms = 0, horizon = 5;     ///< with kBudget: wall clock, simulated seconds
  bool foxglove = false;                 ///< with kLive
  std::string live_port, foxglove_port;  ///< with kLive; empty: the usual ones
  std::string first_snapshot;            ///< the file of --from-snapshot; empty: none
  struct SnapshotOrder {
    std::string file;
    usec_t time;
  };
  std::optional<SnapshotOrder> snapshot;  ///< of --save-snapshot
  recording::LogOptions log;              ///< its file empty: none
  bool explain_as_json = false;           ///< with kExplain; otherwise as a text
  std::optional<bool> progress;           ///< unset: shown where somebody is likely to look
  offscreen::Orders pictures;             ///< their times are known once all options are
  std::vector<std::string> worldfiles;
};

/// Throws UsageError. Call it once: getopt has a state of its own.
Options ParseOptions(int argc, char* argv[]);

}  // namespace Stg::program

#endif
