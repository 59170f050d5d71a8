// SPDX-License-Identifier: GPL-2.0-or-later
//
// stage sweep and stage merge: runs, resumption after kills, rejected arguments.

#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "support/cli_testing.hh"
#include "support/device.hh"
#include "support/emulated.hh"
#include "support/json.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace cli_testing {
namespace {

using Json = nlohmann::json;

/// Splits a command line into words like a shell.
Strings WordsOf(const std::string& line) {
  Strings words(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '\'')
      quoted = !quoted;
    else if (c == ' ' && !quoted)
      words.emplace_back();
    else
      words.back() += c;
  }
  return words;
}

class SweepTest : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    Write("w.world",
          "quit_time 1\nresolution 0.1\n"
          "define robot position( size [0.3 0.3 0.3] alwayson 1\n"
          "  ranger( alwayson 1 sensor( range [0 3] samples 5 noise [0.1 0 0] ) ) )\n"
          "population( name \"robots\" model \"robot\" count 3 area [-4 -4 4 4] )\n"
          "metric( kind \"coverage\" )\n");
  }

  Json Record(const std::string& folder, int index) const {
    char name[60];
    std::snprintf(name, sizeof name, "/runs/%03d/%06d.json", index / 1000, index);
    return Json::parse(ReadFile(Path(folder + name)));
  }
  std::string Merged(const std::string& folder) const {
    const std::string file = folder + ".csv";
    ExpectStatus(0, {"merge", folder, "-o", file});
    return ReadFile(Path(file));
  }
  Result Sweep(Strings arguments) const {
    arguments.insert(arguments.begin(), "sweep");
    return Stage(arguments);
  }
  /// Runs the record's replay command and returns its state hash.
  std::string Replay(const Json& record) const {
    Strings words = WordsOf(record["replay"]);
    words.erase(words.begin());
    const Result r = Stage(words);
    const std::string before = "state-hash ";
    const size_t at = r.out.find(before);
    return at == std::string::npos ? r.out + r.err : r.out.substr(at + before.size(), 16);
  }
};

TEST_F(SweepTest, RunsAllCombinations) {
  const Result r = Sweep({"w.world", "--set", "robots=2,4", "--set", "world.resolution=0.1,0.2",
                          "--runs", "3:6", "--jobs", "2", "-o", "sw"});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(r.err, "");
  std::set<uint64_t> seeds;
  for (int i = 0; i < 12; i++) {
    const Json record = Record("sw", i);
    EXPECT_EQ(record["status"], "done");
    EXPECT_EQ(record["set"]["robots"], i < 6 ? "2" : "4");
    EXPECT_EQ(record["set"]["world.resolution"], i / 3 % 2 == 0 ? "0.1" : "0.2");
    EXPECT_EQ(record["run"], 3 + i % 3);
    EXPECT_EQ(record["robots"], i < 6 ? 2 : 4);
    EXPECT_EQ(record["steps"], 10);
    EXPECT_GT(record["metrics"]["coverage"], 0);
    seeds.insert(record["seed"].get<uint64_t>());
    EXPECT_EQ(Replay(record), record["state_hash"].get<std::string>()) << i;
  }
  EXPECT_EQ(seeds.size(), 12u);
  const std::string table = Merged("sw");
  EXPECT_EQ(table.rfind("index,run,seed,robots,world.resolution,status,state_hash,steps,", 0), 0u);
  EXPECT_EQ(CountOf(table, "\n"), 13u);
}

