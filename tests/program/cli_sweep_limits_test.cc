// SPDX-License-Identifier: GPL-2.0-or-later
//
// stage sweep with harmful controllers: whatever they do and when, the sweep ends in time, reports
// the failure, stops on Ctrl-C, and leaves no process behind.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "support/cli_testing.hh"
#include "support/emulated.hh"
#include "support/json.hh"
#include "support/sanitized.hh"

namespace cli_testing {
namespace {

using Json = nlohmann::json;

/// An action of the controller and the sweep's message about it: in the record of a run, and as the
/// sweep's error if it happens during the first check. "done": the run succeeds.
struct Deed {
  const char *name, *at_a_step, *while_loading;
};

constexpr char kTooLong[] = "took more than ", kTooLarge[] = "took more than 150 MB of memory",
               kClosed[] = "closed the file that its replies go to";

const std::vector<Deed> kDeeds = {
    {"close_files_and_sleep", kClosed, kClosed},
    {"close_replies_and_sleep", kClosed, kClosed},
    {"close_output_and_sleep", kTooLong, kTooLong},
    {"close_files_and_go_on", "done", "exit status 1"},
    {"child_and_exit", "exit status 3", "exit status 3"},
    {"child_and_sleep", kTooLong, kTooLong},
    {"child_and_go_on", "done", "done"},
    {"ignore_signals", kTooLong, kTooLong},
    {"stop", kTooLong, kTooLong},
    {"print_without_end", kTooLong, kTooLong},
    {"print_without_line_ends", kTooLong, kTooLong},
    {"reply_without_end", "replied 'done 7', expected", "replied 'done 7', expected"},
    {"reply_without_line_ends", "replied with an overlong line", "replied with an overlong line"},
    {"exit", "exit status 0", "exit status 0"},
    {"abort", "SIGABRT", "SIGABRT"},
    {"kill", "SIGKILL", "SIGKILL"},
    {"become_sleep", kClosed, kClosed},
    {"become_true", "exit status 0", "exit status 0"},
    {"become_yes", kClosed, kClosed},
    {"spin", kTooLong, kTooLong},
    {"sleep", kTooLong, kTooLong},
};

/// These need a memory limit, which sanitizers exceed by themselves.
const std::vector<Deed> kHungryDeeds = {
    {"eat_memory", kTooLarge, kTooLarge},
    {"child_eats_memory", kTooLarge, kTooLarge},
};

/// Time of the controller's action.
enum class Phase { kFirstLook, kLoadOfARun, kStep };
constexpr Phase kPhases[] = {Phase::kFirstLook, Phase::kLoadOfARun, Phase::kStep};
const char* NameOf(Phase phase) {
  return phase == Phase::kFirstLook ? "first_look" : phase == Phase::kStep ? "step" : "load";
}

class SweepLimitsTest : public CliTest {
 protected:
  /// A sweep of two runs in a separate folder.
  struct Case {
    Deed deed;
    Phase phase;
    fs::path folder;
    std::unique_ptr<Process> process;
    double started = 0;
    std::string Name() const { return std::string(deed.name) + " " + NameOf(phase); }
  };

  void SetUp() override {
    if (Stg::test::IsEmulated()) GTEST_SKIP() << "the emulator ends differently";
    CliTest::SetUp();
  }

  /// Writes the world and, for actions in a run, the plan.
  Case Prepare(const Deed& deed, Phase phase) const {
    Case made{deed, phase, Path(std::string(deed.name) + NameOf(phase)), nullptr, 0};
    const std::string controller = std::string(std::getenv("STAGE_BINARY_DIR")) +
                                   "/tests/plugins/nasty.so " + deed.name +
                                   (phase == Phase::kStep ? " step" : " load");
    fs::create_directory(made.folder);
    std::ofstream(made.folder / "w.world")
        << "quit_time 0.3\nmodel( name \"m\" ctrl \"" << controller << "\" )\n";
    if (phase == Phase::kFirstLook) return made;
    const Strings words = {"sweep", "w.world", "--runs", "0:2", "--plan-only", "-o", "sw"};
    EXPECT_EQ(Process(made.folder, words, {}).Finish().status, 0);
    return made;
  }

  static void Start(Case* one, const Strings& limits) {
    Strings words = {"sweep", "--jobs", "1"};
    words.insert(words.end(), limits.begin(), limits.end());
    const Strings what = one->phase == Phase::kFirstLook
                             ? Strings{"w.world", "--runs", "0:2", "-o", "sw"}
                             : Strings{"--resume", "sw"};
    words.insert(words.end(), what.begin(), what.end());
    one->process = std::make_unique<Process>(one->folder, words, Environment{{"STAGE_NASTY", "1"}});
    one->started = WallClock();
  }

