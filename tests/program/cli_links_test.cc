// SPDX-License-Identifier: GPL-2.0-or-later
//
// Output files whose name is a symbolic link: no file is created at a link's target, and only the
// program's own files are written to.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/cli_testing.hh"

namespace cli_testing {
namespace {

struct Output {
  std::string option, name, after;  // "--log", "a.mcap", ""
  Strings more;
};

class CliLinksTest : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    WriteRobots("w.world", "quit_time 0.5");
    outputs_ = {{"--stats", "a.json", "", {}},
                {"--explain", "b.json", "", {}},
                {"--save-snapshot", "a.snapshot", "@0.2", {}},
                {"--log", "a.mcap", "", {}}};
    const Result shot = Stage({"w.world", "--size", "16x16", "--screenshot", "try.png@0"});
    if (Contains(shot.err, "no pictures"))
      std::puts("pictures are left out: none can be made here");
    else
      outputs_.push_back({"--screenshot", "a.png", "@0", {"--size", "16x16"}});
  }
  Result Run(const Output& output) const {
    Strings words = {"-g", "w.world"};
    if (output.option == "--explain")
      words.insert(words.end(), {"--explain", "--stats"});
    else
      words.push_back(output.option);
    words.push_back(output.name + output.after);
    words.insert(words.end(), output.more.begin(), output.more.end());
    return Stage(words);
  }

  std::vector<Output> outputs_;
};

TEST_F(CliLinksTest, DanglingLinkIsReplaced) {
  fs::create_directory(Path("folder"));
  for (const Output& output : outputs_)
    for (const std::string& target : {std::string("target"), std::string("folder/target"),
                                      Path("target").string(), std::string("no/target")}) {
      SCOPED_TRACE(output.option + " to " + target);
      fs::remove(Path(output.name));
      fs::create_symlink(target, Path(output.name));
      const Result result = Run(output);
      EXPECT_EQ(result.status, 0) << result.err;
      EXPECT_FALSE(fs::exists(Path("target")));
      EXPECT_TRUE(fs::is_empty(Path("folder")));
      EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(Path(output.name))));
      EXPECT_GT(fs::file_size(Path(output.name)), 0u);
    }
}

TEST_F(CliLinksTest, ALinkToAnEarlierOutputStays) {
  for (Output output : outputs_) {
    SCOPED_TRACE(output.option);
    const std::string link = output.name;
    output.name = "real-" + link;
    ASSERT_EQ(Run(output).status, 0);
    fs::create_symlink(output.name, Path(link));
    const auto half = fs::file_size(Path(output.name)) / 2;
    fs::resize_file(Path(output.name), half);
    output.name = link;
    const Result result = Run(output);
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_TRUE(fs::is_symlink(Path(link)));
    EXPECT_GT(fs::file_size(Path("real-" + link)), half);
  }
}

TEST_F(CliLinksTest, ALinkToSomethingElseIsRefused) {
  Write("precious", "precious");
  fs::create_directory(Path("folder"));
  for (const Output& output : outputs_)
    for (const std::string& target :
         {std::string("precious"), std::string("folder"), output.name}) {
      SCOPED_TRACE(output.option + " to " + target);
      fs::remove(Path(output.name));
      fs::create_symlink(target, Path(output.name));
      const Result result = Run(output);
      EXPECT_EQ(result.status, 2) << result.err;
      EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
      EXPECT_TRUE(fs::is_symlink(Path(output.name)));
      EXPECT_EQ(ReadFile(Path("precious")), "precious");
      EXPECT_TRUE(fs::is_empty(Path("folder")));
    }
}

TEST_F(CliLinksTest, FoldersAreNotMadeWhereALinkPoints) {
  fs::create_symlink("target", Path("link"));
  for (const Strings& words :
       {Strings{"w.world", "--size", "16x16", "--record", "link"},
        Strings{"sweep", "w.world", "-o", "link"}, Strings{"sweep", "w.world", "-o", "link/"}}) {
    EXPECT_NE(Stage(words).status, 0);
    EXPECT_FALSE(fs::exists(Path("target"))) << testing::PrintToString(words);
  }
}

TEST_F(CliLinksTest, TablesOfSweepsAreNotMadeWhereALinkPoints) {
  ASSERT_EQ(Stage({"sweep", "w.world", "-o", "sw"}).status, 0);
  fs::create_symlink("target", Path("all.csv"));
  EXPECT_EQ(Stage({"merge", "sw", "-o", "all.csv"}).status, 0);
  EXPECT_FALSE(fs::exists(Path("target")));
}

/// Sweeps do not write through links in their folder, which may be shared.
TEST_F(CliLinksTest, SweepsWriteThroughNoLinkInTheirFolder) {
  ASSERT_EQ(Stage({"sweep", "w.world", "--runs", "0:3", "--log", "--plan-only", "-o", "sw"}).status,
            0);
  Write("precious", "precious");
  fs::create_directories(Path("sw/runs/000"));
  for (const char* name :
       {"lock.all", "runs/000/000000.json", "runs/000/000001.mcap.part", "runs/000/000002.mcap"})
    fs::create_symlink(Path("target"), Path("sw") / name);
  EXPECT_NE(Stage({"sweep", "--resume", "sw"}).status, 0) << "the lock is a link";
  fs::remove(Path("sw/lock.all"));
  EXPECT_EQ(Stage({"sweep", "--resume", "sw"}).status, 0);
  EXPECT_FALSE(fs::exists(Path("target")));
}

}  // namespace
}  // namespace cli_testing
