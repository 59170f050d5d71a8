// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs the real `stage` program: options, output and exit status.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include "support/cli_testing.hh"
#include "support/json.hh"

namespace {

using namespace cli_testing;

// ---- options ------------------------------------------------------------------------------------

TEST_F(CliTest, VersionAndHelpRunNothing) {
  WriteWorld("w.world", "");
  EXPECT_EQ(Stage({"w.world", "--version"}).out, "stage 5.0.0\n");
  const std::string help = Stage({"--help"}).out;
  EXPECT_EQ(help.substr(0, 12), "Usage: stage");
  for (const char* name : {"--budget-ms",      "--budget-horizon", "--args",
                           "--live",           "--foxglove",       "STAGE_PYTHON",
                           "--clock",          "--duration",       "--gui",
                           "--no-batch",       "--no-controllers", "--no-progress",
                           "--opencl",         "--opencl-always",  "--progress",
                           "--seed",           "--state-hash",     "--stats",
                           "--threads",        "--version",        "STAGEPATH",
                           "STAGE_CL_DEVICE",  "STAGE_CL_HITS",    "STAGE_CL_MEMORY",
                           "STAGE_CL_OPTIONS", "STAGE_CL_TIMEOUT"})
    EXPECT_TRUE(Contains(help, name)) << name;
  for (const Strings& arguments : {Strings{"-h", "w.world"}, Strings{"w.world", "-?"},
                                   Strings{"--h"}, Strings{"--help=x"}, Strings{"-g?c"}}) {
    const Result r = Stage(arguments);
    EXPECT_EQ(r.status, 0);
    EXPECT_EQ(r.out, help);
    EXPECT_EQ(r.err, "");
  }
}

TEST_F(CliTest, OptionsAsGetoptKnowsThem) {
  WriteWorld("w.world", "quit_time 0.3");
  const std::string out = Stage({"w.world", "-g", "-c"}).out;
  EXPECT_EQ(out, "\r[Stage:  0m 00s 000msec]\n");
  const std::string told = Stage({"w.world", "-g", "-c", "--progress"}).err;
  EXPECT_TRUE(told.starts_with("Stage 5.0.0 [GUI disabled][Clock enabled]\n [Loading w.world]\n"))
      << told;
  EXPECT_TRUE(told.ends_with("[Stage: done]\n")) << told;
  for (const Strings& arguments :
       {Strings{"-gc", "w.world"}, Strings{"--gui", "w.world", "--cl"}, Strings{"-gcc", "w.world"},
        Strings{"--gui=no", "--clock=x", "w.world"}, Strings{"-ga", "a b", "-c", "w.world"},
        Strings{"-a", "w.world", "-g", "--args=x", "-c", "--", "w.world"}})
    EXPECT_EQ(Stage(arguments).out, out) << testing::PrintToString(arguments);
  EXPECT_TRUE(
      Contains(Stage({"-cg", "w.world", "--progress"}).err, " [Clock enabled][GUI disabled]\n"));
  ExpectLoadFails(1, {"-g", "--", "-c"}, "-c");
  EXPECT_EQ(Stage({"-g", "w.world", "-c"}, {{"POSIXLY_CORRECT", "1"}}).status, 1);
}

TEST_F(CliTest, BadOptions) {
  WriteWorld("w.world", "quit_time 0.3");
  ExpectRefused({"--bogus", "w.world"}, "'--bogus'");
  ExpectRefused({"w.world", "-gx"}, "'-x'");
  ExpectRefused({"w.world", "--args"}, "--args needs a value");
  ExpectRefused({"w.world", "-a"}, "--args needs a value");
  ExpectRefused({"w.world", "--state-hash=1"}, "--state-hash takes no value");
  ExpectRefused({"w.world", "--st"}, "--state-hash, --stats");
  ExpectRefused({"w.world", "--stats", ""}, "--stats");
}

TEST_F(CliTest, BadNumbers) {
  WriteWorld("w.world", "quit_time 0.3");
  for (const char* value :
       {"abc", "", "-1", "0", "nan", "inf", "1e300", "1x", " 1", "0x10", "1e-9"})
    ExpectRefused({"-g", "w.world", "--duration", value}, std::string("'") + value + "'");
  for (const char* value : {"abc", "", "-1", "1.5", "18446744073709551616", "7 "})
    ExpectRefused({"-g", "w.world", "--seed", value}, std::string("'") + value + "'");
  for (const char* value : {"abc", "0", "-1", "1025", "2.5", "99999999999"})
    ExpectRefused({"-g", "w.world", "--threads", value}, std::string("'") + value + "'");
  ExpectStatus(0,
               {"-g", "w.world", "--duration=1e-1", "--seed=18446744073709551615", "--threads=4"});
}

TEST_F(CliTest, SaysOnceThatThereIsNoWindow) {
  WriteWorld("w.world", "quit_time 0.3");
  const std::string note = "stage: no display for a window; running headless\n";
  EXPECT_EQ(Stage({"w.world", "w.world"}).err, note);
  EXPECT_EQ(Stage({"-g", "w.world"}).err, "");
}

TEST_F(CliTest, OpenClDevices) {
  WriteWorld("w.world", "quit_time 0.3");
  const Result list = Stage({"--opencl=list", "w.world"});
  EXPECT_EQ(list.status, 0);
  EXPECT_FALSE(list.out.empty());
  EXPECT_FALSE(Contains(list.out, "Loading"));
  EXPECT_EQ(Stage({"--opencl"}, {{"STAGE_CL_DEVICE", "list"}}).out, list.out);
  ExpectLoadFails(1, {"-g", "--opencl=no such device", "w.world"}, "stage: ");
  ExpectLoadFails(1, {"-g", "--opencl", "w.world"},
                  "stage: ", {{"STAGE_CL_DEVICE", "no such device"}});
  EXPECT_EQ(Stage({"-g", "w.world"}, {{"STAGE_CL_DEVICE", "no such device"}}).err, "");
  ExpectStatus(0, {"-g", "--opencl", "w.world"});
}

// ---- clock, quit times, several worlds ----------------------------------------------------------

TEST_F(CliTest, Clock) {
  WriteWorld("w.world", "quit_time 25 show_clock_interval 50");
  const Result r = Stage({"-g", "w.world", "-c"});
  EXPECT_EQ(r.status, 0);
  EXPECT_EQ(Clocks(r.out), (Strings{" 0m 00s 000msec", " 0m 05s 000msec", " 0m 10s 000msec",
                                    " 0m 15s 000msec", " 0m 20s 000msec"}));
  WriteWorld("w.world", "quit_time 3.0 interval_sim 700 show_clock_interval 1");
  EXPECT_EQ(Clocks(Stage({"-gc", "w.world"}).out),
            (Strings{" 0m 00s 000msec", " 0m 00s 700msec", " 0m 01s 400msec", " 0m 02s 100msec",
                     " 0m 02s 800msec"}));
  WriteWorld("w.world", "quit_time 3661.05 interval_sim 1000 show_clock_interval 1");
  const Strings clocks = Clocks(Stage({"-gc", "w.world"}).out);
  EXPECT_EQ(clocks.size(), 3662u);
  EXPECT_EQ(clocks.back(), "1h 1m 01s 000msec");
}

TEST_F(CliTest, ClockOfTheWorldFile) {
  WriteWorld("w.world", "quit_time 0.2 show_clock 1 show_clock_interval 0");
  EXPECT_EQ(Clocks(Stage({"-g", "w.world"}).out).size(), 2u);
  EXPECT_EQ(Clocks(Stage({"-gc", "w.world"}).out).size(), 2u);
  WriteWorld("w.world", "quit_time 0.2 show_clock 0 show_clock_interval -3");
  EXPECT_EQ(Clocks(Stage({"-g", "w.world"}).out).size(), 0u);
  EXPECT_EQ(Clocks(Stage({"-gc", "w.world"}).out).size(), 2u);
}

TEST_F(CliTest, QuitTimeIsRoundedUpToSteps) {
  const auto steps = [this](const std::string& world, const Strings& more) {
    WriteWorld("w.world", world + " show_clock_interval 1");
    Strings arguments = {"-gc", "w.world"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Clocks(Stage(arguments).out).size();
  };
  EXPECT_EQ(steps("quit_time 0.2", {}), 2u);
  EXPECT_EQ(steps("quit_time 0.25", {}), 3u);
  EXPECT_EQ(steps("quit_time 0.3", {}), 3u);
  EXPECT_EQ(steps("interval_sim 33.333 quit_time 0.1", {}), 4u);
  EXPECT_EQ(steps("quit_time 100", {"--duration", "0.25"}), 3u);
  EXPECT_EQ(steps("", {"--duration", "0.2"}), 2u);
}

TEST_F(CliTest, SeveralWorldsTakeTurnsInTheirOrder) {
  WriteWorld("a.world", "quit_time 0.2 show_clock_interval 1");
  WriteWorld("b.world", "quit_time 1 interval_sim 250 show_clock_interval 1");
  const Result r = Stage({"-gc", "--progress", "a.world", "b.world"});
  EXPECT_EQ(r.status, 0);
  EXPECT_LT(r.err.find(" [Loading a.world]\n"), r.err.find(" [Loading b.world]\n"));
  EXPECT_EQ(Clocks(r.out), (Strings{" 0m 00s 000msec", " 0m 00s 000msec", " 0m 00s 100msec",
                                    " 0m 00s 250msec", " 0m 00s 500msec", " 0m 00s 750msec"}));
  EXPECT_EQ(CountOf(r.err, "[Stage: done]"), 1u);
}

// ---- files --------------------------------------------------------------------------------------

TEST_F(CliTest, LoadsThatFail) {
  WriteWorld("good.world", "quit_time 0.3");
  ExpectLoadFails(1, {"-gc", "missing.world"}, "missing.world");
  ExpectLoadFails(1, {"-gc", "sub/missing.world"}, "missing.world", {{"STAGEPATH", "/a:/b"}});
  ExpectLoadFails(1, {"-gc", "good.world", "missing.world"}, "missing.world");
  ExpectLoadFails(1, {"-gc", "missing.world", "good.world"}, "missing.world");
  fs::create_directory(Path("directory"));
  ExpectLoadFails(1, {"-gc", "directory"}, "directory");
  Write("bad.world", "quit_time 1\nmodel( pose [ 1 2 )\n");
  ExpectLoadFails(1, {"-gc", "bad.world"}, "bad.world:2:19: ");
  Write("bad.world", "\ninclude \"gone.inc\"\n");
  ExpectLoadFails(1, {"-gc", "bad.world"}, "gone.inc");
  Write("bad.world", "quit_time 1\n  robocar( )\n");
  ExpectLoadFails(1, {"-gc", "bad.world"}, "bad.world:2:3: ");
  Write("bad.world", "quit_time 1\nmodel( pose [1 2] )\n");
  ExpectLoadFails(1, {"-gc", "bad.world"}, "bad.world:2:");
  for (const char* text : {"block( points 3 )", "sensor( samples 3 )", "laser( )"}) {
    Write("bad.world", std::string("quit_time 1\n") + text + "\n");
    ExpectLoadFails(1, {"-gc", "bad.world"}, "bad.world:2:");
  }
}

TEST_F(CliTest, LoadsThatFailWith255) {
  const auto fails = [this](const std::string& property, const std::string& part) {
    Write("bad.world", "quit_time 1\nmodel( " + property + " )\n");
    ExpectLoadFails(255, {"-gc", "bad.world"}, part);
  };
  fails("bitmap \"gone.png\"", "gone.png");
  Write("text.png", "no picture");
  fails("bitmap \"text.png\"", "text.png");
  fails("ctrl \"gone_controller\"", "gone_controller");
#ifndef STAGE_STATIC
  Write("broken.so",
        "this is no library, but it is longer than the header of one would have to be\n");
  fails("ctrl \"./broken\"", "ELF");
#endif
}

TEST_F(CliTest, FilesInStagepath) {
  const std::string world = "quit_time 0.2\ninclude \"one.inc\"\ninclude \"two.inc\"";
  WriteWorld("far/w.world", world);
  Write("two/one.inc", "define a model()\n");
  Write("three/two.inc", "a()\n");
  const std::string path = Path("far").string() + ":" + Path("two").string() + ":" +
                           Path("nowhere").string() + ":" + Path("three").string();
  const Result r = Stage({"-g", "--progress", "some/folder/w.world"}, {{"STAGEPATH", path}});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_TRUE(
      Contains(r.err, " [Loading some/folder/w.world][Include one.inc][Include two.inc]\n"));
}

TEST_F(CliTest, ControllerInStagepath) {
  const char* build = std::getenv("STAGE_BINARY_DIR");
  const fs::path wander = fs::path(build ? build : ".") / "lib" / "stage-5.0" / "wander.so";
  if (!fs::exists(wander)) GTEST_SKIP() << "there is no " << wander;
  fs::create_directory(Path("plugins"));
  fs::copy_file(wander, Path("plugins/elsewhere.so"));
  Write("w.world",
        "quit_time 1\nposition( ctrl \"elsewhere\" ranger( sensor( range [0 5] fov 180 samples 180"
        " ) ) )\n");
  const std::string path = Path("nowhere").string() + ":" + Path("plugins").string();
  const Result r = Stage({"-g", "w.world", "--stats", "s.json"}, {{"STAGEPATH", path}});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(Stats("s.json")["robots"], 1);
}

TEST_F(CliTest, EmptyControllerNameIsIgnored) {
  Write("w.world", "quit_time 0.2\nmodel( ctrl \"\" )\n");
  const Result r = Stage({"-g", "w.world"});
  EXPECT_EQ(r.status, 0);
  EXPECT_TRUE(Contains(r.err, "w.world:2:")) << r.err;
}

// ---- results ------------------------------------------------------------------------------------

TEST_F(CliTest, StateHash) {
  WriteRobots("w.world", "quit_time 2");
  const auto hash = [this](Strings arguments) {
    arguments.insert(arguments.begin(), {"-g", "--state-hash", "w.world"});
    const std::string out = Stage(arguments).out;
    EXPECT_TRUE(MatchesPart(out, "^state-hash [0-9a-f]{16}\n$")) << out;
    return out.substr(out.find("state-hash"));
  };
  const std::string first = hash({});
  EXPECT_EQ(hash({}), first);
  EXPECT_EQ(hash({"--seed=1"}), first);
  EXPECT_EQ(hash({"--threads=3"}), first);
  EXPECT_EQ(hash({"--no-batch"}), first);
  EXPECT_NE(hash({"--seed=2"}), first);
  EXPECT_NE(hash({"--duration=1"}), first);
  EXPECT_EQ(CountOf(Stage({"-g", "--state-hash", "w.world", "w.world"}).out, "state-hash "), 2u);
}

TEST_F(CliTest, Statistics) {
  WriteRobots("\"w.world", "quit_time 2");
  ASSERT_EQ(Stage({"-g", "\"w.world", "--stats=s.json", "--threads=2"}).status, 0);
  const Json s = Stats("s.json");
  EXPECT_EQ(s["version"], "5.0.0");
  EXPECT_EQ(s["worldfile"], "\"w.world");
  EXPECT_EQ(s["robots"], 1);
  EXPECT_EQ(s["position_models"], 2);
  EXPECT_EQ(s["models"], 4);
  EXPECT_EQ(s["steps"], 20);
  EXPECT_EQ(s["threads"], 2);
  EXPECT_EQ(s["simulated_seconds"], 2.0);
  EXPECT_GE(s["rays"], 19 * 90);
  EXPECT_TRUE(s["opencl"].is_null());
  const double wall = s["wall_seconds"];
  EXPECT_GT(wall, 0);
  EXPECT_NEAR(s["r_acc"], 2.0 / wall, 1e-6 / wall);
  EXPECT_NEAR(s["rays_per_second"], s["rays"].get<double>() / wall, 1e-6 / wall);
  for (const char* name : {"load_seconds", "potential_hits_per_ray", "peak_memory_mb"})
    EXPECT_GT(s[name], 0) << name;
  EXPECT_EQ(s["resumed_rays"], 0);  // only with a device
  for (const char* phase : {"gather", "prefilter", "trace", "move", "callbacks"})
    EXPECT_GE(s["phases_ms_per_step"][phase], 0) << phase;
  EXPECT_GE(s["machine"]["cores"], 1);
  EXPECT_TRUE(s["machine"]["cpu"].is_string());
}

TEST_F(CliTest, FieldsHaveAPhaseOfTheirOwn) {
  WriteWorld("plain.world", "quit_time 2 position( )");
  WriteWorld("field.world",
             "quit_time 2 position( )\n"
             "field( size [40 40 0] field_resolution 0.1 diffusion 0.01 initial 1 )");
  ASSERT_EQ(Stage({"-g", "plain.world", "--stats", "plain.json"}).status, 0);
  ASSERT_EQ(Stage({"-g", "field.world", "--stats", "field.json"}).status, 0);
  EXPECT_LT(Stats("plain.json")["phases_ms_per_step"]["fields"], 1e-3);
  const Json phases = Stats("field.json")["phases_ms_per_step"];
  EXPECT_GT(phases["fields"], 1e-2) << "160 000 cells";
  EXPECT_LT(phases["energy"], phases["fields"].get<double>() / 2);
}

TEST_F(CliTest, StatisticsOfSeveralWorlds) {
  WriteRobots("a.world", "quit_time 1");
  WriteWorld("b\xff.world", "quit_time 2");  // the name is not UTF-8
  ASSERT_EQ(Stage({"-g", "a.world", "b\xff.world", "--stats", "s.json"}).status, 0);
  const Json s = Stats("s.json");
  ASSERT_EQ(s["worlds"].size(), 2u);
  EXPECT_EQ(s["worlds"][0]["worldfile"], "a.world");
  EXPECT_EQ(s["worlds"][1]["steps"], 20);
  EXPECT_EQ(s["worlds"][1]["rays_per_second"], 0);
  EXPECT_TRUE(s["machine"].is_object());
}

TEST_F(CliTest, StatisticsOnStandardOutput) {
  WriteWorld("w.world", "quit_time 1");
  // Standard output is pure JSON with any other options and any output of controllers.
  for (const Strings& more :
       {Strings{}, Strings{"-c"}, Strings{"--state-hash"}, Strings{"--progress"},
        Strings{"-c", "--state-hash", "--progress"}, Strings{"--opencl"}})
    for (const char* name : {"-", "/dev/stdout", "/dev/fd/1"}) {
      Strings words = {"-g", "w.world", "--stats", name};
      words.insert(words.end(), more.begin(), more.end());
      const Result r = Stage(words);
      EXPECT_TRUE(r.out.starts_with("{")) << r.out;
      EXPECT_EQ(ParseJson(r.out)["steps"], 10) << r.out;
      EXPECT_EQ(Contains(r.err, "state-hash "), Contains(testing::PrintToString(more), "hash"));
    }
  EXPECT_EQ(Stage({"-g", "w.world", "--stats=/dev/full"}).status, 1);
}

TEST_F(CliTest, FiguresOnStandardOutputStandAlone) {
  WriteRobots("w.world", "quit_time 1");
  for (const Strings& words :
       {Strings{"--explain"}, Strings{"--explain=json"},
        Strings{"--explain-ray", "position:0:0:0:3@0.5"},
        Strings{"--budget-ms", "1", "--budget-horizon", "0.1", "--threads", "1"}}) {
    Strings all = words;
    all.insert(all.end(), {"--stats", "-", "w.world"});
    const Result r = Stage(all);
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_TRUE(ParseJson(r.out).is_object()) << r.out;
  }
}

TEST_F(CliTest, StatisticsFileIsReplacedAsAWhole) {
  WriteWorld("w.world", "quit_time 1");
  const std::string old = "{\n  \"program\": \"stage\",\n";
  Write("real.json", old);
  fs::create_symlink("real.json", Path("link.json"));
  Write("bad.world", "nonsense(");
  EXPECT_EQ(Stage({"-g", "bad.world", "--stats", "link.json"}).status, 1);
  EXPECT_EQ(ReadFile(Path("real.json")), old);
  EXPECT_EQ(Stage({"-g", "w.world", "--stats", "link.json"}).status, 0);
  EXPECT_TRUE(fs::is_symlink(Path("link.json")));
  EXPECT_EQ(Stats("real.json")["steps"], 10);
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_))
    EXPECT_NE(entry.path().filename().string().front(), '.') << entry.path();
}

