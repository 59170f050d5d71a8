// SPDX-License-Identifier: GPL-2.0-or-later
//
// Meaningless numbers: negative values of every numeric property, and swapped pairs. Each causes
// one message, or is in a list of allowed values.

#include <algorithm>
#include <fstream>
#include <set>

#include "support/model_testing.hh"
#include "support/property_table.hh"

namespace Stg {
namespace {

using properties::ElementsOf;
using properties::Property;
using properties::WorldWith;

// ---- negative numbers ---------------------------------------------------------------------------

/// Properties that may be negative, with the reasons. docs/properties.md documents them.
const std::set<std::string> kMayBeNegative = {
    // places, headings and directions
    "pose", "origin", "point[0]", "point[1]", "point[2]", "localization_origin", "odom", "bpose[0]",
    "pan", "pantilt", "axis", "area", "goal", "directions",
    // intervals: see the pairs below
    "velocity_bounds", "acceleration_bounds", "z", "min_position", "max_position", "start_position",
    // speeds, errors, levels
    "velocity", "odom_error", "power", "sensitivity", "range_db",
    // values of fields
    "initial", "picture_range", "deposit_rate",
    // identifiers, and properties in which negative values have a special meaning
    "seed", "channel", "fiducial_key", "fiducial_return", "ranger_return", "joules",
    "joules_capacity", "kjoules", "kjoules_capacity", "quit_time", "speedup", "color_rgba",
    // mirrored, with a warning
    "size",
    // read, no effect
    "map_resolution", "event_queue"};

/// Flags, in which every value except for 0 means yes.
const std::set<std::string> kFlags = {"show_clock",
                                      "test",
                                      "paused",
                                      "confirm_on_quit",
                                      "debug",
                                      "noblocks",
                                      "boundary",
                                      "stack_children",
                                      "blob_return",
                                      "gripper_return",
                                      "obstacle_return",
                                      "gui_nose",
                                      "gui_outline",
                                      "gui_grid",
                                      "gui_move",
                                      "alwayson",
                                      "ignore_zloc",
                                      "autosnatch",
                                      "enabled",
                                      "first",
                                      "limit_acceleration",
                                      "pushable",
                                      "round",
                                      "stops_when_empty",
                                      "line_of_sight",
                                      "collisions",
                                      "blind_near",
                                      "on",
                                      "shadows"};

bool MayBeNegative(const Property& property) {
  const std::string name = property.name, entity = property.entity;
  // A negative fov reverses a fan of rays; fiducial finders and cameras refuse it.
  if (name == "fov") return entity == "sensor" || entity == "blobfinder";
  return kMayBeNegative.count(name) > 0 || kFlags.count(name) > 0;
}

/// Values of a response curve, which follow their distances, may be any numbers.
bool IsResponseValue(const Property& property, size_t element) {
  return property.name == std::string("response") && element % 2 == 1;
}

bool IsNumber(const std::string& text) {
  return text.find_first_not_of("+-.0123456789") == std::string::npos;
}

std::string WorldWithElement(const Property& property, size_t index, const std::string& element) {
  std::vector<std::string> elements = ElementsOf(property.value);
  elements[index] = element;
  std::string value;
  for (const std::string& e : elements) value += (value.empty() ? "" : " ") + e;
  if (property.value[0] == '[') value = "[" + value + "]";
  Property changed = property;
  changed.value = value.c_str();
  return WorldWith(changed, property.name);
}

/// Expects one message with a place in the only line of the file.
void ExpectOneLine(const LoadOutcome& outcome, const std::string& text) {
  EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << text << '\n' << outcome.errors;
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << text << '\n'
                                                                               << outcome.errors;
  EXPECT_EQ(outcome.status == 0, outcome.loaded) << text;
}

template <typename F>
void ForEachProperty(F f) {
  for (const Property& property : properties::kWorld) f(property);
  for (const Property& property : properties::kOrders) f(property);
  for (const Property& property : properties::kEveryModel) f(property);
  for (const Property& property : properties::kTypes) f(property);
}

TEST(Nonsense, NegativeNumbersAreRefusedOrListed) {
  std::set<std::string> met;
  ForEachProperty([&](const Property& property) {
    const std::vector<std::string> elements = ElementsOf(property.value);
    if (!IsNumber(elements[0])) return;
    met.insert(property.name);
    if (MayBeNegative(property)) return;
    for (size_t i = 0; i < elements.size(); i++) {
      if (IsResponseValue(property, i)) continue;
      const std::string text = WorldWithElement(property, i, "-3");
      ExpectOneLine(TryToLoad(text), text);
    }
  });
  for (const std::string& name : kMayBeNegative) EXPECT_EQ(met.count(name), 1u) << name;
  for (const std::string& name : kFlags) EXPECT_EQ(met.count(name), 1u) << name;
}

/// Properties whose negative values cause warnings: sizes mirror; an error of -3 exceeds the
/// motion.
const std::set<std::string> kWarnedOf = {"size", "odom_error"};

TEST(Nonsense, NegativeNumbersThatAreListedLoad) {
  ForEachProperty([&](const Property& property) {
    if (property.name == std::string("odom") || !MayBeNegative(property)) return;
    const std::vector<std::string> elements = ElementsOf(property.value);
    const bool is_pair = elements.size() > 1 || property.name == std::string("max_position") ||
                         property.name == std::string("start_position");
    const std::string text =
        WorldWithElement(property, 0, is_pair && elements.size() == 1 ? "0" : "-3");
    const LoadOutcome outcome = TryToLoad(text);
    EXPECT_TRUE(outcome.loaded) << text;
    const std::string entity = property.entity;
    const bool is_no_body = entity == "window" || entity == "sensor";
    if (kWarnedOf.count(property.name) > 0 && !is_no_body)
      ExpectOneLine(outcome, text);
    else
      EXPECT_EQ(outcome.errors, "") << text;
  });
}

// ---- swapped limits and other contradictions ----------------------------------------------------

struct Contradiction {
  const char* text;
  bool loads;           ///< true: it loads with a warning
  const char* message;  ///< expected part of the message
};

const Contradiction kContradictions[] = {
    {"position( velocity_bounds [1 -1 -1 1 -1 1 -90 90] )", false, "velocity_bounds"},
    {"position( velocity_bounds [-1 1 1 -1 -1 1 -90 90] )", false, "velocity_bounds"},
    {"position( velocity_bounds [-1 1 -1 1 1 -1 -90 90] )", false, "velocity_bounds"},
    {"position( velocity_bounds [-1 1 -1 1 -1 1 90 -90] )", false, "velocity_bounds"},
    {"position( acceleration_bounds [-1 1 -1 1 -1 1 90 -90] )", false, "acceleration_bounds"},
    {"ranger( sensor( range [2 1] ) )", false, "range"},
    {"camera( range [2 1] )", false, "clipping planes"},
    {"fiducial( range_min 3 range_max 2 )", false, "range_min above range_max"},
    {"fiducial( range_max 2 range_min 3 )", false, "range_min above range_max"},
    {"fiducial( range_min 9 )", false, "range_min above range_max"},
    {"actuator( min_position 2 max_position 1 )", false, "above max_position"},
    {"actuator( start_position 5 )", true, "outside the actuator's range"},
    {"model( block( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [1 0] ) )", false,
     "\"z\""},
    {"model( block( points 100000 ) )", true, "found 0 of 100000 points"},
    {"model( block( points 3 point[0] [0 0] point[1] [1 0] ) )", true, "found 2 of 3 points"},
    {"model( name \"a\" ) model( name \"a\" )", true, "the name of an earlier model"},
    {"model( name \"a\" model( name \"b\" ) model( name \"/a\" ) )", true,
     "the name of an earlier"},
    {"window( position( ) )", true, "inside a window"},
    {"model( trail_interval 0 )", true, "using 1"},
    {"show_clock_interval 0", true, "using 1"},
};

TEST(Nonsense, ContradictionsGiveOneMessage) {
  for (const Contradiction& wrong : kContradictions) {
    const LoadOutcome outcome = TryToLoad(wrong.text);
    EXPECT_EQ(outcome.loaded, wrong.loads) << wrong.text << '\n' << outcome.errors;
    ExpectOneLine(outcome, wrong.text);
    EXPECT_EQ(outcome.errors.find(": warning: ") != std::string::npos, wrong.loads) << wrong.text;
    EXPECT_NE(outcome.errors.find(wrong.message), std::string::npos) << outcome.errors;
  }
}

TEST(Nonsense, UnambiguousNamesAreAccepted) {
  for (const char* text : {"model( name \"a\" model( name \"a\" ) )",
                           "model( name \"a\" ) model( )", "model( name \"model:2\" )"})
    EXPECT_EQ(TryToLoad(text).errors, "") << text;
}

TEST(Nonsense, APictureWithoutADarkPixelAddsNoBody) {
  const std::string path = testing::TempDir() + "white.pgm";
  std::ofstream(path) << "P2 2 2 255\n255 255 255 255\n";
  const std::string text = "model( bitmap \"" + path + "\" )";
  const LoadOutcome outcome = TryToLoad(text);
  EXPECT_TRUE(outcome.loaded);
  ExpectOneLine(outcome, text);
  EXPECT_NE(outcome.errors.find("without a dark pixel"), std::string::npos) << outcome.errors;
}

// ---- invalid calls ------------------------------------------------------------------------------

TEST(Nonsense, SettersRefuseNegativeNumbers) {
  const auto world = LoadText("model( name \"m\" mass 2 model( name \"child\" mass 3 ) )");
  Model* model = Find(*world, "m");
  for (const double bad : {-1.0, -1e-300}) {
    const std::string errors = ErrorsOf([&] { model->SetMass(bad); });
    EXPECT_NE(errors.find("refused the mass"), std::string::npos) << errors;
    EXPECT_NE(ErrorsOf([&] { model->SetWatts(bad); }).find("refused the watts"), std::string::npos);
  }
  EXPECT_EQ(model->GetTotalMass(), 5);
}

}  // namespace
}  // namespace Stg
