// SPDX-License-Identifier: GPL-2.0-or-later
//
// Command lines, start and end of the programs ray_truth and pose_log.

#ifndef STAGE_BENCHMARKS_TRUTH_COMMAND_LINE_HH
#define STAGE_BENCHMARKS_TRUTH_COMMAND_LINE_HH

#include <getopt.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>

#include "stage.hh"
#include "worldfile/numbers.hh"

namespace truth {

struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Parses the whole text as a number.
inline double Number(const std::string& option, const std::string& text, double low, double high) {
  const std::optional<double> value = Stg::worldfile::ReadWholeFloat(text);
  if (value && *value >= low && *value <= high) return *value;
  char range[80];
  std::snprintf(range, sizeof range, "a number from %g to %g", low, high);
  throw UsageError(option + ": found '" + text + "', expected " + range);
}

/// Parses the whole text as an integer.
inline uint64_t WholeNumber(const std::string& option, const std::string& text, double low,
                            double high) {
  const double value = Number(option, text, low, high);
  if (value == std::floor(value)) return static_cast<uint64_t>(value);
  throw UsageError(option + ": found '" + text + "', expected a whole number");
}

struct CommonOptions {
  uint64_t seed = 1;
  int threads = 1;
  std::string world;
};

/// Results of getopt_long for the common options. Options of one program start at kOwn.
enum CommonId : int { kHelpWanted = 256, kSeed, kThreads, kOwn };

/// Parses a command line with one world file. Calls `apply(id, value)` for each of the program's
/// own options; --help prints the text and ends the program.
template <class Apply>
void ReadCommandLine(int argc, char* argv[], const char* help, const option* long_options,
                     CommonOptions* common, const Apply& apply) {
  opterr = 0;
  for (int id; (id = getopt_long(argc, argv, "", long_options, nullptr)) != -1;) {
    const std::string value = optarg ? optarg : "";
    if (id == '?') {
      throw UsageError("there is no such option, or it lacks its value (--help lists them)");
    } else if (id == kHelpWanted) {
      std::fputs(help, stdout);
      std::exit(0);
    } else if (id == kSeed) {
      common->seed = WholeNumber("--seed", value, 0, 1e15);
    } else if (id == kThreads) {
      common->threads = static_cast<int>(WholeNumber("--threads", value, 1, 1024));
    } else {
      apply(id, value);
    }
  }
  if (optind + 1 != argc)
    throw UsageError("found " + std::to_string(argc - optind) +
                     " world files, expected one (--help explains)");
  common->world = argv[optind];
}

/// Returns the world, or null after an error message. The world is never deleted, because
/// controllers may use models until the end of the process.
inline Stg::World* LoadWorld(int argc, char* argv[], const CommonOptions& options) {
  Stg::Init(&argc, &argv);
  Stg::World::run_options.seed = options.seed;
  Stg::World::run_options.threads = options.threads;
  static Stg::World* const world = new Stg::World;
  return world->Load(options.world) ? world : nullptr;
}

/// Calls the main function; an exception becomes one line and an exit status.
template <class Run>
int RunProgram(const char* name, const Run& run) {
  try {
    return run();
  } catch (const UsageError& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace truth

#endif
