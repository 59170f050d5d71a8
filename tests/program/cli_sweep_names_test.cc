// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sweeps of worlds whose names are not UTF-8: plan, records, replay commands and table preserve the
// names' bytes.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "support/cli_testing.hh"

namespace cli_testing {
namespace {

/// A name and its escaped form in JSON.
struct Name {
  std::string bytes, escaped;
};

const std::vector<Name> kNames = {
    {"stra\xdf"
     "e",
     R"(stra\udcdfe)"},
    {"\xff\xfe", R"(\udcff\udcfe)"},
    {"\xc3(", R"(\udcc3()"},                                      // a truncated sequence
    {"\xc0\xaf", R"(\udcc0\udcaf)"},                              // an overlong sequence
    {"\xed\xa0\x80", R"(\udced\udca0\udc80)"},                    // a surrogate
    {"\xf4\x90\x80\x80", R"(\udcf4\udc90\udc80\udc80)"},          // beyond Unicode
    {"gr\xc3\xbc\xc3\x9f \xff", R"(gr\u00fc\u00df \udcff)"},      // mixed with UTF-8
    {"\xf0\x9f\xa4\x96", R"(\ud83e\udd16)"},                      // only UTF-8
    {"\xf4\x8f\xbf\xbf", R"(\udcf4\udc8f\udcbf\udcbf)"},          // a placeholder for a byte
    {"\\udcff \\\\udbff\\udfff", R"(\\udcff \\\\udbff\\udfff)"},  // looks like an escape
};

class SweepNamesTest : public CliTest {
 protected:
  /// Runs a command unchanged in a shell, with the tested program; returns the state hash.
  std::string StateHash(const std::string& replay) const {
    const std::string program = Program().substr(0, Program().rfind('/'));
    Write("replay.sh", "PATH='" + program + "':/usr/bin:/bin\n" + replay + "\n");
    const std::string command = "cd '" + directory_.string() + "' && sh replay.sh >out 2>err";
    if (std::system(command.c_str()) != 0) return "failed: " + ReadFile(Path("err"));
    const std::string out = ReadFile(Path("out")), before = "state-hash ";
    const size_t at = out.find(before);
    return at == std::string::npos ? out : out.substr(at + before.size(), 16);
  }
  /// A string member of a record as written in JSON between the quotes.
  static std::string TextOf(const std::string& record, const std::string& name) {
    const std::string before = "\"" + name + "\":\"";
    const size_t begin = record.find(before) + before.size();
    size_t end = begin;
    while (record[end] != '"') end += record[end] == '\\' ? 2 : 1;
    return record.substr(begin, end - begin);
  }
  static std::string Replaced(std::string text, const std::string& what, const std::string& by) {
    for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
      text.replace(at, what.size(), by);
    return text;
  }
};

TEST_F(SweepNamesTest, KeepsNamesOfModelsAndFiles) {
  for (const Name& name : kNames) {
    SCOPED_TRACE(name.escaped);
    fs::remove_all(Path("sw"));
    // Strings in world files end at a quote and can't contain backslashes.
    const std::string& model = name.bytes;
    if (Contains(model, "\\")) continue;
    const std::string world = model + "/" + model + ".world";
    Write(world, "quit_time 0.3\nmetric( kind \"distance\" name \"" + model +
                     "\" )\nposition( name \"" + model + "\" alwayson 1 )\n");
    const Result swept = Stage(
        {"sweep", world, "--set", model + ".mass=1,2", "--log", "--log-models", model, "-o", "sw"});
    ASSERT_EQ(swept.status, 0) << swept.err;
    const std::string plan = ReadFile(Path("sw/sweep.json"));
    EXPECT_TRUE(Contains(plan, name.escaped + "/" + name.escaped + ".world\"")) << plan;
    EXPECT_TRUE(Contains(plan, "\"name\": \"" + name.escaped + ".mass\"")) << plan;
    const std::string record = ReadFile(Path("sw/runs/000/000001.json"));
    EXPECT_TRUE(Contains(record, "{\"" + name.escaped + ".mass\":\"2\"}")) << record;
    EXPECT_TRUE(Contains(record, "\"metrics\":{\"" + name.escaped + "\":")) << record;
    EXPECT_TRUE(fs::exists(Path("sw/runs/000/000001.mcap")));
    // UTF-8 is escaped too, in standard JSON form.
    std::string replay = TextOf(record, "replay");
    EXPECT_TRUE(Contains(replay, name.escaped + ".mass=2")) << replay;
    EXPECT_EQ(StateHash(Replaced(replay, name.escaped, name.bytes)), TextOf(record, "state_hash"));
    ExpectStatus(0, {"merge", "sw", "-o", "all.csv"});
    const std::string table = ReadFile(Path("all.csv"));
    EXPECT_TRUE(Contains(table, "," + model + ".mass,")) << table;
    EXPECT_TRUE(Contains(table, "," + model + "\n")) << table;
    ExpectStatus(0, {"sweep", "--resume", "sw"});
    ExpectStatus(0, {"sweep", "--status", "sw"});
  }
}

TEST_F(SweepNamesTest, KeepsAnyBytesInArguments) {
  WriteWorld("w.world", "quit_time 0.3");
  for (const Name& name : kNames) {
    SCOPED_TRACE(name.escaped);
    fs::remove_all(Path("sw"));
    ASSERT_EQ(Stage({"sweep", "w.world", "--args", name.bytes, "-o", "sw"}).status, 0);
    const std::string plan = ReadFile(Path("sw/sweep.json"));
    EXPECT_TRUE(Contains(plan, "\"args\": \"" + name.escaped + "\"")) << plan;
    const Result dry = Stage({"sweep", "w.world", "--args", name.bytes, "--dry-run"});
    const std::string record = ReadFile(Path("sw/runs/000/000000.json"));
    EXPECT_TRUE(Contains(dry.out, Replaced(TextOf(record, "replay"), name.escaped, name.bytes)))
        << dry.out << record;
    // The status of failed runs prints the record's command.
    Write("sw/runs/000/000000.json",
          Replaced(record, "\"status\":\"done\"", "\"status\":\"failed\",\"lines\":[]"));
    const Result status = Stage({"sweep", "--status", "sw"});
    EXPECT_TRUE(Contains(status.out, "--args ")) << status.out << status.err;
    EXPECT_TRUE(Contains(status.out, name.bytes)) << status.out;
  }
}

/// Python escapes such bytes as \udcNN, which other programs reject as UTF-8.
TEST_F(SweepNamesTest, ARecordWithAnotherByteIsRefused) {
  WriteWorld("w.world", "quit_time 0.3\nposition( name \"a\xff\" )");
  ASSERT_EQ(Stage({"sweep", "w.world", "--set", "a\xff.mass=1", "-o", "sw"}).status, 0);
  const std::string file = "sw/runs/000/000000.json", record = ReadFile(Path(file));
  Write(file, Replaced(record, "{\"a\\udcff.mass\"", "{\"a\\udcfe.mass\""));
  const Result merged = Stage({"merge", "sw", "-o", "all.csv"});
  EXPECT_EQ(merged.status, 1);
  EXPECT_EQ(CountOf(merged.err, "\n"), 1u) << merged.err;
  EXPECT_TRUE(Contains(merged.err, "found the set {\"a\\udcfe.mass\":\"1\"} where the plan has"))
      << merged.err;
  Write(file, Replaced(record, "\\udcff", "\xff"));  // as a text editor would write it
  ExpectStatus(0, {"merge", "sw", "-o", "all.csv"});
}

}  // namespace
}  // namespace cli_testing