/// The table does not depend on the number of jobs, shards or threads, or on OpenCL.
TEST_F(SweepTest, GivesTheSameTable) {
  const Strings sweep = {"w.world", "--set", "robots=1,3", "--runs", "0:4", "-o"};
  const auto with = [&](const std::string& folder, const Strings& more) {
    Strings words = sweep;
    words.push_back(folder);
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(Sweep(words).status, 0) << folder;
  };
  with("a", {"--jobs", "1"});
  with("b", {"--jobs", "3", "--fresh"});
  with("c", {"--shard", "2/3"});
  with("c", {"--shard", "1/3"});
  with("c", {"--shard", "3/3"});
  with("d", {"--plan-only"});
  EXPECT_EQ(Sweep({"--resume", "d", "--only", "5:8"}).status, 0);
  EXPECT_EQ(Sweep({"--resume", "d", "--only", "0:5"}).status, 0);
  with("e", {"--threads", "2"});
  const std::string table = Merged("a");
  for (const char* folder : {"b", "c", "d"}) EXPECT_EQ(Merged(folder), table) << folder;
  EXPECT_EQ(Merged("e"), table) << "threads change nothing";
  for (const char* folder : {"a", "b", "c", "d", "e"})
    for (const auto& file : fs::directory_iterator(Path(folder)))
      EXPECT_NE(file.path().stem(), "lock") << file;
  if (!device::WhyNone().empty()) GTEST_SKIP() << "except for a device: " << device::WhyNone();
  with("f", {"--opencl"});
  EXPECT_EQ(Merged("f"), table) << "devices change nothing";
}

/// Parts from machines that do not share a folder.
TEST_F(SweepTest, PartsInSeveralFoldersAreMerged) {
  const auto sweep = [&](const std::string& folder, const Strings& more) {
    Strings words = {"w.world", "--set", "robots=1,3", "--runs", "0:4", "-o", folder};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(Sweep(words).status, 0) << folder;
  };
  sweep("whole", {});
  for (const char* part : {"1", "2", "3"}) sweep(part, {"--shard", std::string(part) + "/3"});
  ExpectStatus(0, {"merge", "3", "1", "2", "-o", "all.csv"});
  EXPECT_EQ(ReadFile(Path("all.csv")), Merged("whole"));
  EXPECT_TRUE(
      Contains(Stage({"merge", "1", "2", "-o", "two.csv"}).err, "2 of 8 runs are not finished"));
  ExpectStatus(0, {"merge", "1", "2", "--partial", "-o", "two.csv"});
  EXPECT_EQ(CountOf(ReadFile(Path("two.csv")), "\n"), 7u);
  EXPECT_EQ(Sweep({"w.world", "--runs", "0:8", "--plan-only", "-o", "other"}).status, 0);
  EXPECT_TRUE(Contains(Stage({"merge", "1", "other", "-o", "x.csv"}).err, "different sweeps"));
  ExpectStatus(0, {"merge", "other", "--partial", "-o", "none.csv"});
  EXPECT_EQ(ReadFile(Path("none.csv")),
            "index,run,seed,status,state_hash,steps,simulated_seconds,rays\n");
}

/// A worker command that can't work is an error of the sweep, not a failure of each run.
TEST_F(SweepTest, InvalidWorkerIsAnError) {
  const auto fails = [&](const Strings& words, const std::string& part) {
    const Result r = Sweep(words);
    EXPECT_EQ(r.status, 1) << testing::PrintToString(words);
    EXPECT_TRUE(Contains(r.err, part)) << r.err;
    EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
  };
  // Some end before they receive their first order, some after it.
  for (int i = 0; i < 10; i++) {
    fails({"w.world", "--worker", "no-such-program", "-o", "x"}, "no-such-program");
    fails({"w.world", "--worker", "false", "-o", "x"}, "exit status 1");
  }
  EXPECT_FALSE(fs::exists(Path("x")));
  Write("worker.sh", "#!/bin/sh\nexec \"$STAGE\" sweep-worker \"$@\"\n");
  fs::permissions(Path("worker.sh"), fs::perms::owner_all);
  const std::string worker = Path("worker.sh");
  ASSERT_EQ(setenv("STAGE", Program().c_str(), 1), 0);
  EXPECT_EQ(
      Sweep({"w.world", "--runs", "0:3", "--worker", worker, "--plan-only", "-o", "y"}).status, 0);
  fs::remove(worker);
  fails({"--resume", "y"}, "worker.sh");
  EXPECT_FALSE(fs::exists(Path("y/runs/000/000000.json")));
  EXPECT_EQ(Sweep({"--resume", "y", "--worker", Program() + " sweep-worker"}).status, 0);
  EXPECT_EQ(Record("y", 2)["status"], "done");
}

