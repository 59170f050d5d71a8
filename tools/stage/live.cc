// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/live.hh"

#include <string>
#include <utility>
#include <vector>

#include "stage/python_module.hh"

namespace Stg::program {

namespace {

/// Throws if an option is given that --live and --foxglove do not support.
void CheckOptions(const Options& options) {
  const std::pair<bool, const char*> others[] = {
      {!options.controller_args.empty(), "--args"},
      {options.run.clock, "--clock"},
      {!options.first_snapshot.empty(), "--from-snapshot"},
      {!options.run.batch, "--no-batch"},
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
  const RunOptions& run = options.run;
  std::vector<std::string> arguments = {"--seed=" + std::to_string(run.seed)};
  if (!options.live_port.empty()) arguments.push_back("--port=" + options.live_port);
  if (options.foxglove)
    arguments.push_back(options.foxglove_port.empty() ? "--foxglove"
                                                      : "--foxglove=" + options.foxglove_port);
  if (run.threads > 0) arguments.push_back("--threads=" + std::to_string(run.threads));
  if (run.always_on_device) arguments.push_back("--opencl-always");
  if (run.opencl) arguments.push_back(run.device.empty() ? "--opencl" : "--opencl=" + run.device);
  if (run.ray_model != RayModel::kDefault)
    arguments.push_back(std::string("--ray-model=") +
                        (run.ray_model == RayModel::kCell ? "cell" : "exact"));
  if (!run.controllers) arguments.push_back("--no-controllers");
  arguments.insert(arguments.end(), {"--", options.worldfiles.front()});
  BecomePythonModule("stagesim.live", arguments);
}

}  // namespace Stg::program
