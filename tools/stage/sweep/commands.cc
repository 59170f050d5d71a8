// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/commands.hh"

#include <string_view>
#include <vector>

#include "stage.hh"
#include "stage/option_values.hh"
#include "stage/python_module.hh"
#include "stage/sweep/worker.hh"

namespace Stg::program {

namespace {

int Work(int argc, char* argv[]) {
  if (argc != 3) throw UsageError("found a worker without a folder");
  const std::string folder = argv[2];
  Init(&argc, &argv);
  return RunWorker(folder);
}

int Report(int argc, char* argv[]) {
  std::vector<std::string> arguments = {"report"};
  arguments.insert(arguments.end(), argv + 2, argv + argc);
  BecomePythonModule("stagesim.sweep", arguments);
}

}  // namespace

std::optional<int> RunSweepCommand(int argc, char* argv[]) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "sweep") return Sweep(argc, argv);
  if (command == "merge") return Merge(argc, argv);
  if (command == "report") return Report(argc, argv);
  if (command == kWorkerCommand) return Work(argc, argv);
  return std::nullopt;
}

}  // namespace Stg::program