TEST_F(SweepTest, SeedsDependOnTheValuesAlone) {
  EXPECT_EQ(Sweep({"w.world", "--set", "robots=1,2", "--set", "robot.size=[.1 .1 .1],[.2 .2 .2]",
                   "--runs", "0:2", "-o", "a"})
                .status,
            0);
  EXPECT_EQ(Sweep({"w.world", "--set", "robot.size=[.2 .2 .2]", "--set", "robots=3,2", "--runs",
                   "1:2", "-o", "b"})
                .status,
            0);
  EXPECT_EQ(Record("a", 7)["seed"], Record("b", 1)["seed"]);
  EXPECT_EQ(Record("a", 7)["state_hash"], Record("b", 1)["state_hash"]);
  EXPECT_EQ(Sweep({"w.world", "--set", "robots=1,2", "--runs", "0:2", "--common-seeds", "-o", "c"})
                .status,
            0);
  EXPECT_EQ(Record("c", 1)["seed"], Record("c", 3)["seed"]);
  EXPECT_NE(Record("c", 0)["seed"], Record("c", 1)["seed"]);
}

/// The controller's argument makes it crash, print, wait or end.
TEST_F(SweepTest, FailedRunsAreNamed) {
  if (Stg::test::IsEmulated())
    GTEST_SKIP() << "the emulator prints the last lines of a crashed run";
  Write("f.world", "quit_time 0.2\nposition( name \"a\" )\n");
  const std::string fails =
      std::string(std::getenv("STAGE_BINARY_DIR")) + "/tests/plugins/fails.so ";
  const Result r =
      Sweep({"f.world", "--set",
             "a.ctrl=" + fails + "not," + fails + "crash," + fails + "exit," + fails + "hang",
             "--jobs", "2", "--limit-seconds", "1", "-o", "sw"});
  EXPECT_EQ(r.status, 1) << r.err;
  EXPECT_EQ(Record("sw", 0)["status"], "done");
  const Json crashed = Record("sw", 1), ended = Record("sw", 2), hung = Record("sw", 3);
  EXPECT_EQ(crashed["signal"], "SIGSEGV");
  EXPECT_EQ(crashed["attempts"], 3);
  EXPECT_EQ(crashed["lines"].back(), "about to crash");
  EXPECT_EQ(ended["exit_status"], 7);
  EXPECT_EQ(hung["reason"], "took more than 1 s");
  EXPECT_EQ(hung["attempts"], 1);
  EXPECT_TRUE(Contains(r.err, "fails.so crash has failed: SIGSEGV: about to crash")) << r.err;
  const Result status = Stage({"sweep", "--status", "sw"});
  EXPECT_TRUE(Contains(status.out, "4 of 4 runs finished, 3 of them failed")) << status.out;
  EXPECT_TRUE(Contains(status.out, "stage -g --seed ")) << status.out;
  EXPECT_TRUE(Contains(Merged("sw"), "fails.so crash,failed,")) << "a failed run has its row";
  EXPECT_EQ(
      Sweep({"--resume", "--retry-failed", "--tries", "1", "--limit-seconds", "1", "sw"}).status,
      1);
  EXPECT_EQ(Record("sw", 1)["attempts"], 1);
}

/// Each kill loses at most the runs in progress; the final result is as without kills.
TEST_F(SweepTest, SurvivesKills) {
  const std::string counts = std::string(std::getenv("STAGE_BINARY_DIR")) +
                             "/tests/plugins/counts.so " + Path("starts").string();
  Write("k.world",
        ReadFile(Path("w.world")) + "\nposition( pose [9 9 0 0] ctrl \"" + counts + "\" )\n");
  const Strings sweep = {"sweep",  "k.world", "--set", "robots=1,2,3", "--runs", "0:200",
                         "--jobs", "2",       "-o"};
  Strings whole = sweep, killed = sweep;
  whole.emplace_back("whole");
  killed.emplace_back("killed");
  ExpectStatus(0, whole);
  fs::remove(Path("starts"));
  Strings words = killed;
  uintmax_t kills = 0;
  for (int round = 0; round < 80; round++) {
    const int signal = round % 3 == 0 ? SIGINT : SIGKILL;
    Process process(Path(""), words, {});
    for (int i = 0; i < 4 + 5 * round; i++) Nap();
    process.Send(signal);
    const int status = process.Finish().status;
    if (fs::exists(Path("killed/sweep.json"))) words = {"sweep", "--resume", "killed"};
    if (status == 0) break;
    EXPECT_EQ(status, 128 + signal);
    kills++;
  }
  EXPECT_GT(kills, 2u);
  EXPECT_EQ(Stage(words).status, 0);
  EXPECT_EQ(Merged("killed"), Merged("whole"));
  // Each start may also have loaded a world for each value, to check it.
  EXPECT_LE(fs::file_size(Path("starts")), 600 + 2 * kills + 3 * (kills + 1));
}

