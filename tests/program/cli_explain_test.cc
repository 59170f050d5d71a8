// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs the real `stage` program with --explain.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "insight/explain.hh"
#include "support/cli_testing.hh"
#include "support/json.hh"

namespace {

using namespace cli_testing;

// Defined by GCC and Clang, respectively.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
#else
constexpr bool kSanitized = false;
#endif

class CliExplainTest : public CliTest {
 protected:
  /// A driven robot with a subscribed ranger, a parked one with an idle ranger, a box.
  void WriteScene(const std::string& name, const std::string& text) const {
    Write(name, text +
                    "\nposition( alwayson 1 size [0.5 0.5 0.2]"
                    " ranger( alwayson 1 sensor( range [0 8] fov 180 samples 90 ) ) )\n"
                    "position( pose [4 0 0 0] size [0.5 0.5 0.2] ranger( sensor( samples 7 ) ) )\n"
                    "model( pose [2 0 0 0] size [1 1 5] )\n"
                    "model( name \"ghost\" pose [2 3 0 0] size [1 1 5] ranger_return -1 )\n");
  }
};

/// Joins long lines that continue, indented, in the next line.
std::string Unwrapped(const std::string& text) {
  return std::regex_replace(text, std::regex("\n {14,}"), " ");
}

TEST_F(CliExplainTest, DescribesTheWorld) {
  WriteScene("w.world", "quit_time 3");
  const Result r = Stage({"--explain", "w.world"});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(r.out.find("w.world: explained, not run\n"), 0u) << r.out;
  for (const char* part :
       {"Simulated", "Not simulated, because nothing needs it", "Time of a step", "Memory, MB",
        "1 without subscribers: 1 ranger of 7 rays (position:1.ranger:0)",
        "1 with ranger_return < 0", "all of 3 models: position:0, position:1, ghost",
        "1 robot without subscribers", "no window, no OpenCL", "30 steps"})
    EXPECT_TRUE(Contains(Unwrapped(r.out), part)) << part << "\n" << r.out;
  EXPECT_TRUE(MatchesPart(r.out, "ranger +1 +90 +100 ms +90")) << r.out;
  EXPECT_LE(CountOf(r.out, "\n"), 60u);
  EXPECT_FALSE(Contains(r.out, "done"));
  EXPECT_FALSE(Contains(r.err, "Loading")) << r.err;
  EXPECT_TRUE(Contains(Stage({"--explain", "w.world", "--progress"}).err, "Loading w.world"));
}

TEST_F(CliExplainTest, AsJson) {
  WriteScene("w.world", "quit_time 3");
  const Result r = Stage({"--explain=json", "w.world"});
  EXPECT_EQ(r.status, 0) << r.err;
  const Json json = ParseJson(r.out);  // the whole output
  EXPECT_EQ(json["worldfile"], "w.world");
  EXPECT_EQ(json["models"], 6);
  EXPECT_EQ(json["robots"], 1);
  EXPECT_EQ(json["undriven_robots"], 1);
  EXPECT_EQ(json["steps"], 30);
  ASSERT_EQ(json["sensors"].size(), 2u);
  EXPECT_EQ(json["sensors"][0]["subscribed"], true);
  EXPECT_EQ(json["sensors"][0]["rays_per_step"], 90);
  EXPECT_EQ(json["sensors"][1]["subscribed"], false);
  EXPECT_EQ(json["sensors"][1]["ms_per_step"], 0);
  EXPECT_FALSE(json["sensors"][1].contains("measured"));
  EXPECT_GT(json["sensors"][0]["measured"]["ray_ns"], 0);
  double sum = 0;
  for (const auto& [name, ms] : json["step_ms"].items()) sum += ms.get<double>();
  EXPECT_NEAR(json["ms_per_step"].get<double>(), sum, 1e-9);
  EXPECT_TRUE(json["opencl"].is_null());
}

/// The reasons are those of Batch.explain() in Python, with what only making rows finds out.
TEST_F(CliExplainTest, TellsWhetherPoolsNeedObjects) {
  const struct {
    const char* text;
    const char* reason;  // "": the world is closed
  } cases[] = {
      {"position( alwayson 1 ranger( alwayson 1 update_interval 200 ) ) model( pose [2 0 0 0] )",
       ""},
      {"position( ctrl \"stage/wander\" ranger( sensor( samples 9 ) ) )", ""},
      {"position( ctrl \"wander\" ranger( sensor( samples 9 ) ) )",
       "there are controllers or callbacks (commands from arrays and batch controllers are "
       "possible"},
      {"position( alwayson 1 ) gripper( alwayson 1 pose [2 0 0 0] )",
       R"("gripper:0" is a gripper with subscribers)"},
      {"resolution 0.02 position( alwayson 1 size [3 1 1] )",
       R"("position:0" has an outline of more than 64 cells or corners (a coarser resolution)"}};
  for (const auto& [text, reason] : cases) {
    SCOPED_TRACE(text);
    Write("w.world", text);
    const std::string wanted = *reason ? "not closed: an object per world is needed, because "
                                       : "closed: pools, batches and branches step it without";
    const std::string out = Unwrapped(Stage({"--explain", "w.world"}).out);
    EXPECT_TRUE(Contains(out, "  in pools    " + wanted + reason)) << out;
    const Json json = ParseJson(Stage({"--explain=json", "w.world"}).out);
    EXPECT_EQ(json["closed"], !*reason);
    EXPECT_EQ(json["not_closed_because"].is_null(), !*reason);
  }
}

TEST_F(CliExplainTest, ToAFile) {
  WriteScene("w.world", "");
  const Result r = Stage({"--explain", "w.world", "--stats", "e.json", "--duration", "2"});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_TRUE(Contains(r.out, "Simulated\n"));
  EXPECT_EQ(Stats("e.json")["steps"], 20);
  EXPECT_TRUE(ParseJson(Stage({"--explain=json", "w.world"}).out)["steps"].is_null());
  ExpectRefused({"--explain", "w.world", "--stats", "/no/such/folder/e.json"}, "/no/such/folder");
}

TEST_F(CliExplainTest, SeveralWorlds) {
  WriteScene("a.world", "");
  WriteWorld("b.world", "");
  const Json json = ParseJson(Stage({"--explain=json", "a.world", "b.world"}).out);
  ASSERT_EQ(json["worlds"].size(), 2u);
  EXPECT_EQ(json["worlds"][0]["models"], 6);
  EXPECT_EQ(json["worlds"][1]["models"], 1);
  const std::string text = Stage({"--explain", "a.world", "b.world"}).out;
  EXPECT_LT(text.find("a.world: explained"), text.find("b.world: explained"));
}

TEST_F(CliExplainTest, Errors) {
  WriteWorld("w.world", "");
  ExpectRefused({"--explain"}, "found no world file");
  ExpectRefused({"--explain=xml", "w.world"}, "found 'xml'");
  for (const char* how : {"--explain", "--explain=json"}) {
    ExpectLoadFails(1, {how, "missing.world"}, "missing.world");
    EXPECT_EQ(Stage({how, "missing.world"}).out, "");
    EXPECT_EQ(Stage({how, "w.world", "missing.world"}).out, "");
  }
  Write("bad.world", "model( pose [ 1 2 )\n");
  ExpectLoadFails(1, {"--explain", "bad.world"}, "bad.world:1:");
  Write("bad.world", "model( ctrl \"gone\" )\n");
  ExpectLoadFails(255, {"--explain", "bad.world"}, "gone");
}

TEST_F(CliExplainTest, NamesIneffectiveOptions) {
  WriteWorld("w.world", "");
  Result r = Stage({"-gc", "--state-hash", "--progress", "--explain", "w.world"});
  EXPECT_EQ(r.status, 0);
  EXPECT_TRUE(Contains(r.err, "ignored --clock, --state-hash, --progress\n")) << r.err;
  EXPECT_FALSE(Contains(r.out, "state-hash"));
  r = Stage({"-g", "--seed=3", "--threads=2", "--no-progress", "--explain", "w.world"});
  EXPECT_FALSE(Contains(r.err, "ignored")) << r.err;
  EXPECT_TRUE(Contains(r.out, "2 threads"));
}

TEST_F(CliExplainTest, HelpAndPageSayHowLongMeasuringTakes) {
  char text[40];
  std::snprintf(text, sizeof text, " %g s", Stg::kMeasuringSeconds);
  const std::string help = Stage({"--help"}).out;
  EXPECT_TRUE(Contains(help, "--explain[=json]"));
  EXPECT_TRUE(Contains(help, "are measured for" + std::string(text) + ")")) << help;
  std::ifstream file(std::string(std::getenv("STAGE_SOURCE_DIR")) + "/docs/economy.md");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  EXPECT_TRUE(Contains(page, "For" + std::string(text) + ", samples")) << page;
}

TEST_F(CliExplainTest, MeasuresADevice) {
  WriteScene("w.world", "");
  const Json json = ParseJson(Stage({"--explain=json", "--opencl", "w.world"}).out);
  if (json["opencl"].is_null()) GTEST_SKIP() << "there is no OpenCL device";
  const Json& measured = json["sensors"][0]["measured"];
  const double device = measured["device_ray_ns"], host = measured["ray_ns"];
  EXPECT_GT(device, 0);
  EXPECT_GT(host, 0);
  EXPECT_EQ(measured["chosen_ray_ns"], std::min(device, host));
  EXPECT_GT(json["memory_mb"]["device"], 0);
}

TEST_F(CliExplainTest, KnowsTheMemoryOfARun) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need memory of their own";
  std::string world = "quit_time 0.5\n";
  for (int i = 0; i < 50; i++)
    world += "position( alwayson 1 pose [" + std::to_string(2 * i) +
             " 0 0 0] ranger( alwayson 1 sensor( samples 20000 fov 360 range [0 3] ) ) )\n";
  Write("w.world", world);
  const Json explained = ParseJson(Stage({"--explain=json", "w.world"}).out);
  Stage({"-g", "w.world", "--stats", "run.json"});
  const double estimate = explained["peak_memory_mb"], run = Stats("run.json")["peak_memory_mb"];
  EXPECT_GT(estimate, 24);  // at least 24 bytes for each of a million readings
  EXPECT_NEAR(estimate / run, 1, 0.25) << estimate << " " << run;
}

}  // namespace