TEST_F(CliTest, UnwritableStatisticsAreFoundBeforeTheRun) {
  WriteWorld("w.world", "");  // would run without end
  ExpectRefused({"-g", "w.world", "--stats", "nowhere/s.json"}, "'nowhere/s.json'");
  ExpectRefused({"-g", "w.world", "--stats", "."}, "'.'");
  ExpectRefused({"-g", "w.world", "--stats", "w.world/s.json"}, "'w.world/s.json'");
}

// ---- time and signals ---------------------------------------------------------------------------

TEST_F(CliTest, SpeedupSetsThePace) {
  WriteWorld("w.world", "quit_time 1 speedup 2");
  ASSERT_EQ(Stage({"-g", "w.world", "--stats=s.json"}).status, 0);
  const double wall = Stats("s.json")["wall_seconds"];
  EXPECT_LT(wall, 0.3 * patience::Slowness());  // waiting does not count
  const Result paced = Stage({"-g", "w.world"});
  EXPECT_GT(paced.seconds, 0.49);
  EXPECT_LT(paced.seconds, 5 * patience::Slowness());
  WriteWorld("w.world", "quit_time 1000 speedup 0");
  EXPECT_LT(Stage({"-g", "w.world"}).seconds, 100 * patience::Slowness());
}

TEST_F(CliTest, Progress) {
  WriteWorld("w.world", "quit_time 1 speedup 1");
  const Result shown = Stage({"-g", "w.world", "--progress"});
  EXPECT_EQ(shown.out, "");
  const std::string line = "\r +[0-9]+% of 1 s simulated, [0-9.]+ x real time, [0-9]+ s left";
  EXPECT_TRUE(MatchesPart(shown.err, line)) << shown.err;
  EXPECT_LE(CountOf(shown.err, "simulated"), 5u);
  EXPECT_TRUE(shown.err.ends_with("\r[Stage: done]\n")) << shown.err;
  const Result quiet = Stage({"-g", "w.world"});  // no terminal
  EXPECT_EQ(quiet.err, "");
  EXPECT_EQ(quiet.out, "");
}

