// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs the real `stage` program with --explain-ray.

#include <cstdlib>
#include <string>

#include "support/cli_testing.hh"
#include "support/json.hh"

namespace {

using namespace cli_testing;

constexpr char kWorld[] = R"(
  resolution 0.02
  interval_sim 100
  model( name "wall" pose [3 0 0 0] size [0.2 2 1] )
  position( name "r0" pose [0 0 0 0] size [0.2 0.2 0.5]
    ranger( alwayson 1 sensor( range [0 8] fov 90 samples 9 ) sensor( range [0 2] fov 0 samples 1 ) ) )
  position( name "r1" pose [0 2 0 0]
    ranger( alwayson 1 sensor( range [0 8] fov 0 samples 1 ) )
    ranger( name "idle" sensor( range [0 8] fov 0 samples 1 ) ) )
)";

class ExplainRay : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    Write("w.world", kWorld);
  }
  Result Explain(const std::string& choice) { return Stage({"--explain-ray", choice, "w.world"}); }
};

TEST_F(ExplainRay, ExplainsTheRange) {
  const Result r = Explain("r0:0:0:4@1");
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_TRUE(r.out.starts_with("sample 4 of sensor 0 of r0.ranger:0, cast at 1 s\n")) << r.out;
  EXPECT_TRUE(Contains(r.out, "wall, 0 to 1 m high: stops the ray")) << r.out;
  EXPECT_TRUE(MatchesPart(r.out, "hit    wall: the midpoint .*, 2\\.[89]")) << r.out;
  EXPECT_TRUE(Contains(r.out, "noise  none")) << r.out;
  const Result far = Explain("r0:0:1:0@1");
  EXPECT_TRUE(Contains(far.out, "hit    nothing: the sensor's greatest range, 2 m")) << far.out;
}

TEST_F(ExplainRay, TakesNamesInSeveralForms) {
  const std::string text = Explain("r0:0:0:4@1").out;
  EXPECT_EQ(Explain("r0:0:4@1").out, text) << "the robot has one ranger";
  EXPECT_EQ(Explain("r0.ranger:0:0:4@1").out, text);
  EXPECT_EQ(Explain("r0:ranger:0:0:4@1").out, text);
  EXPECT_EQ(Explain("r0:r0.ranger:0:0:4@1").out, text);
}

TEST_F(ExplainRay, WritesJsonToo) {
  const Result r = Stage(
      {"--ray-model", "exact", "--explain-ray", "r0:0:4@1", "--stats", "ray.json", "w.world"});
  EXPECT_EQ(r.status, 0) << r.err;
  const auto json = nlohmann::json::parse(ReadFile(Path("ray.json")));
  EXPECT_EQ(json["hit"], "wall");
  EXPECT_EQ(json["fan"]["ray_model"], "exact");
  EXPECT_NEAR(json["range"].get<double>(), 2.9, 1e-9);
  EXPECT_EQ(json["range"], json["hit_range"]);
  EXPECT_FALSE(json["potential_hits"].empty());
}

TEST_F(ExplainRay, RefusesUnknownNames) {
  ExpectRefused({"--explain-ray", "r0@1", "w.world"}, "ROBOT:RANGER:SENSOR:SAMPLE@SECONDS");
  ExpectRefused({"--explain-ray", "r0:0:0:4", "w.world"}, "ROBOT:RANGER:SENSOR:SAMPLE@SECONDS");
  ExpectRefused({"--explain-ray", "r0:0:0:4@soon", "w.world"}, "found \"r0:0:0:4@soon\"");
  ExpectRefused({"--explain-ray", "r0:0:0:4@-1", "w.world"}, "expected ROBOT");
  ExpectRefused({"--explain-ray", "r0:0:0:4@1"}, "world file");
  ExpectRefused({"--explain-ray", "r0:0:0:4@1", "w.world", "w.world"}, "found 2 world files");
  for (const auto& [choice, text] : {std::pair{"nobody:0:0:4@1", "found no ranger \"nobody:0\""},
                                     {"r0:5:0:4@1", "the rangers are \"r0.ranger:0\""},
                                     {"r1:0:0@1", "found 2 rangers of \"r1\""},
                                     {"r0:0:2:0@1", "found sensor 2"},
                                     {"r0:0:0:9@1", "found sample 9"}}) {
    const Result r = Explain(choice);
    EXPECT_EQ(r.status, 2) << choice;
    EXPECT_EQ(r.out, "") << choice;
    EXPECT_TRUE(Contains(r.err, text)) << r.err;
  }
}

TEST_F(ExplainRay, SaysWhenThereIsNoReadingYet) {
  const Result early = Explain("r0:0:0:4@0");
  EXPECT_EQ(early.status, 1);
  EXPECT_TRUE(Contains(early.err, "has not updated by 0 s")) << early.err;
  const Result idle = Explain("r1:idle:0:0@1");
  EXPECT_EQ(idle.status, 1);
  EXPECT_TRUE(Contains(idle.err, "nobody subscribes to it")) << idle.err;
}

/// The examples in docs/rays.md equal the program's output.
TEST_F(ExplainRay, DocumentsShowWhatItSays) {
  const fs::path root = std::getenv("STAGE_SOURCE_DIR");
  const std::string page = ReadFile(root / "docs/rays.md");
  const Result r = Stage({"--explain-ray", "r0:1:0:60@5", (root / "worlds/simple.world").string()});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_TRUE(Contains(page, r.out)) << r.out;
}

}  // namespace
