// SPDX-License-Identifier: GPL-2.0-or-later
//
// --budget-ms: numbers of scenarios, and of samples of a decision, that fit into the time.

#include <gtest/gtest.h>

#include <string>

#include "support/cli_testing.hh"
#include "support/json.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace {

using namespace cli_testing;

class CliBudget : public CliTest {
 protected:
  const std::string simple_ = SourceFile("worlds/simple.world");

  void ExpectRefused(const Strings& arguments, const std::string& part) {
    const Result result = Stage(arguments);
    EXPECT_EQ(result.status, 2);
    EXPECT_TRUE(Contains(result.err, part)) << result.err;
    EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
  }
};

TEST_F(CliBudget, ReportsHowManyFit) {
  const Result result =
      Stage({"--budget-ms", kSanitized ? "400" : "100", "--budget-horizon", "1", "--threads", "2",
             "--duration", "2", "--stats", Path("b.json").string(), simple_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "simple.world: 2 robots\n")) << result.out;
  EXPECT_TRUE(Contains(result.out, "a scenario: 1 s, 10 steps of 0.1 s, from the state at 2 s\n"));
  const Json json = ParseJson(ReadFile(Path("b.json")));
  EXPECT_EQ(json["steps"], 10);
  EXPECT_EQ(json["threads"], 2);
  EXPECT_GT(json["scenarios"], 0);
  EXPECT_GT(json["scenario_seconds"], 0.0);
  EXPECT_LE(json["decision_seconds"], json["budget_seconds"]);
  EXPECT_GT(json["branch_bytes"], 0);
}

TEST_F(CliBudget, MeasuresDecisionsAboutTheFirstRobotThatObeys) {
  Write("open.world",
        "position( name \"driven\" pose [0 2 0 0] ctrl \"stage/goal x=3 y=2\" )\n"
        "position( name \"robot\" alwayson 1 )\n");
  const Strings arguments = {"--budget-ms", "20", "--budget-horizon", "1",
                             "--threads",   "1",  "--stats",          Path("b.json").string()};
  Strings all = arguments;
  all.push_back("open.world");
  const Result result = Stage(all);
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "a decision of 30 candidates x 10 samples x 1 s: "));
  EXPECT_TRUE(Contains(result.out, "a decision of 30 candidates in 20 ms: "));
  EXPECT_TRUE(Contains(result.out, "the candidates are velocities of \"robot\"; no sample ends"))
      << result.out;
  const Json decision = ParseJson(ReadFile(Path("b.json")))["decision"];
  EXPECT_EQ(decision["candidates"], 30);
  EXPECT_EQ(decision["samples"], 10);
  EXPECT_EQ(decision["robot"], "robot");
  EXPECT_GT(decision["seconds"], 0.0);
  EXPECT_GT(decision["memory_mb"], 1.0);
  EXPECT_EQ(decision["why_not_closed"], "");
  all.back() = simple_;
  const Result driven = Stage(all);
  EXPECT_TRUE(Contains(driven.out, "the candidates give no commands, because no robot would obey "))
      << driven.out;
  const Json none = ParseJson(ReadFile(Path("b.json")))["decision"];
  EXPECT_TRUE(Contains(std::string(none["why_no_robot"]), "is refused: a controller has replaced"));
  EXPECT_NE(none["why_not_closed"], "");
}

TEST_F(CliBudget, ReportsTooShortBudget) {
  const Result result = Stage({"--budget-ms", "0.001", "--threads", "1", simple_});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "0.001 ms on 1 thread: no scenario\n")) << result.out;
  EXPECT_TRUE(Contains(result.out, " in 0.001 ms: not one sample of each fits\n")) << result.out;
}

TEST_F(CliBudget, KeepsItsTimeAndShowsWhatItDoes) {
  // A step of this world takes several milliseconds, so no scenario fits.
  Write("slow.world",
        "define robot position( size [0.3 0.3 0.3] alwayson 1\n"
        "  ranger( alwayson 1 sensor( range [0 8] samples 720 fov 360 ) ) )\n"
        "population( name \"robots\" model \"robot\" count 200 area [-20 -20 20 20] )\n");
  const Result slow = Stage({"--budget-ms", "1", "--budget-horizon", "20", "--threads", "1",
                             "--duration", "0.2", "--progress", "slow.world"});
  EXPECT_EQ(slow.status, 0) << slow.err;
  EXPECT_TRUE(Contains(slow.out, "no scenario\n")) << slow.out;
  EXPECT_TRUE(Contains(slow.err, "measuring what a scenario takes\n")) << slow.err;
  // Without a limit, finding the number that fits into two seconds would take minutes.
  const Result long_budget = Stage(
      {"--budget-ms", "2000", "--budget-horizon", "0.1", "--threads", "1", "--progress", simple_});
  EXPECT_EQ(long_budget.status, 0) << long_budget.err;
  EXPECT_TRUE(Contains(long_budget.err, " scenarios fit; trying ")) << long_budget.err;
  EXPECT_LT(long_budget.seconds, (kSanitized ? 300 : 60) * patience::Slowness());
}

TEST_F(CliBudget, NonsenseIsRefused) {
  ExpectRefused({"--budget-ms", "soon", simple_}, "expected milliseconds, from 0.001 to 60000");
  ExpectRefused({"--budget-ms", "50", "--budget-horizon", "0", simple_},
                "expected simulated seconds");
  ExpectRefused({"--budget-ms", "50", simple_, simple_}, "found 2 world files, expected one");
  ExpectRefused({"--budget-ms", "50"}, "found no world file");
}

}  // namespace