TEST_F(CliTest, SignalsEndTheRunInOrder) {
  WriteRobots("w.world", "");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    Process process(directory_, {"-gc", "w.world", "--stats=s.json", "--state-hash"}, {});
    ASSERT_TRUE(process.WaitFor(" 0m 10s"));
    process.Send(signal);
    const Result r = process.Finish();
    EXPECT_FALSE(r.hung);
    EXPECT_EQ(r.status, 128 + signal);
    EXPECT_TRUE(Contains(r.out, "]\nstate-hash ")) << r.out.substr(0, 1000);
    EXPECT_GT(Stats("s.json")["steps"], 100);
    fs::remove(Path("s.json"));
  }
}

TEST_F(CliTest, SignalsCutWaitingShort) {
  WriteWorld("w.world", "speedup 0.000001");  // more than a day per step
  for (int i = 0; i < 5; i++) {
    Process process(directory_, {"-g", "--progress", "w.world"}, {});
    ASSERT_TRUE(process.WaitForError("[Loading w.world]\n"));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until it waits
    const double sent = WallClock();
    process.Send(SIGINT);
    const Result r = process.Finish();
    EXPECT_EQ(r.status, 128 + SIGINT);
    EXPECT_TRUE(Contains(r.err, "[Stage: done]")) << r.err;
    EXPECT_LT(WallClock() - sent, 2 * patience::Slowness());
  }
}

TEST_F(CliTest, SmallWorldsNeverHang) {
  WriteWorld("w.world", "quit_time 0.1");
  for (int i = 0; i < 200; i++) {
    const Result r = Stage({"-g", "w.world", i % 2 ? "--threads=4" : "--threads=1"});
    ASSERT_EQ(r.status, 0) << r.err;
    ASSERT_FALSE(r.hung);
  }
}

}  // namespace
