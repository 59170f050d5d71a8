// SPDX-License-Identifier: GPL-2.0-or-later
//
// Helpers for tests of the program `stage`: worlds in a temporary directory, and runs with a time
// limit.

#ifndef STAGE_TESTS_CLI_TESTING_HH
#define STAGE_TESTS_CLI_TESTING_HH

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/patience.hh"
#include "threads/wall_clock.hh"

namespace cli_testing {

namespace fs = std::filesystem;
using Stg::threads::WallClock;
using Strings = std::vector<std::string>;
using Environment = std::vector<std::pair<std::string, std::string>>;

/// Waits for two milliseconds.
void Nap();

std::string ReadFile(const fs::path& path);

inline bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// True if a part of the text matches the regular expression.
bool MatchesPart(const std::string& text, const std::string& expression);

size_t CountOf(const std::string& text, const std::string& part);

/// The clock lines that the program has printed, in order.
Strings Clocks(const std::string& out);

/// Path of the program under test.
std::string Program();

struct Result {
  int status = -1;  ///< exit status; 128 + n: ended by signal n
  bool hung = false;
  double seconds = 0;
  std::string out, err;
};

/// A run of the program in a directory. Its output goes to the files `out` and `err` there.
class Process {
 public:
  Process(const fs::path& directory, const Strings& arguments, const Environment& environment);
  ~Process() {
    if (pid_ > 0) Finish(0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  std::string out() const { return ReadFile(directory_ / "out"); }
  std::string err() const { return ReadFile(directory_ / "err"); }
  void Send(int signal) const { kill(pid_, signal); }

  /// Waits for a text on standard output; returns false after kPatience seconds.
  bool WaitFor(const std::string& text) const {
    return WaitUntil([&] { return Contains(out(), text); });
  }
  /// Does the same as WaitFor() for standard error.
  bool WaitForError(const std::string& text) const {
    return WaitUntil([&] { return Contains(err(), text); });
  }

  /// Waits for the end, and kills the program after `limit` seconds.
  Result Finish(double limit = patience::kPatience);

 private:
  template <typename Condition>
  bool WaitUntil(Condition holds) const {
    while (WallClock() < start_ + patience::kPatience) {
      if (holds()) return true;
      Nap();
    }
    return false;
  }
  [[noreturn]] void RunChild(char* const argv[], const Environment& environment) const;

  fs::path directory_;
  double start_;
  pid_t pid_ = -1;
};

class CliTest : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  fs::path Path(const std::string& name) const { return directory_ / name; }

  void Write(const std::string& name, const std::string& text) const;
  /// Writes a world with one model.
  void WriteWorld(const std::string& name, const std::string& text) const;
  /// Writes a world with two robots, one of which runs and has a noisy sensor with 90 rays.
  void WriteRobots(const std::string& name, const std::string& text) const;

  Result Stage(const Strings& arguments, const Environment& environment = {}) const;
  void ExpectStatus(int status, const Strings& arguments) const;
  /// Expects status 2, one line on standard error that contains `part`, and no standard output.
  void ExpectRefused(const Strings& arguments, const std::string& part) const;
  /// Expects that loading fails with a message that contains `part`, and that no run begins.
  void ExpectLoadFails(int status, const Strings& arguments, const std::string& part,
                       const Environment& environment = {}) const;
  /// The statistics that a run has written. Callers include support/json.hh.
  nlohmann::json Stats(const std::string& name) const;

  fs::path directory_;
};

}  // namespace cli_testing

#endif
