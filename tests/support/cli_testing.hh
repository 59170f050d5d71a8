// SPDX-License-Identifier: GPL-2.0-or-later
//
// Helpers for tests of the program `stage`: worlds in a temporary directory, and runs with a time
// limit.

#ifndef STAGE_TESTS_CLI_TESTING_HH
#define STAGE_TESTS_CLI_TESTING_HH

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/patience.hh"
#include "threads/wall_clock.hh"

namespace cli_testing {

namespace fs = std::filesystem;
using Stg::threads::WallClock;
using Strings = std::vector<std::string>;
using Environment = std::vector<std::pair<std::string, std::string>>;

inline void Nap() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

inline std::string ReadFile(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// True if a part of the text matches the regular expression.
inline bool MatchesPart(const std::string& text, const std::string& expression) {
  return testing::Matcher<const std::string&>(testing::ContainsRegex(expression)).Matches(text);
}

inline size_t CountOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) count++;
  return count;
}

/// The clock lines that the program has printed, in order.
inline Strings Clocks(const std::string& out) {
  const std::string before = "\r[Stage: ";
  Strings found;
  for (size_t at = out.find(before); at != std::string::npos; at = out.find(before, at + 1)) {
    const size_t begin = at + before.size();
    found.push_back(out.substr(begin, out.find(']', begin) - begin));
  }
  return found;
}

/// Path of the program under test.
inline std::string Program() {
  const char* build = std::getenv("STAGE_BINARY_DIR");
  return std::string(build ? build : ".") + "/bin/stage";
}

struct Result {
  int status = -1;  ///< exit status; 128 + n: ended by signal n
  bool hung = false;
  double seconds = 0;
  std::string out, err;
};

/// A run of the program in a directory. Its output goes to the files `out` and `err` there.
class Process {
 public:
  Process(const fs::path& directory, const Strings& arguments, const Environment& environment)
      : directory_(directory), start_(WallClock()) {
    Strings words = {Program()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    for (const char* stale : {"out", "err"}) fs::remove(directory / stale);
    pid_ = fork();
    if (pid_ == 0) RunChild(argv.data(), environment);
  }
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

  Result Finish(double limit = patience::kPatience) {
    Result result;
    int wait_status = 0;
    while (waitpid(pid_, &wait_status, WNOHANG) == 0) {
      if (WallClock() - start_ > limit) {
        result.hung = true;
        kill(pid_, SIGKILL);
        waitpid(pid_, &wait_status, 0);
        break;
      }
      Nap();
    }
    pid_ = -1;
    result.status = WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
    result.seconds = WallClock() - start_;
    result.out = out();
    result.err = err();
    return result;
  }

 private:
  template <typename Condition>
  bool WaitUntil(Condition holds) const {
    while (WallClock() < start_ + patience::kPatience) {
      if (holds()) return true;
      Nap();
    }
    return false;
  }
  [[noreturn]] void RunChild(char* const argv[], const Environment& environment) const {
    for (const char* name : {"DISPLAY", "STAGEPATH", "STAGE_CL_DEVICE", "POSIXLY_CORRECT"})
      unsetenv(name);
    for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    if (chdir(directory_.c_str()) == 0 && dup2(open("out", flags, 0644), 1) == 1 &&
        dup2(open("err", flags, 0644), 2) == 2)
      execv(argv[0], argv);
    _exit(127);
  }

  fs::path directory_;
  double start_;
  pid_t pid_ = -1;
};

class CliTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "stage-cli-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    directory_ = name;
  }
  void TearDown() override {
    std::error_code ignored;
    fs::remove_all(directory_, ignored);
  }

  fs::path Path(const std::string& name) const { return directory_ / name; }

  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories(Path(name).parent_path());
    std::ofstream(Path(name)) << text;
  }
  /// Writes a world with one model.
  void WriteWorld(const std::string& name, const std::string& text) const {
    Write(name, text + "\nmodel( name \"m\" )\n");
  }
  /// Writes a world with two robots, one of which runs and has a noisy sensor with 90 rays.
  void WriteRobots(const std::string& name, const std::string& text) const {
    Write(name, text +
                    "\ndefine scanner ranger( alwayson 1 pose [0 0 -0.1 0] sensor( range [0 8] fov "
                    "180 samples 90"
                    " noise [0.1 0 0] ) )\ndefine robot position( size [0.5 0.5 0.2] )\n"
                    "robot( alwayson 1 scanner() )\nrobot( pose [4 0 0 0] )\n"
                    "model( pose [2 0 0 0] size [1 1 5] )\n");
  }

  Result Stage(const Strings& arguments, const Environment& environment = {}) const {
    Result result = Process(directory_, arguments, environment).Finish();
    EXPECT_FALSE(result.hung) << result.out << result.err;
    return result;
  }
  void ExpectStatus(int status, const Strings& arguments) const {
    const Result r = Stage(arguments);
    EXPECT_EQ(r.status, status) << testing::PrintToString(arguments) << "\n" << r.out << r.err;
  }
  /// Expects status 2, one line on standard error that contains `part`, and no standard output.
  void ExpectRefused(const Strings& arguments, const std::string& part) const {
    const Result r = Stage(arguments);
    EXPECT_EQ(r.status, 2) << testing::PrintToString(arguments);
    EXPECT_EQ(r.out, "");
    EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
    EXPECT_TRUE(Contains(r.err, part)) << r.err;
  }
  /// Expects that loading fails with a message that contains `part`, and that no run begins.
  void ExpectLoadFails(int status, const Strings& arguments, const std::string& part,
                       const Environment& environment = {}) const {
    const Result r = Stage(arguments, environment);
    EXPECT_EQ(r.status, status) << testing::PrintToString(arguments) << r.err;
    EXPECT_TRUE(Contains(r.err, part)) << r.err;
    EXPECT_FALSE(Contains(r.out, "done")) << r.out;
    EXPECT_TRUE(Clocks(r.out).empty());
    EXPECT_LT(r.seconds, 10);
  }
  nlohmann::json Stats(const std::string& name) const {
    return nlohmann::json::parse(ReadFile(Path(name)));
  }

  fs::path directory_;
};

}  // namespace cli_testing

#endif
