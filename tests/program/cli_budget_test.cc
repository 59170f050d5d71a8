// SPDX-License-Identifier: GPL-2.0-or-later
//
// --budget-ms: how many scenarios fit.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "support/cli_testing.hh"
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

TEST_F(CliBudget, SaysHowManyFit) {
  const Result result =
      Stage({"--budget-ms", kSanitized ? "400" : "100", "--budget-horizon", "1", "--threads", "2",
             "--duration", "2", "--stats", Path("b.json").string(), simple_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "simple.world: 2 robots\n")) << result.out;
  EXPECT_TRUE(Contains(result.out, "a scenario: 1 s, 10 steps of 0.1 s, from the state at 2 s\n"));
  const nlohmann::json json = nlohmann::json::parse(ReadFile(Path("b.json")));
  EXPECT_EQ(json["steps"], 10);
  EXPECT_EQ(json["threads"], 2);
  EXPECT_GT(json["scenarios"], 0);
  EXPECT_GT(json["scenario_seconds"], 0.0);
  EXPECT_LE(json["decision_seconds"], json["budget_seconds"]);
  EXPECT_GT(json["branch_bytes"], 0);
}

TEST_F(CliBudget, ATimeThatIsTooShortIsSaidSo) {
  const Result result = Stage({"--budget-ms", "0.001", "--threads", "1", simple_});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "0.001 ms on 1 thread: not one scenario\n")) << result.out;
}

TEST_F(CliBudget, NonsenseIsRefused) {
  ExpectRefused({"--budget-ms", "soon", simple_}, "expected milliseconds, from 0.001 to 60000");
  ExpectRefused({"--budget-ms", "50", "--budget-horizon", "0", simple_},
                "expected simulated seconds");
  ExpectRefused({"--budget-ms", "50", simple_, simple_}, "found 2 world files, expected one");
  ExpectRefused({"--budget-ms", "50"}, "found no world file");
}

}  // namespace
