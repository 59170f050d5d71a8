// SPDX-License-Identifier: GPL-2.0-or-later
//
// A driver that fails, aborts, crashes or hangs in any of its calls, in the child process that
// tries it first or in the program itself. The run either continues with the same results, or ends
// at once with one line that names the call and a workaround.

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/cli_testing.hh"
#include "support/device.hh"
#include "support/sanitized.hh"

namespace {

using namespace cli_testing;

struct Fault {
  std::string call;
  int number;
  std::string kind, process;

  std::string Text() const {
    return call + ":" + std::to_string(number) + ":" + kind + ":" + process;
  }
};

class CallsTest : public CliTest {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers must be the first library, and they catch crashes";
    CliTest::SetUp();
    if (!fs::exists(shim_)) GTEST_SKIP() << "the OpenCL headers are not installed";
    if (const std::string none = device::WhyNone(); !none.empty()) GTEST_SKIP() << none;
    WriteRobots("w.world", "quit_time 1");
    plain_ = HashOf(Stage({"-g", "w.world", "--state-hash"}).out);
    ASSERT_NE(plain_, "");
  }

  static std::string HashOf(const std::string& out) {
    const size_t at = out.find("state-hash ");
    return at == std::string::npos ? "" : out.substr(at, 27);
  }

  /// Starts a run with a faulty driver in a separate folder.
  std::unique_ptr<Process> Start(const std::string& name, Environment environment) const {
    fs::create_directories(Path(name));
    environment.emplace_back("LD_PRELOAD", shim_);
    return std::make_unique<Process>(
        Path(name), Strings{"-g", Path("w.world"), "--state-hash", "--opencl-always", "--opencl"},
        environment);
  }

  /// Number of calls by process and name, without faults.
  std::map<std::string, std::map<std::string, int>> CountCalls() const {
    const Result result = Start("recorded", {{"STAGE_FAULT_LOG", Path("log")}})->Finish();
    EXPECT_EQ(HashOf(result.out), plain_) << result.err;
    EXPECT_EQ(result.err, "");
    std::map<std::string, std::map<std::string, int>> counts;
    std::ifstream log(Path("log"));
    for (std::string process, call; log >> process >> call;) counts[process][call]++;
    return counts;
  }
  /// Faults in the first call of each name in both processes, and in one in the middle of the run.
  std::vector<Fault> AllFaults(const std::string& kind) const {
    std::vector<Fault> faults;
    for (const auto& [process, calls] : CountCalls())
      for (const auto& [call, count] : calls) {
        faults.push_back({call, 1, kind, process});
        if (process == "parent" && count > 10) faults.push_back({call, count - 2, kind, process});
      }
    EXPECT_GT(faults.size(), 50u);
    return faults;
  }

  /// Runs the program once for each fault, several at a time.
  void ExpectAllEndWell(const std::vector<Fault>& faults, const std::string& timeout) const {
    constexpr size_t kAtATime = 16;
    for (size_t begin = 0; begin < faults.size(); begin += kAtATime) {
      std::vector<std::unique_ptr<Process>> runs;
      const size_t end = std::min(begin + kAtATime, faults.size());
      for (size_t i = begin; i < end; i++)
        runs.push_back(Start(std::to_string(i),
                             {{"STAGE_FAULT", faults[i].Text()}, {"STAGE_CL_TIMEOUT", timeout}}));
      for (size_t i = begin; i < end; i++) {
        SCOPED_TRACE(faults[i].Text());
        ExpectEndsWell(faults[i], runs[i - begin]->Finish());
      }
    }
  }

  void ExpectEndsWell(const Fault& fault, const Result& result) const {
    EXPECT_FALSE(result.hung);
    const bool saved = fault.kind == "error" || fault.process == "child";
    EXPECT_EQ(result.status, saved ? 0 : StatusOf(fault.kind)) << result.err;
    EXPECT_EQ(CountOf(result.err, "stage: "), CountOf(result.err, "\n")) << result.err;
    if (saved) {
      EXPECT_EQ(HashOf(result.out), plain_);
      EXPECT_LE(CountOf(result.err, "stage: warning: "), 1u) << result.err;
    } else {
      EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
      EXPECT_TRUE(Contains(result.err, "without --opencl")) << result.err;
      EXPECT_TRUE(Contains(result.err, "OpenCL driver")) << result.err;
    }
    if (fault.kind == "error") return;  // some calls' results are optional
    EXPECT_EQ(CountOf(result.err, fault.call), 1u) << result.err;
  }
  static int StatusOf(const std::string& kind) {
    return kind == "abort" ? 128 + SIGABRT : kind == "segv" || kind == "thread" ? 128 + SIGSEGV : 1;
  }