  /// Ids and names of processes whose working directory is that folder; zombies have none.
  static Strings ProcessesIn(const fs::path& folder) {
    Strings found;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator("/proc", ignored)) {
      const std::string name = entry.path().filename();
      if (name.find_first_not_of("0123456789") != std::string::npos) continue;
      if (fs::read_symlink(entry.path() / "cwd", ignored) == folder)
        found.push_back(name + " " + ReadFile(entry.path() / "cmdline"));
    }
    return found;
  }
  static void ExpectNobodyIn(const fs::path& folder) {
    for (int i = 0; i < 50 && !ProcessesIn(folder).empty(); i++)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));  // reading /proc takes some, too
    EXPECT_EQ(ProcessesIn(folder), Strings{});
  }

  static void ExpectSaid(const Case& one, const Result& result) {
    const bool looks = one.phase == Phase::kFirstLook;
    const std::string expected =
        one.phase == Phase::kStep ? one.deed.at_a_step : one.deed.while_loading;
    const bool is_done = expected == "done" || (expected == "exit status 1" && !looks);
    EXPECT_EQ(result.status, is_done ? 0 : 1) << result.err;
    if (is_done) {
      EXPECT_EQ(result.err, "");
      return;
    }
    EXPECT_TRUE(Contains(result.err, expected)) << result.err;
    EXPECT_EQ(fs::exists(one.folder / "sw"), !looks);
    if (looks) return;
    const Json record = Json::parse(ReadFile(one.folder / "sw/runs/000/000001.json"));
    EXPECT_EQ(record["status"], "failed");
    EXPECT_TRUE(Contains(record["reason"], expected)) << record["reason"];
  }

  /// Runs all actions in all phases, several at the same time.
  void ForEachCase(const std::vector<Deed>& deeds, const Strings& limits,
                   const std::function<void(Case*)>& look) const {
    constexpr size_t kAtOnce = 7;
    std::vector<Case> cases;
    for (const Phase phase : kPhases)
      for (const Deed& deed : deeds) cases.push_back(Prepare(deed, phase));
    for (size_t begin = 0; begin < cases.size(); begin += kAtOnce) {
      const size_t end = std::min(begin + kAtOnce, cases.size());
      for (size_t i = begin; i < end; i++) Start(&cases[i], limits);
      for (size_t i = begin; i < end; i++) {
        SCOPED_TRACE(cases[i].Name());
        look(&cases[i]);
        ExpectNobodyIn(cases[i].folder);
      }
    }
  }
};

TEST_F(SweepLimitsTest, EverySweepEndsInTimeAndSaysWhatWasWrong) {
  // Allows some seconds for two runs with up to three attempts each.
  const double slowness = patience::Slowness(), longest = 40 * slowness;
  ForEachCase(kDeeds, {"--limit-seconds", std::to_string(slowness)}, [longest](Case* one) {
    const Result result = one->process->Finish(longest);
    EXPECT_FALSE(result.hung);
    ExpectSaid(*one, result);
  });
}

TEST_F(SweepLimitsTest, MemoryOfControllersAndTheirChildrenIsLimited) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need more memory";
  ForEachCase(kHungryDeeds, {"--limit-seconds", "600", "--limit-mb", "150"}, [](Case* one) {
    const Result result = one->process->Finish();
    EXPECT_FALSE(result.hung);
    ExpectSaid(*one, result);
  });
}

TEST_F(SweepLimitsTest, CtrlCEndsEverySweepAtOnce) {
  ForEachCase(kDeeds, {}, [](Case* one) {
    while (WallClock() - one->started < 0.5) Nap();  // until the action happens
    const double sent = WallClock();
    one->process->Send(SIGINT);
    const Result result = one->process->Finish();
    EXPECT_FALSE(result.hung);
    EXPECT_LT(WallClock() - sent, 10 * patience::Slowness());
    EXPECT_TRUE(result.status == 128 + SIGINT || result.status <= 1) << result.status;
  });
}

/// Workers may be killed from outside, for instance by the system when it runs out of memory.
TEST_F(SweepLimitsTest, WorkerKilledDuringTheCheckIsReplaced) {
  Write("worker.sh",
        "#!/bin/sh\n[ -e tried ] || { touch tried; kill -9 $$; }\n"
        "exec \"$STAGE\" sweep-worker \"$@\"\n");
  fs::permissions(Path("worker.sh"), fs::perms::owner_all);
  WriteWorld("w.world", "quit_time 0.3");
  const Result result = Stage({"sweep", "w.world", "--worker", Path("worker.sh"), "-o", "sw"},
                              {{"STAGE", Program()}});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(fs::exists(Path("tried")));
}

TEST_F(SweepLimitsTest, AWorkerThatLeavesNoRecordHasFailed) {
  Write("worker.sh",
        "#!/bin/sh\nwhile read -r order index rest <&3; do\n"
        "  if [ $order = check ]; then echo ok >&4; else echo done $index >&4; fi\ndone\n");
  fs::permissions(Path("worker.sh"), fs::perms::owner_all);
  WriteWorld("w.world", "quit_time 0.3");
  const Result result = Stage({"sweep", "w.world", "--worker", Path("worker.sh"), "-o", "sw"});
  EXPECT_EQ(result.status, 1);
  EXPECT_TRUE(Contains(result.err, "replied 'done 0', but left no record")) << result.err;
}

}  // namespace
}  // namespace cli_testing
