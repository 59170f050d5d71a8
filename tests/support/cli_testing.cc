// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/cli_testing.hh"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "support/json.hh"

namespace cli_testing {

void Nap() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

std::string ReadFile(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

bool MatchesPart(const std::string& text, const std::string& expression) {
  return testing::Matcher<const std::string&>(testing::ContainsRegex(expression)).Matches(text);
}

size_t CountOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) count++;
  return count;
}

Strings Clocks(const std::string& out) {
  const std::string before = "\r[Stage: ";
  Strings found;
  for (size_t at = out.find(before); at != std::string::npos; at = out.find(before, at + 1)) {
    const size_t begin = at + before.size();
    found.push_back(out.substr(begin, out.find(']', begin) - begin));
  }
  return found;
}

std::string Program() {
  const char* build = std::getenv("STAGE_BINARY_DIR");
  return std::string(build ? build : ".") + "/bin/stage";
}

Process::Process(const fs::path& directory, const Strings& arguments,
                 const Environment& environment)
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

Result Process::Finish(double limit) {
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

void Process::RunChild(char* const argv[], const Environment& environment) const {
  for (const char* name : {"DISPLAY", "STAGEPATH", "STAGE_CL_DEVICE", "POSIXLY_CORRECT"})
    unsetenv(name);
  for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
  const int flags = O_WRONLY | O_CREAT | O_TRUNC;
  if (chdir(directory_.c_str()) == 0 && dup2(open("out", flags, 0644), 1) == 1 &&
      dup2(open("err", flags, 0644), 2) == 2)
    execv(argv[0], argv);
  _exit(127);
}

void CliTest::SetUp() {
  std::string name = (fs::temp_directory_path() / "stage-cli-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  directory_ = name;
}

void CliTest::TearDown() {
  std::error_code ignored;
  fs::remove_all(directory_, ignored);
}

void CliTest::Write(const std::string& name, const std::string& text) const {
  fs::create_directories(Path(name).parent_path());
  std::ofstream(Path(name)) << text;
}

void CliTest::WriteWorld(const std::string& name, const std::string& text) const {
  Write(name, text + "\nmodel( name \"m\" )\n");
}

void CliTest::WriteRobots(const std::string& name, const std::string& text) const {
  Write(name, text +
                  "\ndefine scanner ranger( alwayson 1 pose [0 0 -0.1 0] sensor( range [0 8] fov "
                  "180 samples 90"
                  " noise [0.1 0 0] ) )\ndefine robot position( size [0.5 0.5 0.2] )\n"
                  "robot( alwayson 1 scanner() )\nrobot( pose [4 0 0 0] )\n"
                  "model( pose [2 0 0 0] size [1 1 5] )\n");
}

Result CliTest::Stage(const Strings& arguments, const Environment& environment) const {
  Result result = Process(directory_, arguments, environment).Finish();
  EXPECT_FALSE(result.hung) << result.out << result.err;
  return result;
}

void CliTest::ExpectStatus(int status, const Strings& arguments) const {
  const Result r = Stage(arguments);
  EXPECT_EQ(r.status, status) << testing::PrintToString(arguments) << "\n" << r.out << r.err;
}

void CliTest::ExpectRefused(const Strings& arguments, const std::string& part) const {
  const Result r = Stage(arguments);
  EXPECT_EQ(r.status, 2) << testing::PrintToString(arguments);
  EXPECT_EQ(r.out, "");
  EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
  EXPECT_TRUE(Contains(r.err, part)) << r.err;
}

void CliTest::ExpectLoadFails(int status, const Strings& arguments, const std::string& part,
                              const Environment& environment) const {
  const Result r = Stage(arguments, environment);
  EXPECT_EQ(r.status, status) << testing::PrintToString(arguments) << r.err;
  EXPECT_TRUE(Contains(r.err, part)) << r.err;
  EXPECT_FALSE(Contains(r.out, "done")) << r.out;
  EXPECT_TRUE(Clocks(r.out).empty());
  EXPECT_LT(r.seconds, 10);
}

nlohmann::json CliTest::Stats(const std::string& name) const {
  return ParseJson(ReadFile(Path(name)));
}

}  // namespace cli_testing