TEST_F(SweepTest, ConcurrentSweepsOnOneFolderAreRefused) {
  Write("long.world", "quit_time 1e6\nposition( alwayson 1 )\n");
  Process first(Path(""), {"sweep", "long.world", "--jobs", "1", "-o", "sw"}, {});
  while (!fs::exists(Path("sw/lock.all"))) Nap();
  for (int i = 0; i < 20; i++) Nap();
  fs::create_directory(Path("elsewhere"));
  const Result second = Process(Path("elsewhere"), {"sweep", "--resume", "../sw"}, {}).Finish();
  EXPECT_EQ(second.status, 1);
  EXPECT_TRUE(Contains(second.err, "another stage sweep works on")) << second.err;
  first.Send(SIGINT);
  const Result r = first.Finish();
  EXPECT_EQ(r.status, 128 + SIGINT);
  EXPECT_TRUE(Contains(r.out, "stage sweep --resume sw")) << r.out;
}

TEST_F(SweepTest, ReportsErrorsBeforeTheFirstRun) {
  for (const Strings& words : std::vector<Strings>{
           {"sweep"},
           {"sweep", "w.world"},
           {"sweep", "w.world", "w.world", "-o", "x"},
           {"sweep", "w.world", "-o", "x", "--runs", "5:5"},
           {"sweep", "w.world", "-o", "x", "--runs", "5"},
           {"sweep", "w.world", "-o", "x", "--set", "robots"},
           {"sweep", "w.world", "-o", "x", "--set", "robots=1,,2"},
           {"sweep", "w.world", "-o", "x", "--set", "robots=1,1"},
           {"sweep", "w.world", "-o", "x", "--set", "robots=1", "--set", "robots=2"},
           {"sweep", "w.world", "-o", "x", "--shard", "0/3"},
           {"sweep", "w.world", "-o", "x", "--jobs", "0"},
           {"sweep", "w.world", "-o", "x", "--nonsense"},
           {"sweep", "w.world", "-o", "x", "--runs", "0:100000000", "--set", "robots=1,2"},
           {"sweep", "--resume", "--seed", "3", "x"},
           {"sweep", "--resume", "--status", "x"},
           {"merge"},
           {"merge", "x"},
           {"merge", "x", "-o", "a.txt"}})
    ExpectRefused(words, "'stage ");
  const auto fails = [&](const Strings& words, const std::string& part) {
    const Result r = Stage(words);
    EXPECT_EQ(r.status, 1) << testing::PrintToString(words);
    EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
    EXPECT_TRUE(Contains(r.err, part)) << r.err;
    EXPECT_FALSE(fs::exists(Path("x"))) << testing::PrintToString(words);
  };
  fails({"sweep", "none.world", "-o", "x"}, "none.world");
  fails({"sweep", "w.world", "--set", "robots=1,many", "-o", "x"},
        "run 1 robots=many: --set robots");
  fails({"sweep", "w.world", "--set", "robt.size=1", "-o", "x"}, "did you mean \"robot\"?");
  WriteWorld("endless.world", "");
  fails({"sweep", "endless.world", "-o", "x"}, "expected a --duration");
  fails({"sweep", "--resume", "x"}, "found no sweep in 'x'");
  fails({"merge", "x", "-o", "a.csv"}, "found no sweep in 'x'");
}

