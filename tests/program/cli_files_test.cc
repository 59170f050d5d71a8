// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs the real `stage` program: files that it writes or must not touch, and errors when output
// can't be written.

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "support/cli_testing.hh"
#include "support/emulated.hh"
#include "support/json.hh"

namespace {

using namespace cli_testing;

class CliFilesTest : public CliTest {
 protected:
  /// Expects no files in the folder except these and the captured output.
  void ExpectOnly(const std::set<std::string>& names) const {
    for (const fs::directory_entry& entry : fs::directory_iterator(directory_)) {
      const std::string name = entry.path().filename();
      EXPECT_TRUE(names.contains(name) || name == "out" || name == "err") << name;
    }
  }
  /// Runs the program in a shell, with commands before it and redirections after it.
  Result Shell(const std::string& before, const std::string& arguments,
               const std::string& after) const {
    const std::string program = BinaryFile("bin/stage");
    const std::string command = "cd '" + directory_.string() + "' && " + before + " '" + program +
                                "' " + arguments + " 2>err " + after;
    Result result;
    const int status = std::system(command.c_str());
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.err = ReadFile(Path("err"));
    return result;
  }
  static std::string BinaryFile(const std::string& path) {
    const char* const folder = std::getenv("STAGE_BINARY_DIR");
    return std::string(folder ? folder : ".") + "/" + path;
  }
  static std::string Plugin(const std::string& name) { return BinaryFile("tests/plugins/" + name); }
};

constexpr char kWorld[] = "quit_time 0.5\nmodel( name \"m\" )\n";

// ---- missing or wrong FILE arguments ------------------------------------------------------------

TEST_F(CliFilesTest, AWorldIsNeverWrittenOver) {
  Write("my.world", kWorld);
  Write("plain", kWorld);
  fs::create_symlink("my.world", Path("link"));
  ExpectRefused({"-g", "--stats", "my.world"}, "--stats: found 'my.world'");
  ExpectRefused({"-g", "--stats", "my.world", "my.world"}, "--stats: found 'my.world'");
  ExpectRefused({"-g", "plain", "--stats", "./plain"}, "--stats: found './plain'");
  ExpectRefused({"-g", "my.world", "--stats", "link"}, "--stats: found 'link'");
  ExpectRefused({"--explain", "my.world", "--stats", "new.world"}, "--stats: found 'new.world'");
  ExpectRefused({"-g", "--record", "new.world"}, "--record: found 'new.world'");
  for (const char* name : {"my.world", "plain"}) EXPECT_EQ(ReadFile(Path(name)), kWorld) << name;
  ExpectOnly({"my.world", "plain", "link"});
}

TEST_F(CliFilesTest, RefusesToRunWithoutAWorld) {
  Write("my.world", kWorld);
  for (const Strings& arguments :
       {Strings{}, Strings{"-g"}, Strings{"--seed", "5"}, Strings{"--explain"},
        Strings{"-g", "--args", "my.world"}, Strings{"--stats", "-"}})
    ExpectRefused(arguments, "found no world file, expected at least one");
}

TEST_F(CliFilesTest, StatisticsReplaceOnlyStatistics) {
  Write("my.world", kWorld);
  Write("notes.txt", "precious\n");
  Write("other.json", "{\n  \"mine\": 1\n}\n");
  Write("empty.json", "");
  for (const char* name : {"notes.txt", "other.json"}) {
    const std::string before = ReadFile(Path(name));
    ExpectRefused({"-g", "my.world", "--stats", name}, std::string("found '") + name + "', which");
    EXPECT_EQ(ReadFile(Path(name)), before);
  }
  for (int i = 0; i < 2; i++) {
    ExpectStatus(0, {"-g", "my.world", "--stats", "empty.json"});
    EXPECT_EQ(Stats("empty.json")["steps"], 5);
  }
  ExpectStatus(0, {"--explain", "my.world", "--stats", "empty.json"});
  ExpectStatus(0, {"--explain=json", "my.world", "--stats", "empty.json"});
  EXPECT_EQ(Stats("empty.json")["models"], 1);
}

TEST_F(CliFilesTest, ScreenshotsReplaceOnlyScreenshots) {
  Write("my.world", kWorld);
  Write("map.png", "\x89PNG\r\n\x1a\n and whatever the map of a building takes");
  const std::string before = ReadFile(Path("map.png"));
  const Strings shot = {"--size", "16x16", "my.world", "--screenshot"};
  const auto with = [&shot](const std::string& name) {
    Strings arguments = shot;
    arguments.push_back(name);
    return arguments;
  };
  const Result r = Stage(with("map.png"));
  EXPECT_EQ(ReadFile(Path("map.png")), before);
  const Result made = Stage(with("new.png@0"));
  if (Contains(made.err, "no pictures")) GTEST_SKIP() << made.err;
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(r.status, 2);
  EXPECT_TRUE(Contains(r.err, "map.png exists and was not made by Stage")) << r.err;
  const std::string first = ReadFile(Path("new.png"));
  EXPECT_TRUE(Contains(first, std::string("tEXtSoftware\0Stage", 18)));
  ExpectStatus(0, with("new.png@0"));
  EXPECT_EQ(ReadFile(Path("new.png")), first);
}

TEST_F(CliFilesTest, OutputsNeedDistinctFiles) {
  Write("my.world", kWorld);
  fs::create_symlink(".", Path("here"));
  ExpectRefused({"my.world", "--screenshot", "a.png@0", "--screenshot", "a.png@0.3"},
                "--screenshot: found 'a.png', expected a name that no other output has");
  Write("a.png", "");
  ExpectRefused({"my.world", "--screenshot", "a.png@0", "--screenshot", "here/a.png@0.3"},
                "--screenshot: found 'here/a.png', expected a name that no other output has");
  ExpectRefused({"my.world", "--stats", "a.png", "--screenshot", "a.png"},
                "--screenshot: found 'a.png', expected a name that no other output has");
}

TEST_F(CliFilesTest, AFilmReplacesNoPicture) {
  Write("my.world", kWorld);
  Write("film/stage-000003.png", "precious");
  const Result r = Stage({"my.world", "--record", "film"});
  EXPECT_EQ(ReadFile(Path("film/stage-000003.png")), "precious");
  EXPECT_FALSE(fs::exists(Path("film/stage-000000.png")));
  EXPECT_NE(r.status, 0);
}

// ---- writing files ------------------------------------------------------------------------------

/// In shared folders, others may create links with names that can be predicted.
TEST_F(CliFilesTest, NoLinkIsWrittenThrough) {
  Write("my.world", kWorld);
  Write("precious", "precious");
  const Result r = Shell("ln -s precious s.json.tmp$$ && ln -s precious s.json.$$.tmp && exec",
                         "-g my.world --stats s.json", "");
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(ReadFile(Path("precious")), "precious");
  EXPECT_EQ(Stats("s.json")["steps"], 5);
}

TEST_F(CliFilesTest, NoPictureIsWrittenThroughALink) {
  Write("my.world", kWorld);
  Write("precious", "precious");
  Shell("ln -s precious a.png.$$.part && exec", "my.world --size 16x16 --screenshot a.png@0", "");
  EXPECT_EQ(ReadFile(Path("precious")), "precious");
}

TEST_F(CliFilesTest, KeepsFileModes) {
  Write("my.world", kWorld);
  EXPECT_EQ(Shell("umask 027;", "-g my.world --stats s.json", "").status, 0);
  EXPECT_EQ(fs::status(Path("s.json")).permissions(), fs::perms(0640));
  fs::permissions(Path("s.json"), fs::perms(0606));
  ExpectStatus(0, {"-g", "my.world", "--stats", "s.json"});
  EXPECT_EQ(fs::status(Path("s.json")).permissions(), fs::perms(0606));
  if (geteuid() == 0) return;  // root may write to any file
  fs::permissions(Path("s.json"), fs::perms(0444));
  ExpectRefused({"-g", "my.world", "--stats", "s.json"}, "Permission denied");
}

TEST_F(CliFilesTest, WritesToOpenDescriptors) {
  if (Stg::test::IsEmulated())
    GTEST_SKIP() << "the emulator looks for /dev among the libraries first";
  Write("my.world", kWorld);
  EXPECT_EQ(Shell("", "-g my.world --stats /dev/stdout", ">log").status, 0);
  const std::string log = ReadFile(Path("log"));
  EXPECT_EQ(nlohmann::json::parse(log)["steps"], 5);
  EXPECT_EQ(Shell("", "-g my.world --stats /dev/fd/5", ">log 5>five").status, 0);
  EXPECT_EQ(Stats("five")["steps"], 5);
}

// ---- failing output -----------------------------------------------------------------------------

TEST_F(CliFilesTest, LostOutputIsAFailure) {
  Write("my.world", kWorld);
  for (const char* arguments :
       {"--help", "--version", "-g my.world --state-hash", "--explain my.world",
        "--explain=json my.world", "-g my.world --stats -", "--opencl=list"}) {
    const Result r = Shell("", arguments, ">/dev/full");
    EXPECT_EQ(r.status, 1) << arguments << "\n" << r.err;
    EXPECT_TRUE(Contains(r.err, "standard output")) << arguments << "\n" << r.err;
    EXPECT_TRUE(Contains(r.err, "No space left on device")) << arguments << "\n" << r.err;
  }
  EXPECT_EQ(CountOf(Shell("", "-g my.world --state-hash", ">/dev/full").err, "\n"), 1u);
}

TEST_F(CliFilesTest, LostErrorOutputDoesNotChangeTheStatus) {
  Write("my.world", kWorld);
  const Result r = Shell("", "--explain my.world", ">text 2>/dev/full");
  EXPECT_EQ(r.status, 0);
  EXPECT_TRUE(Contains(ReadFile(Path("text")), "Simulated\n"));
}

/// A limit on file sizes simulates a disk that becomes full during the run.
TEST_F(CliFilesTest, OutputLostOnTheWayIsAFailureButKeepsStatistics) {
  Write("my.world", "quit_time 30 show_clock 1 show_clock_interval 1\nmodel( )\n");
  const Result r = Shell("ulimit -f 4; trap '' XFSZ; exec", "-g my.world --stats s.json", ">log");
  EXPECT_EQ(r.status, 1);
  EXPECT_TRUE(Contains(r.err, "can't write to standard output")) << r.err;
  EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
  EXPECT_EQ(Stats("s.json")["steps"], 300);
}

/// A file opened later must not become standard output.
TEST_F(CliFilesTest, ClosedStandardFiles) {
  Write("my.world", kWorld);
  const Result r = Shell("", "-g my.world --state-hash --stats s.json", ">&-");
  EXPECT_EQ(r.status, 1);
  EXPECT_TRUE(Contains(r.err, "can't write to standard output")) << r.err;
  EXPECT_EQ(Shell("", "-g my.world --stats s.json", ">log 2>&- <&-").status, 0);
  EXPECT_EQ(Stats("s.json")["steps"], 5);
}

TEST_F(CliFilesTest, ATerminalThatIsClosedLosesNoStatistics) {
  WriteRobots("w.world", "");
  Process process(directory_, {"-gc", "w.world", "--stats=s.json"}, {});
  ASSERT_TRUE(process.WaitFor(" 0m 10s"));
  for (int i = 0; i < 3; i++) process.Send(SIGHUP);  // from the terminal, and from the shell
  const Result r = process.Finish();
  EXPECT_FALSE(r.hung);
  EXPECT_EQ(r.status, 128 + SIGHUP);
  EXPECT_GT(Stats("s.json")["steps"], 100);
}

// ---- controllers --------------------------------------------------------------------------------

TEST_F(CliFilesTest, NoControllersMeansThatNoCodeRuns) {
  Write("w.world", "quit_time 0.5\nposition( ctrl [ \"" + Plugin("mark") + " x\" \"gone\" ] )\n");
  for (const char* how : {"-g", "--explain"}) {
    const Result r = Stage({how, "--no-controllers", "w.world"});
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_TRUE(Contains(r.err, "controllers ignored as requested: 2\n")) << r.err;
    EXPECT_FALSE(fs::exists(Path("opened")));
  }
  EXPECT_TRUE(Contains(Stage({"--explain", "--no-controllers", "w.world"}).out,
                       "No controller was loaded"));
  Write("w.world", "quit_time 0.5\nposition( ctrl \"" + Plugin("mark") + "\" )\n");
  EXPECT_TRUE(Contains(Stage({"--explain", "w.world"}).out, "Only the controllers' Init ran"));
  EXPECT_TRUE(fs::exists(Path("opened")));
  EXPECT_TRUE(fs::exists(Path("initialised")));
}

TEST_F(CliFilesTest, DurationCountsAcrossReloads) {
  Write("w.world", "show_clock_interval 1\nmodel( ctrl \"" + Plugin("episodes") + "\" )\n");
  const Result r = Stage({"-gc", "--progress", "--duration", "1.7", "-a", "w.world", "w.world"});
  EXPECT_EQ(r.status, 0);
  EXPECT_EQ(CountOf(r.err, "[Loading w.world]"), 4u);
  EXPECT_EQ(Clocks(r.out).size(), 17u);
  const Strings until_a_load = {"-gc", "--duration", "1", "-a", "w.world", "w.world"};
  EXPECT_EQ(Clocks(Stage(until_a_load).out).size(), 10u);
  // A failed load removes the world before it, but the duration remains.
  ExpectStatus(0, {"-g", "--duration", "1", "-a", "missing.world", "w.world"});
}

/// The line "[Loading w.world]" is not complete yet when the first warning is printed.
TEST_F(CliFilesTest, TheFirstWarningStandsOnALineOfItsOwn) {
  for (const char* mistake : {"quit_tme 3", "model( size [1 1 0] )", "model( color \"bleu\" )"}) {
    Write("w.world", std::string("quit_time 0.1\n") + mistake + "\n");
    Shell("", "-g --progress w.world >both 2>&1 && cat both >&2", "");
    const std::string text = ReadFile(directory_ / "both");
    EXPECT_TRUE(Contains(text, "\nw.world:2:")) << text;
  }
}

/// An empty file is likely a mistake; programs load empty worlds from streams, without a warning.
TEST_F(CliFilesTest, AnEmptyFileIsMentioned) {
  for (const char* content : {"", "\n\n", "# a comment\n"}) {
    Write("w.world", content);
    const Result r = Stage({"-g", "--duration", "0.1", "w.world"});
    EXPECT_EQ(r.status, 0);
    EXPECT_TRUE(Contains(r.err,
                         "w.world:1:1: warning: found an empty file, expected properties and "
                         "sections; the world is empty\n"))
        << r.err;
  }
  Write("w.world", "define m model( )\n");
  EXPECT_TRUE(Contains(Stage({"-g", "--duration", "0.1", "w.world"}).err,
                       "found definitions alone, expected sections that use them"));
}

/// --explain prints doubtful properties found on loading.
TEST_F(CliFilesTest, ExplainReportsPossibleMistakes) {
  Write("w.world",
        "define r position( size [0.4 0.4 0.3] ranger( alwayson 1 sensor( ) ) )\n"
        "r( ) r( pose [2 0 0 0] )\n");
  const Result text = Stage({"--explain", "w.world"});
  EXPECT_TRUE(Contains(text.out, "Possible mistakes")) << text.out;
  EXPECT_TRUE(Contains(text.out, "none has a body where rangers look, at 0.31 m")) << text.out;
  EXPECT_TRUE(Contains(text.out, "w.world:1:39: found sensors at a height of 0.31 m")) << text.out;
  const Result json = Stage({"--explain=json", "w.world"});
  EXPECT_TRUE(Contains(json.out, "\"doubts\": [\n    \"w.world:1:39: found sensors")) << json.out;
}

}  // namespace