  std::string plain_;
  const std::string shim_ =
      std::string(std::getenv("STAGE_BINARY_DIR") ? std::getenv("STAGE_BINARY_DIR") : ".") +
      "/tests/faulty_opencl.so";
};

TEST_F(CallsTest, ThatFail) { ExpectAllEndWell(AllFaults("error"), "60"); }

TEST_F(CallsTest, ThatAbort) { ExpectAllEndWell(AllFaults("abort"), "60"); }

TEST_F(CallsTest, ThatCrash) { ExpectAllEndWell(AllFaults("segv"), "60"); }

TEST_F(CallsTest, ThatHang) { ExpectAllEndWell(AllFaults("hang"), "3"); }

TEST_F(CallsTest, ThatEndTheProcess) {
  ExpectAllEndWell({{"clBuildProgram", 1, "exit", "child"},
                    {"clBuildProgram", 1, "exit", "parent"},
                    {"clFinish", 5, "exit", "parent"}},
                   "60");
}

TEST_F(CallsTest, ThatCrashInAThreadOfTheDriver) {
  ExpectAllEndWell({{"clFinish", 1, "thread", "child"}, {"clFinish", 5, "thread", "parent"}}, "60");
}

// The result of a child process that died is remembered; the program does not try again.
TEST_F(CallsTest, AreTriedOnceForSeveralWorlds) {
  const std::string world = Path("w.world");
  const auto log_of = [&](const std::string& name, const Strings& worlds) {
    fs::create_directories(Path(name));
    const Environment environment = {{"LD_PRELOAD", shim_},
                                     {"STAGE_FAULT_LOG", Path(name + ".log")}};
    Strings arguments = worlds;
    arguments.insert(arguments.end(), {"-g", "--opencl-always", "--opencl"});
    EXPECT_EQ(Process(Path(name), arguments, environment).Finish().status, 0);
    return ReadFile(Path(name + ".log"));
  };
  const std::string one = log_of("one", {world}), both = log_of("both", {world, world});
  EXPECT_EQ(CountOf(both, "child clBuildProgram"), 1u);
  EXPECT_EQ(CountOf(both, "parent clBuildProgram"), 2u);
  EXPECT_GE(CountOf(one, "parent clGetDeviceIDs"), 2u);  // number, then ids, of each driver
  EXPECT_EQ(CountOf(both, "parent clGetDeviceIDs"), CountOf(one, "parent clGetDeviceIDs"));
}

// ---- calls of the plug-in -----------------------------------------------------------------------

/// All matches of the expression's first group.
std::set<std::string> AllMatches(const std::string& text, const std::string& expression) {
  const std::regex pattern(expression);
  std::set<std::string> found;
  for (auto i = std::sregex_iterator(text.begin(), text.end(), pattern);
       i != std::sregex_iterator(); ++i)
    found.insert((*i)[1]);
  return found;
}

std::string OutputOf(const std::string& command) {
  std::string output;
  FILE* const pipe = popen(command.c_str(), "r");
  for (int c; pipe && (c = std::fgetc(pipe)) != EOF;) output += static_cast<char>(c);
  if (pipe) pclose(pipe);
  return output;
}

TEST_F(CallsTest, AreAllMarkedAndAllTested) {
  const fs::path build = std::getenv("STAGE_BINARY_DIR") ? std::getenv("STAGE_BINARY_DIR") : ".";
  const fs::path source = std::getenv("STAGE_SOURCE_DIR") ? std::getenv("STAGE_SOURCE_DIR") : ".";
  const auto marked = AllMatches(ReadFile(source / "libstage_cl/opencl.hh"),
                                 "#define (cl[A-Z]\\w+) STAGE_CL_MARKED");
  const auto tested = AllMatches(ReadFile(source / "tests/opencl/shim/faulty_opencl.cc"),
                                 "\nFAULTY\\((cl[A-Z]\\w+)\\)");
  std::set<std::string> called;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(build / "lib"))
    if (entry.path().filename() == "stage_cl.so")
      called = AllMatches(OutputOf("nm -D --undefined-only '" + entry.path().string() + "'"),
                          " U (cl[A-Z]\\w+)");
  EXPECT_EQ(marked, tested);
  EXPECT_EQ(marked, called) << "calls of OpenCL 1.2 would exclude old drivers";
}

}  // namespace
