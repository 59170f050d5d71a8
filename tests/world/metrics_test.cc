// SPDX-License-Identifier: GPL-2.0-or-later
//
// The metrics of a world file equal values that are computed without them.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "stage.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

std::unique_ptr<World> LoadText(const std::string& text) {
  auto world = std::make_unique<World>(OptionsOf(1));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "m.world"));
  return world;
}

std::map<std::string, double> MetricsOf(const World& world) {
  std::map<std::string, double> metrics;
  for (const NamedMetric& metric : world.Metrics()) metrics[metric.name] = metric.value;
  return metrics;
}

/// Robot a drives to the right at 1 m/s, robot b follows at half that speed.
class MetricsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }

  void Load(const std::string& metrics) {
    world_ = LoadText(
        "interval_sim 100\ndefine robot position( size [0.2 0.2 0.2] )\n"
        "robot( name \"a\" pose [0 0 0 0] )\n"
        "robot( name \"b\" pose [-3 0 0 0] )\n"
        "model( name \"wall\" pose [6 0 0 0] size [0.2 4 1] )\n" +
        metrics);
    Drive();
  }
  void Drive() {
    for (const char* name : {"a", "b"})
      dynamic_cast<ModelPosition*>(world_->GetModel(name))->SetSpeed(*name == 'a' ? 1 : 0.5, 0, 0);
    for (const char* name : {"a", "b"}) world_->GetModel(name)->Subscribe();
  }
  void Step(int steps) {
    for (int i = 0; i < steps; i++) world_->Update();
  }

  std::unique_ptr<World> world_;
};

TEST_F(MetricsTest, HaveTheRightValues) {
  Load(
      "metric( name \"driven\" kind \"distance\" )\n"
      "metric( kind \"distance\" model \"a\" )\n"
      "metric( kind \"collisions\" )\n"
      "metric( kind \"nearest\" )\n"
      "metric( kind \"coverage\" cell 1 model \"a\" )\n"
      "metric( name \"first\" kind \"time_to_goal\" goal [2 0] radius 0.1 first 1 )\n"
      "metric( name \"all\" kind \"time_to_goal\" goal [2 0] radius 0.1 )\n");
  std::map<std::string, double> metrics = MetricsOf(*world_);
  EXPECT_EQ(metrics["driven"], 0);
  EXPECT_TRUE(std::isnan(metrics["first"]));
  EXPECT_TRUE(std::isnan(metrics["nearest"]));
  Step(40);
  metrics = MetricsOf(*world_);
  const double a = world_->GetModel("a")->GetGlobalPose().x,
               b = world_->GetModel("b")->GetGlobalPose().x + 3;
  EXPECT_NEAR(a, 4, 0.2);
  EXPECT_NEAR(metrics["distance"], a, 1e-9);
  EXPECT_NEAR(metrics["driven"], (a + b) / 2, 1e-9);
  EXPECT_EQ(metrics["collisions"], 0);
  EXPECT_NEAR(metrics["coverage"], std::floor(a) + 1, 1e-9);
  EXPECT_NEAR(metrics["first"], 2, 0.2);
  EXPECT_TRUE(std::isnan(metrics["all"]));
  EXPECT_NEAR(metrics["nearest"], 3, 0.2) << "at the beginning";
  Step(100);
  metrics = MetricsOf(*world_);
  EXPECT_EQ(metrics["collisions"], 1) << "a, once, at the wall";
  EXPECT_NEAR(metrics["all"], 10, 0.3);
  EXPECT_NEAR(metrics["first"], 2, 0.2);
}

TEST_F(MetricsTest, RestartAfterResetAndRestore) {
  Load("metric( kind \"distance\" model \"a\" )\n");
  Step(10);
  Snapshot now;
  ASSERT_TRUE(world_->Take(&now));
  world_->SetMetric("mine", 5);
  EXPECT_EQ(MetricsOf(*world_)["mine"], 5);
  Step(10);
  const double before = MetricsOf(*world_)["distance"];
  EXPECT_NEAR(before, 2, 0.2);
  ASSERT_TRUE(world_->Restore(now));
  EXPECT_EQ(MetricsOf(*world_)["distance"], 0);
  EXPECT_EQ(MetricsOf(*world_).count("mine"), 0U);
  Step(10);
  EXPECT_NEAR(MetricsOf(*world_)["distance"], 1, 1e-6);
  ASSERT_TRUE(world_->Reset(1));
  Drive();
  Step(20);
  EXPECT_EQ(MetricsOf(*world_)["distance"], before);
}