TEST_F(SweepTest, FoldersKeepTheirSweep) {
  EXPECT_EQ(Sweep({"w.world", "--runs", "0:2", "-o", "sw"}).status, 0);
  ExpectRefused({"sweep", "w.world", "--runs", "0:3", "-o", "sw"}, "stage sweep --resume sw");
  fs::remove(Path("sw/runs/000/000001.json"));
  Write("sw/runs/000/000000.json", "");
  EXPECT_TRUE(Contains(Stage({"merge", "sw", "-o", "a.csv"}).err, "2 of 2 runs are not finished"));
  Result r = Sweep({"--resume", "sw"});
  EXPECT_TRUE(Contains(r.out, "2 of 2 runs done")) << r.out << r.err;
  Write("w.world", ReadFile(Path("w.world")) + "\n");
  r = Sweep({"--resume", "sw"});
  EXPECT_EQ(r.status, 1);
  EXPECT_TRUE(Contains(r.err, "has changed since the sweep began")) << r.err;
  Write("sw/sweep.json", "{}");
  EXPECT_TRUE(Contains(Sweep({"--status", "sw"}).err, "not the plan of a sweep"));
}

TEST_F(SweepTest, LogsLieBesideTheRecords) {
  EXPECT_EQ(Sweep({"w.world", "--runs", "0:3", "--log-every", "0.5", "-o", "sw"}).status, 0);
  for (int i = 0; i < 3; i++)
    EXPECT_EQ(ReadFile(Path("sw/runs/000/00000" + std::to_string(i) + ".mcap")).substr(1, 4),
              "MCAP");
}

/// A run's log equals that of its replay command with the same options, each of which changes it.
TEST_F(SweepTest, AllOptionsOfLogsReachTheRuns) {
  const std::vector<Strings> options = {{},
                                        {"--log-every", "0.5"},
                                        {"--log-models", "*0"},
                                        {"--log-compression", "none"},
                                        {"--log-ranges", "stage"}};
  const std::string help = Stage({"--help"}).out;
  EXPECT_EQ(CountOf(help, "\n  --log-"), options.size() - 1) << "this test needs a new sweep";
  std::set<std::string> logs;
  for (size_t i = 0; i < options.size(); i++) {
    SCOPED_TRACE(testing::PrintToString(options[i]));
    const std::string folder = "sw" + std::to_string(i);
    Strings words = {"w.world", "--log", "-o", folder};
    words.insert(words.end(), options[i].begin(), options[i].end());
    const Result r = Sweep(words);
    ASSERT_EQ(r.status, 0) << r.err;
    words = WordsOf(Record(folder, 0)["replay"]);
    words[0] = "--log";
    words.insert(words.begin() + 1, "replay.mcap");
    words.insert(words.end(), options[i].begin(), options[i].end());
    ExpectStatus(0, words);
    const std::string log = ReadFile(Path(folder + "/runs/000/000000.mcap"));
    EXPECT_EQ(log, ReadFile(Path("replay.mcap")));
    logs.insert(log);
  }
  EXPECT_EQ(logs.size(), options.size());
}

/// A worker runs these after runs in which a robot left the floor of the file's models.
TEST_F(SweepTest, RunsInWhichARobotLeavesTheFloorCanBeReplayed) {
  Write("leave.world",
        "resolution 0.02\nquit_time 5\n"
        "position( name \"r\" pose [20.2 1 0 0] size [.4 .4 .4] ctrl \"wander\"\n"
        "  ranger( alwayson 1 sensor( range [0 5] fov 180 samples 9 noise [0.1 0 0] ) )\n"
        "  camera( alwayson 1 resolution [8 8] ) )\n");
  ASSERT_EQ(Sweep({"leave.world", "--runs", "0:4", "--jobs", "1", "-o", "sw"}).status, 0);
  for (int i = 0; i < 4; i++)
    EXPECT_EQ(Replay(Record("sw", i)), Record("sw", i)["state_hash"].get<std::string>()) << i;
}

/// Every shipped world with its controllers, run in order in one worker and each separately.
TEST_F(SweepTest, RunsOfShippedWorldsCanBeReplayed) {
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    fs::remove_all(Path("sw"));
    const std::string duration = kSanitized ? "0.5" : "1.5";
    ASSERT_EQ(
        Sweep({file, "--runs", "0:2", "--jobs", "1", "--duration", duration, "-o", "sw"}).status,
        0);
    for (int i = 0; i < 2; i++)
      EXPECT_EQ(Replay(Record("sw", i)), Record("sw", i)["state_hash"].get<std::string>()) << i;
  }
}

}  // namespace
}  // namespace cli_testing
