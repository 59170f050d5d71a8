// SPDX-License-Identifier: GPL-2.0-or-later
//
// --log and replay on the command line: effects, and error messages of one line.

#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>

#include "support/cli_testing.hh"
#include "support/json.hh"
#include "support/shipped_worlds.hh"

namespace {

using namespace cli_testing;

class LogCli : public CliTest {
 protected:
  std::string Record(const Strings& more = {}) const {
    Strings arguments = {"-g",    "--duration", "2",
                         "--log", "run.mcap",   SourceFile("worlds/simple.world")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Result result = Stage(arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return ReadFile(Path("run.mcap"));
  }
  void ExpectFails(const Strings& arguments, const std::string& part) const {
    const Result result = Stage(arguments);
    EXPECT_EQ(result.status, 1) << result.out;
    EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
    EXPECT_TRUE(Contains(result.err, part)) << result.err;
  }
};

TEST_F(LogCli, MistakesAreOneLine) {
  WriteWorld("w.world", "");
  ExpectRefused({"--log", "", "w.world"}, "--log: found '', expected the name of a file");
  ExpectRefused({"--log", "w.world", "w.world"}, "not a world file");
  ExpectRefused({"--log", "no/such.mcap", "w.world"}, "can't be written: No such file");
  ExpectRefused({"--log", "a.mcap", "w.world", "w.world"}, "--log: found 2 world files");
  ExpectRefused({"--log-every", "1", "w.world"}, "--log-every is for --log");
  ExpectRefused({"--log", "a.mcap", "--log-every", "0", "w.world"}, "simulated seconds");
  ExpectRefused({"--log", "a.mcap", "--log-models", "a,,b", "w.world"}, "with a comma");
  ExpectRefused({"--log", "a.mcap", "--log-compression", "zip", "w.world"}, "none, lz4 or zstd");
  ExpectRefused({"--log", "a", "--stats", "a", "w.world"}, "a name that no other output has");
  Write("notes.txt", "mine");
  ExpectRefused({"--log", "notes.txt", "w.world"}, "it exists and is not an MCAP file");
  EXPECT_EQ(ReadFile(Path("notes.txt")), "mine");
  ExpectRefused({"replay"}, "replay: found 0 files");
  ExpectRefused({"replay", "a", "b"}, "replay: found 2 files");
  ExpectRefused({"replay", "a.mcap", "--log", "b.mcap"}, "replay: found an option of runs");
}

TEST_F(LogCli, BagInfoCountsTheMessagesOfEachTopic) {
  Record();
  const Result result = Stage({"bag", "info", "run.mcap"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_TRUE(Contains(result.out, "run.mcap: ")) << result.out;
  EXPECT_TRUE(Contains(result.out, "world: simple.world")) << result.out;
  std::map<std::string, std::string> lines;  // by topic
  std::istringstream text(result.out);
  for (std::string line; std::getline(text, line);) lines[line.substr(0, line.find(' '))] = line;
  EXPECT_TRUE(Contains(lines["/clock"], " 21 ")) << "the start and 20 steps: " << lines["/clock"];
  EXPECT_TRUE(Contains(lines["/clock"], " 10 ")) << "10 per second: " << lines["/clock"];
  EXPECT_TRUE(Contains(lines["/map"], " 1  ")) << lines["/map"];
  EXPECT_TRUE(Contains(lines["/map"], " - ")) << "no rate: " << lines["/map"];
  EXPECT_TRUE(Contains(lines["/r0/odom"], "nav_msgs/msg/Odometry")) << result.out;
}

TEST_F(LogCli, BagInfoTellsLogsThatEndEarlyAndRefusesOthers) {
  const std::string whole = Record();
  Write("cut.mcap", whole.substr(0, whole.size() * 8 / 10));
  const Result result = Stage({"bag", "info", "cut.mcap"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "ends early")) << result.out;
  Write("notes.txt", "mine");
  ExpectFails({"bag", "info", "notes.txt"}, "notes.txt");
  ExpectFails({"bag", "info", "missing.mcap"}, "missing.mcap");
  ExpectRefused({"bag", "info"}, "expected 'stage bag info LOG'");
  ExpectRefused({"bag", "tell", "run.mcap"}, "expected 'stage bag info LOG'");
}

TEST_F(LogCli, ReplacesAnExistingLog) {
  const std::string first = Record();
  EXPECT_GT(first.size(), 1000u);
  EXPECT_EQ(Record(), first);
}

TEST_F(LogCli, UnknownRobotsEndTheRun) {
  const Result result = Stage({"-g", "--duration", "1", "--log", "a.mcap", "--log-models", "x,y",
                               SourceFile("worlds/simple.world")});
  EXPECT_EQ(result.status, 1);
  EXPECT_TRUE(Contains(result.err,
                       "--log-models: found no robot called \"x\" or matching the other patterns"));
}

TEST_F(LogCli, AFullDiskEndsTheRun) {
  const Result result =
      Stage({"-g", "--duration", "600", "--log", "/dev/full", SourceFile("worlds/cave.world")});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
  EXPECT_TRUE(Contains(result.err, "\"/dev/full\" can't be written: No space left")) << result.err;
}

TEST_F(LogCli, AReplayMakesThePicturesOfTheRun) {
  Record();
  for (const char* time : {"0", "0.7", "2"}) {
    const std::string at = std::string("@") + time, size = "160x120";
    const Result of_replay =
        Stage({"replay", "run.mcap", "--screenshot", "replay.png" + at, "--size", size});
    if (Contains(of_replay.err, "no pictures")) GTEST_SKIP() << of_replay.err;
    EXPECT_EQ(of_replay.status, 0) << of_replay.err;
    Stage({"--screenshot", "run.png" + at, "--size", size, SourceFile("worlds/simple.world")});
    EXPECT_GT(ReadFile(Path("run.png")).size(), 1000u);
    EXPECT_TRUE(ReadFile(Path("run.png")) == ReadFile(Path("replay.png"))) << time;
  }
}

TEST_F(LogCli, AReplayEndsWithItsLog) {
  Record();
  const Result result = Stage({"replay", "run.mcap", "-g", "--stats", "s.json"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(Stats("s.json")["simulated_seconds"], 2);
  EXPECT_EQ(Stage({"replay", "run.mcap", "-g", "--duration", "1", "--stats", "s.json"}).status, 0);
  EXPECT_EQ(Stats("s.json")["simulated_seconds"], 1);
}

/// The world of a log is loaded like any other: with the library initialized, and without a line
/// for each model.
TEST_F(LogCli, AReplayOfManyRobotsWarnsOfLeftOutControllersAlone) {
  ASSERT_EQ(
      Stage({"-g", "--duration", "1", "--log", "cave.mcap", SourceFile("worlds/cave.world")}).err,
      "");
  for (const Strings& arguments :
       std::vector<Strings>{{"-g"},
                            {"--screenshot", "cave.png", "--size", "64x48"},
                            {"--record", "frames", "--size", "64x48"}}) {
    Strings all = {"replay", "cave.mcap"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Result result = Stage(all);
    if (Contains(result.err, "no pictures")) GTEST_SKIP() << result.err;
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.err, "stage: warning: controllers ignored as requested: 100\n");
  }
}

TEST_F(LogCli, ABadLogIsRefusedInOneLine) {
  std::string log = Record();
  ExpectFails({"replay", "none.mcap"}, "none.mcap: No such file");
  Write("a.mcap", "not at all");
  ExpectFails({"replay", "a.mcap"}, "a.mcap: found no MCAP signature, expected an MCAP file");
  Write("a.mcap", log.substr(0, 100));
  ExpectFails({"replay", "a.mcap"}, "a.mcap: found no world file in the log");
  log[log.size() / 2] ^= 1;
  Write("a.mcap", log);
  ExpectFails({"replay", "a.mcap"}, "damaged");
}

}  // namespace
