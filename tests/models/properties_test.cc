// SPDX-License-Identifier: GPL-2.0-or-later
//
// Every property of the table is read: a world with it loads without the warning "is never read". A
// misspelt property in the same place causes that warning, which proves that the test is
// meaningful.

#include <set>

#include "support/model_testing.hh"
#include "support/property_table.hh"
#include "worldfile/worldfile.hh"

namespace Stg {
namespace {

using properties::kEveryModel;
using properties::kOrders;
using properties::kTypes;
using properties::kWindow;
using properties::kWorld;
using properties::Property;
using properties::TestName;
using properties::WorldWith;

/// Properties that are deliberately not read. A test checks that each is reported.
struct Unread {
  Property property;
  const char* reason;
};
const Unread kUnread[] = {
    {{"window", "show_bumper", "1"}, "a menu item that is never registered; see show_bumper_hits"},
    {{"sensor", "name", "\"s\""}, "a sensor is no model: it is found by its number"},
    {{"ranger", "samples", "10"}, "belongs to the sensors inside of the ranger"},
    {{"ranger", "range", "[0 5]"}, "belongs to the sensors inside of the ranger"},
    {{"ranger", "fov", "90"}, "belongs to the sensors inside of the ranger"},
    {{"fiducial", "range", "3"}, "the finder's are range_max and range_max_id"},
    {{"bumper", "blength", "0.1"}, "without bcount there are no bumpers"},
};

bool IsReported(const std::string& errors, const std::string& name) {
  return errors.find("property \"" + name + "\" is never read") != std::string::npos;
}

/// True if the world can't be loaded without the property.
bool IsRequired(const Property& property) {
  const std::string name = std::string(property.entity) + "." + property.name;
  return name == "population.model" || name == "population.area" || name == "metric.kind" ||
         name == "metric.goal";
}

/// A static build refuses all plug-ins, so the property is read as an empty list there.
Property Readable(Property property) {
#ifdef STAGE_STATIC
  if (property.name == std::string("plugins")) property.value = "[]";
#endif
  return property;
}

class Properties : public testing::TestWithParam<Property> {};

TEST_P(Properties, IsRead) {
  const Property property = Readable(GetParam());
  const LoadOutcome outcome = TryToLoad(WorldWith(property, property.name));
  EXPECT_TRUE(outcome.loaded) << outcome.errors;
  EXPECT_EQ(outcome.errors.find("is never read"), std::string::npos) << outcome.errors;
  // Only "odom" causes a warning, which is a different one.
  EXPECT_EQ(outcome.errors.empty(), property.name != std::string("odom")) << outcome.errors;
}

TEST_P(Properties, IsReportedIfMisspelt) {
  const Property& property = GetParam();
  const std::string misspelt = std::string(property.name) + "_";
  const LoadOutcome outcome = TryToLoad(WorldWith(property, misspelt));
  if (IsRequired(property)) {
    EXPECT_FALSE(outcome.loaded);
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
  } else {
    EXPECT_TRUE(IsReported(outcome.errors, misspelt)) << outcome.errors;
  }
}

INSTANTIATE_TEST_SUITE_P(World, Properties, testing::ValuesIn(kWorld), TestName);
INSTANTIATE_TEST_SUITE_P(Orders, Properties, testing::ValuesIn(kOrders), TestName);
INSTANTIATE_TEST_SUITE_P(Window, Properties, testing::ValuesIn(kWindow), TestName);
INSTANTIATE_TEST_SUITE_P(EveryModel, Properties, testing::ValuesIn(kEveryModel), TestName);
INSTANTIATE_TEST_SUITE_P(Types, Properties, testing::ValuesIn(kTypes), TestName);

/// Types that override loading must still read the properties of all models.
TEST(PropertiesOfEveryModel, AreReadByEveryType) {
  InitLibrary();
  ASSERT_FALSE(Model::name_map.empty());
  for (const auto& [type, creator] : Model::name_map) {
    for (const Property& property : kEveryModel) {
      Property of_type = property;
      of_type.entity = type.c_str();
      const LoadOutcome outcome = TryToLoad(WorldWith(of_type, property.name));
      EXPECT_TRUE(outcome.loaded) << type << ' ' << property.name << '\n' << outcome.errors;
      EXPECT_FALSE(IsReported(outcome.errors, property.name)) << type << ' ' << property.name;
    }
  }
}

/// Replaces an index: `point[3]` becomes `point[]`.
std::string WithoutIndex(const std::string& name) {
  const size_t bracket = name.find('[');
  return bracket == std::string::npos ? name : name.substr(0, bracket) + "[]";
}

/// No property is read that is not in the table. docs/properties.md has the same properties.
TEST(PropertiesTable, HasAllPropertiesThatAreRead) {
  std::set<std::string> tabled, asked;
  const auto add = [&](const Property& property) {
    tabled.insert(WithoutIndex(property.name));
    const auto world = EmptyWorld();
    EXPECT_TRUE(TryToLoad(world.get(), WorldWith(Readable(property), property.name)).loaded);
    for (const std::string& name : world->GetWorldFile()->AskedNames())
      asked.insert(WithoutIndex(name));
  };
  for (const Property& property : kWorld) add(property);
  for (const Property& property : kOrders) add(property);
  for (const Property& property : kWindow) add(property);
  for (const Property& property : kEveryModel) add(property);
  for (const Property& property : kTypes) add(property);
  for (const auto& [type, creator] : Model::name_map) {
    const auto world = EmptyWorld();
    EXPECT_TRUE(TryToLoad(world.get(), type + "( )").loaded);
    for (const std::string& name : world->GetWorldFile()->AskedNames())
      asked.insert(WithoutIndex(name));
  }
  for (const std::string& name : asked)
    EXPECT_EQ(tabled.count(name), 1u) << name << " is missing in property_table.hh";
  for (const std::string& name : tabled) EXPECT_EQ(asked.count(name), 1u) << name;
}

/// The table has properties of all types except for `ranger`, which has none.
TEST(PropertiesTable, KnowsEveryType) {
  InitLibrary();
  std::set<std::string> tabled = {"model", "ranger"};
  for (const Property& property : kTypes) tabled.insert(property.entity);
  for (const auto& [type, creator] : Model::name_map) EXPECT_EQ(tabled.count(type), 1u) << type;
}

TEST(UnreadProperties, AreReported) {
  for (const Unread& unread : kUnread) {
    const Property& property = unread.property;
    const LoadOutcome outcome = TryToLoad(WorldWith(property, property.name));
    EXPECT_TRUE(outcome.loaded) << outcome.errors;
    EXPECT_TRUE(IsReported(outcome.errors, property.name))
        << property.entity << ' ' << property.name << ": " << unread.reason << '\n'
        << outcome.errors;
  }
}

}  // namespace
}  // namespace Stg
