// SPDX-License-Identifier: GPL-2.0-or-later
//
// NaN, infinity, numbers out of the range of a double, and the largest and smallest doubles, in
// every numeric property of a world file. It verifies rows of docs/extremes.md.

#include <set>

#include "extremes_testing.hh"
#include "models/energy_charts.hh"
#include "support/property_table.hh"

namespace Stg::extremes {
namespace {

using properties::ElementsOf;
using properties::Property;

/// Properties whose values look numeric but are not read as numbers.
struct Exempt {
  const char *entity, *name, *reason;
};
const Exempt kExempt[] = {
    {"position", "odom", "has no effect but a message"},
};

bool IsExempt(const Property& property) {
  for (const Exempt& exempt : kExempt)
    if (std::string(exempt.entity) == property.entity && std::string(exempt.name) == property.name)
      return true;
  return std::string(property.entity) == "window";  // only read by a window
}

bool IsNumeric(const Property& property) {
  return ElementsOf(property.value).front().find_first_not_of("+-.0123456789") == std::string::npos;
}

/// The property's value with one element replaced.
std::string ValueWith(const Property& property, size_t index, const std::string& element) {
  std::vector<std::string> elements = ElementsOf(property.value);
  elements[index] = element;
  std::string value;
  for (const std::string& e : elements) value += (value.empty() ? "" : " ") + e;
  return property.value[0] == '[' ? "[" + value + "]" : value;
}

std::string WorldWithElement(const Property& property, size_t index, const std::string& element) {
  const std::string value = ValueWith(property, index, element);
  Property changed = property;
  changed.value = value.c_str();
  return WorldWith(changed, property.name);
}

std::vector<Property> NumericProperties() {
  std::vector<Property> numeric;
  const auto add = [&](const auto& table) {
    for (const Property& property : table)
      if (IsNumeric(property)) numeric.push_back(property);
  };
  add(properties::kWorld);
  add(properties::kOrders);
  add(properties::kEveryModel);
  add(properties::kTypes);
  add(properties::kWindow);
  return numeric;
}

/// True for the maximum range of a sensor, the only number that may be infinite.
bool MayBe(const Property& property, size_t index, const std::string& element) {
  return std::string(property.entity) == "sensor" && std::string(property.name) == "range" &&
         index == 1 && (element == "\"inf\"" || element == "\"infinity\"");
}

// ---- values that are not finite -----------------------------------------------------------------

TEST(NotFinite, IsRefusedInEveryProperty) {
  size_t refused = 0;
  for (const Property& property : NumericProperties()) {
    if (IsExempt(property)) continue;
    for (size_t i = 0; i < ElementsOf(property.value).size(); i++)
      for (const char* bad :
           {"\"nan\"", "\"NaN\"", "\"inf\"", "\"-infinity\"", "\"1e999\"", "\"-1e999\""}) {
        const std::string text = WorldWithElement(property, i, bad);
        const LoadOutcome outcome = TryToLoad(text);
        if (MayBe(property, i, bad)) {
          EXPECT_TRUE(outcome.loaded) << outcome.errors;
          continue;
        }
        EXPECT_FALSE(outcome.loaded) << text;
        EXPECT_EQ(outcome.status, 1) << text;
        EXPECT_EQ(outcome.models, 1u) << text;  // the ground
        EXPECT_EQ(outcome.errors, "t.world:1:" + std::to_string(text.find(bad) + 1) +
                                      ": property \"" + property.name + "\": found " + bad +
                                      ", expected a finite number\n")
            << text;
        refused++;
      }
  }
  RecordProperty("refused", static_cast<int>(refused));
  EXPECT_GT(refused, 600u);
}

TEST(NotFinite, WithoutQuotesIsRefusedToo) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999"})
    for (const char* text : {"model( mass # )", "model( pose [0 # 0 0] )", "interval_sim #"}) {
      std::string world = text;
      world.replace(world.find('#'), 1, bad);
      const LoadOutcome outcome = TryToLoad(world);
      EXPECT_FALSE(outcome.loaded) << world;
      EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
    }
}

TEST(NotFinite, ExemptionsAreCurrent) {
  size_t exempt = 0;
  for (const Property& property : NumericProperties()) {
    if (!IsExempt(property)) continue;
    EXPECT_TRUE(TryToLoad(WorldWithElement(property, 0, "\"nan\"")).loaded) << property.name;
    exempt++;
  }
  EXPECT_GT(exempt, std::size(kExempt));
}

TEST(NotFinite, OverflowingEnergyIsRefused) {
  for (const char* name : {"kjoules", "kjoules_capacity"}) {
    const std::string text = std::string("model( ") + name + " \"1e306\" )";
    const LoadOutcome outcome = TryToLoad(text);
    EXPECT_FALSE(outcome.loaded);
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
    EXPECT_NE(outcome.errors.find(name), std::string::npos) << outcome.errors;
  }
}

// ---- extreme finite values ----------------------------------------------------------------------

/// A robot with all types of sensors that observes the model with the property.
const char kWitness[] =
    "position( alwayson 1 pose [3 0 0 170] size [0.4 0.4 0.5] ranger( sensor( range [0 \"inf\"]"
    " fov 360 samples 90 ) ) blobfinder() fiducial() camera() bumper( bcount 1 bpose[0] [0.3 0 0 0]"
    " blength 0.5 ) gripper() wifi( model \"raytrace\" power 100 ) )\n";

/// Subscribes to all models and makes some steps.
void StepEverything(World* world) {
  for (Model* model : world->GetAllModels()) model->Subscribe();
  for (int i = 0; i < 12; i++) world->Update();
  for (Model* model : world->GetAllModels())
    EXPECT_TRUE(IsFinite(model->GetGlobalPose())) << model->PrintWithPose();
}

TEST(HugeAndTiny, AreRefusedOrHarmless) {
  size_t loaded = 0, refused = 0;
  for (const Property& property : NumericProperties()) {
    if (std::string(property.name) == "threads") continue;  // it would start a thousand threads
    for (size_t i = 0; i < ElementsOf(property.value).size(); i++)
      for (const char* value : {"\"1e300\"", "\"-1e300\"", "\"1.7e308\"", "\"1e-300\"",
                                "\"5e-324\"", "-0", "2147483647", "-2147483648", "99999999999"}) {
        const std::string text = WorldWithElement(property, i, value) + kWitness;
        SCOPED_TRACE(text);
        const std::unique_ptr<World> world = EmptyWorld();
        const LoadOutcome outcome = TryToLoad(world.get(), text);
        if (outcome.loaded) {
          loaded++;
          testing::internal::CaptureStdout();
          StepEverything(world.get());
          testing::internal::GetCapturedStdout();
        } else {
          EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
          refused++;
        }
      }
  }
  EXPECT_GT(loaded, 500u);
  EXPECT_GT(refused, 50u);
}

TEST(HugeAndTiny, ActuatorsStopAtTheLargestNumbers) {
  const auto world = LoadText(
      "actuator( name \"a\" pose [\"1e308\" 0 0 0] max_position \"1.7e308\""
      " max_speed \"1.7e308\" )\n");
  auto* arm = FindRunning<ModelActuator>(*world, "a");
  arm->SetSpeed(kInfinity);
  for (int i = 0; i < 20; i++) {
    Step(*world);
    EXPECT_TRUE(IsFinite(arm->GetPose()));
  }
  EXPECT_TRUE(arm->Stalled());
  EXPECT_GT(arm->GetPose().x, 1.6e308);
  arm->SetSpeed(-1e307);
  Step(*world);
  EXPECT_FALSE(arm->Stalled());
}

TEST(HugeAndTiny, EnergyMapsClampToTheirOutermostSquares) {
  joules_t greatest = 0;
  DissipationVis map(&greatest);
  for (const double far : {1e12, 1e300, kInfinity}) map.Accumulate(far, -far, 2);
  EXPECT_EQ(map.At(1e15, -1e15), 6);
  EXPECT_EQ(map.At(-1e15, -1e15), 0);
  EXPECT_EQ(map.At(1e9, -1e9), 0);
  map.Accumulate(kNaN, kNaN, 1);
  EXPECT_EQ(map.At(kNaN, kNaN), 1);
}

}  // namespace
}  // namespace Stg::extremes
