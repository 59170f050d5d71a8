// SPDX-License-Identifier: GPL-2.0-or-later
//
// The folder of a sweep: where it may be created, and plans and records that are damaged or belong
// to another sweep.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>
#include <string>
#include <vector>

#include "support/cli_testing.hh"
#include "support/json.hh"

namespace cli_testing {
namespace {

using Json = nlohmann::ordered_json;

class SweepFolderTest : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    WriteWorld("w/w.world", "quit_time 0.2");
  }
  Result SweepTo(const std::string& folder, const Environment& environment = {}) const {
    return Stage({"sweep", "w/w.world", "--runs", "0:2", "-o", folder}, environment);
  }
  /// Expects an error line that contains `part`, and unchanged files.
  void ExpectNoPlace(const std::string& folder, const std::string& part,
                     const Environment& environment = {}) const {
    const Strings before = Files();
    const Result r = SweepTo(folder, environment);
    EXPECT_EQ(r.status, 2) << folder << r.out;
    EXPECT_TRUE(Contains(r.err, part)) << r.err;
    EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
    EXPECT_EQ(Files(), before) << folder;
  }
  /// All files of the test except the program's captured output.
  Strings Files() const {
    Strings files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory_))
      if (entry.path() != Path("out") && entry.path() != Path("err"))
        files.push_back(entry.path().string());
    std::ranges::sort(files);
    return files;
  }
};

TEST_F(SweepFolderTest, FoldersWithOtherFilesAreRefused) {
  const std::string else_is_there = "which is not a sweep folder";
  ExpectNoPlace("/", "the root folder");
  ExpectNoPlace("//.", "the root folder");
  Write("home/.profile", "");
  fs::create_directory(Path("new_home"));
  for (const char* home : {"home", "new_home"})
    ExpectNoPlace(home, "a home folder", {{"HOME", Path(home)}});
  ExpectNoPlace("w", else_is_there);
  ExpectNoPlace(".", else_is_there);
  ExpectNoPlace("w/w.world", "which is not a folder");
  Write("notes/notes.txt", "precious");
  ExpectNoPlace("notes", else_is_there);
  Write("records/runs/000/000000.json", "{}");  // of a sweep whose plan is gone
  ExpectNoPlace("records", else_is_there);
  fs::create_directory_symlink("notes", Path("link"));
  ExpectNoPlace("link", else_is_there);
  fs::create_symlink("nowhere", Path("dangling"));
  ExpectNoPlace("dangling", "a symbolic link that leads nowhere");
  ASSERT_EQ(mkfifo(Path("pipe").c_str(), 0600), 0);
  ExpectNoPlace("pipe", "which is not a folder");
}

TEST_F(SweepFolderTest, NewAndEmptyFoldersAreAccepted) {
  fs::create_directory(Path("empty"));
  fs::create_directory(Path("target"));
  fs::create_directory_symlink("target", Path("link"));
  fs::create_directories(Path("begun/runs"));  // by another shard, which has just started
  for (const char* folder : {"empty", "new", "deep/er", "link", "begun"}) {
    EXPECT_EQ(SweepTo(folder).status, 0) << folder;
    EXPECT_TRUE(fs::exists(Path(folder) / "runs/000/000001.json")) << folder;
  }
}

TEST_F(SweepFolderTest, FailedCheckLeavesTheFolderUnchanged) {
  fs::create_directory(Path("empty"));
  WriteWorld("w/w.world", "quit_time 0.2 nonsense(");
  const Strings before = Files();
  for (const char* folder : {"empty", "new"}) EXPECT_EQ(SweepTo(folder).status, 1) << folder;
  EXPECT_EQ(Files(), before);
}

