// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/live.hh"

#include <string>
#include <utility>
#include <vector>

#include "stage/python_module.hh"
#include "world/run_option.hh"

namespace Stg::program {

namespace {

/// Throws if an option is given that --live and --foxglove do not support.
void CheckOptions(const Options& options) {
  const std::pair<bool, const char*> others[] = {
      {!options.controller_args.empty(), "--args"},
      {options.run.clock, "--clock"},
      {!options.first_snapshot.empty(), "--from-snapshot"},
      {options.progress.has_value(), "--progress"},
      {!options.pictures.film.empty(), "--record"},
      {options.snapshot.has_value(), "--save-snapshot"},
      {!options.pictures.shots.empty(), "--screenshot"},
      {options.state_hash, "--state-hash"},
      {!options.stats_file.empty(), "--stats"},
      {options.run.duration > 0, "--duration"},  // checked last, since pictures set it as well
  };
  for (const auto& [given, name] : others)
    if (given) throw UsageError(std::string(name) + " does not go with --live and --foxglove");
}

}  // namespace

void ShowLive(const Options& options) {
  CheckOptions(options);
  std::vector<std::string> arguments;
  if (!options.live_port.empty()) arguments.push_back("--port=" + options.live_port);
  if (options.foxglove)
    arguments.push_back(options.foxglove_port.empty() ? "--foxglove"
                                                      : "--foxglove=" + options.foxglove_port);
  for (const RunOption& option : RunOptionTable())
    for (const auto& [flag, value] : option.Arguments(options.run))
      arguments.push_back(value.empty() ? flag : flag + "=" + value);
  arguments.insert(arguments.end(), {"--", options.worldfiles.front()});
  BecomePythonModule("stagesim.live", arguments);
}

}  // namespace Stg::program