TEST_F(MetricsTest, TeleportingIsNoDistance) {
  Load("metric( kind \"distance\" model \"a\" )\n");
  Step(5);
  Model* const a = world_->GetModel("a");
  const double before = MetricsOf(*world_)["distance"];
  Pose pose = a->GetPose();
  pose.y += 3;
  a->SetPose(pose);
  Step(1);
  EXPECT_LE(MetricsOf(*world_)["distance"], before + 0.1 + 1e-6);
  Step(5);
  EXPECT_NEAR(MetricsOf(*world_)["distance"], before + 0.55, 0.06);
}

TEST_F(MetricsTest, OutliveTheirModels) {
  Load("metric( kind \"distance\" )\nmetric( kind \"nearest\" )\nmetric( kind \"collisions\" )\n");
  Step(10);
  delete world_->GetModel("a");
  Step(10);
  EXPECT_NEAR(MetricsOf(*world_)["distance"], (1 + 1) / 2.0, 0.2);
}

TEST_F(MetricsTest, OfAPopulation) {
  const std::unique_ptr<World> world = LoadText(
      "population( name \"crowd\" model \"position\" count 3 area [-5 -5 5 5] )\n"
      "metric( name \"crowds\" kind \"time_to_goal\" goal [0 0] radius 100 model \"crowd\" )\n"
      "metric( name \"nobodys\" kind \"coverage\" model \"crowd2\" )\n");
  world->Update();
  EXPECT_NEAR(MetricsOf(*world)["crowds"], 0.1, 1e-9);
  EXPECT_EQ(MetricsOf(*world)["nobodys"], 1) << "of crowd2";
}

class Counter : public Metric {
 public:
  explicit Counter(double from) : from_(from) {}
  void Start(World&) override { steps_ = 0; }
  void Step(World&) override { steps_++; }
  double Value() const override { return from_ + steps_; }

 private:
  double from_;
  int steps_ = 0;
};

std::unique_ptr<Metric> MakeCounter(const MetricOrder& order) {
  return std::unique_ptr<Metric>(new Counter(order.file->ReadFloat(order.entity, "from", 0)));
}

TEST_F(MetricsTest, SupportCustomKinds) {
  ASSERT_TRUE(RegisterMetric("counter", MakeCounter));
  Load("metric( kind \"counter\" from 10 )\n");
  Step(3);
  EXPECT_EQ(MetricsOf(*world_)["counter"], 13);
}

TEST_F(MetricsTest, RejectInvalidMetrics) {
  const auto error = [](const std::string& text) {
    World world(OptionsOf(1));
    std::istringstream content("position( name \"a\" )\n" + text);
    return ErrorsOf([&] { EXPECT_FALSE(world.Load(content, "m.world")); });
  };
  EXPECT_EQ(error("metric( kind \"foo\" )").rfind("m.world:2:", 0), 0U);
  EXPECT_NE(error("metric( kind \"foo\" )").find("expected one of collisions, "),
            std::string::npos);
  EXPECT_NE(error("metric( kind \"distance\" model \"b\" )").find("no model that is called \"b\""),
            std::string::npos);
  EXPECT_NE(error("metric( kind \"time_to_goal\" )").find("expected goal [X Y]"),
            std::string::npos);
  EXPECT_NE(error("metric( kind \"coverage\" cell 0 )").find("greater than 0"), std::string::npos);
  EXPECT_NE(
      error("metric( kind \"distance\" ) metric( kind \"distance\" )").find("a second metric"),
      std::string::npos);
}

}  // namespace
}  // namespace Stg