TEST_F(SweepFolderTest, RecordsThatDoNotFitThePlanAreRefused) {
  const Strings sweep = {"sweep", "w/w.world", "--set", "m.mass=1,2", "--runs", "0:2", "-o", "sw"};
  ASSERT_EQ(Stage(sweep).status, 0);
  const std::string file = "sw/runs/000/000002.json";
  const std::string whole = ReadFile(Path(file));
  const auto with = [&](const std::function<void(Json*)>& change) {
    Json record = Json::parse(whole);
    change(&record);
    return record.dump() + "\n";
  };
  Strings damaged = {"nothing",
                     "{",
                     "[]",
                     "3",
                     "\"x\"",
                     whole.substr(0, whole.size() / 2),
                     ReadFile(Path("sw/runs/000/000001.json"))};
  for (const char* name : {"index", "set", "run", "seed", "status", "state_hash", "steps", "rays",
                           "simulated_seconds"}) {
    damaged.push_back(with([&](Json* record) { record->erase(name); }));
    for (const Json& other :
         {Json("other"), Json(-7), Json(), Json::array({1}), Json::object({{"m.mass", "3"}})})
      if (!(std::string(name) == "state_hash" && other.is_string()) &&
          !(other.is_number() && (std::string(name) == "steps" || std::string(name) == "rays" ||
                                  std::string(name) == "simulated_seconds")))
        damaged.push_back(with([&](Json* record) { (*record)[name] = other; }));
  }
  for (const char* name : {"metrics", "energy", "timing"})
    damaged.push_back(with([&](Json* record) { (*record)[name] = {{"x", "text"}}; }));
  for (const std::string& record : damaged) {
    Write(file, record);
    const Result merged = Stage({"merge", "sw", "-o", "all.csv"});
    EXPECT_EQ(merged.status, 1) << record;
    EXPECT_EQ(CountOf(merged.err, "\n"), 1u) << merged.err;
    EXPECT_TRUE(Contains(merged.err, file + ": found ")) << record << merged.err;
    EXPECT_TRUE(Contains(merged.err, "expected the record of run 2; remove it")) << merged.err;
    EXPECT_FALSE(fs::exists(Path("all.csv")));
  }
  Write(file, whole);
  ExpectStatus(0, {"merge", "sw", "-o", "all.csv"});
}

TEST_F(SweepFolderTest, SpecialFilesAreNotRecords) {
  ASSERT_EQ(SweepTo("sw").status, 0);
  fs::remove(Path("sw/runs/000/000001.json"));
  ASSERT_EQ(mkfifo(Path("sw/runs/000/000001.json").c_str(), 0600), 0);
  const Result merged = Stage({"merge", "sw", "-o", "all.csv"});
  EXPECT_TRUE(Contains(merged.err, "1 of 2 runs are not finished")) << merged.err;
  fs::remove(Path("sw/sweep.json"));
  ASSERT_EQ(mkfifo(Path("sw/sweep.json").c_str(), 0600), 0);
  const Result status = Stage({"sweep", "--status", "sw"});
  EXPECT_EQ(status.status, 1);
  EXPECT_TRUE(Contains(status.err, "can't read 'sw/sweep.json'")) << status.err;
}

TEST_F(SweepFolderTest, PlansWithoutRunsAreNamed) {
  ASSERT_EQ(SweepTo("sw").status, 0);
  const Json plan = Json::parse(ReadFile(Path("sw/sweep.json")));
  const auto fails = [&](const std::string& text, const std::string& part) {
    Write("sw/sweep.json", text);
    for (const Strings& words :
         {Strings{"sweep", "--resume", "sw"}, Strings{"sweep", "--status", "sw"},
          Strings{"merge", "sw", "-o", "all.csv"}}) {
      const Result r = Stage(words);
      EXPECT_EQ(r.status, 1) << text;
      EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
      EXPECT_TRUE(Contains(r.err, "sw/sweep.json: not the plan of a sweep")) << r.err;
      EXPECT_TRUE(Contains(r.err, part)) << r.err;
    }
  };
  fails("", "found an empty file");
  fails("\n", "found an empty file");
  Json other = plan;
  other["runs"] = {5, 5};
  fails(other.dump(), "found a plan without runs");
  other = plan;
  other["axes"] = Json::array({{{"name", "m.mass"}, {"values", Json::array()}}});
  fails(other.dump(), "found a plan without runs");
  other["axes"] = plan["axes"];
  other["runs"] = {0, 1000000000};
  fails(other.dump(), "found more than 100000000 runs");
}

TEST_F(SweepFolderTest, PartsWithoutRunsReportThatNothingIsLeft) {
  ASSERT_EQ(SweepTo("sw").status, 0);
  ExpectRefused({"sweep", "--resume", "--only", "2:5", "sw"},
                "--only: found 2:5, but the sweep has 2 runs");
  const Result beyond = Stage({"sweep", "--resume", "--shard", "3/4", "sw"});
  EXPECT_EQ(beyond.status, 0);
  EXPECT_EQ(beyond.out, "nothing to do: the sweep has only 2 runs\n");
  const Result finished = Stage({"sweep", "--resume", "sw"});
  EXPECT_EQ(finished.status, 0);
  EXPECT_TRUE(Contains(finished.out, "nothing to do: all runs are finished")) << finished.out;
}

}  // namespace
}  // namespace cli_testing
