// SPDX-License-Identifier: GPL-2.0-or-later
//
// Mistakes in world files that still load get one warning each, with the place in the file.

#include <cctype>
#include <set>
#include <sstream>

#include "support/model_testing.hh"
#include "support/property_table.hh"

namespace Stg {
namespace {

using properties::Property;
using properties::WorldWith;

size_t CountLines(const std::string& text) {
  return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// The lines that loading a text prints. It expects that all are warnings.
std::string WarningsOf(const std::string& text) {
  const LoadOutcome outcome = TryToLoad(text);
  EXPECT_TRUE(outcome.loaded) << text << outcome.errors;
  std::istringstream lines(outcome.errors);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_NE(line.find(": warning: "), std::string::npos) << line;
  }
  return outcome.errors;
}

void ExpectOneLine(const std::string& text, const std::string& line) {
  const std::string warnings = WarningsOf(text);
  EXPECT_EQ(CountLines(warnings), 1u) << text << '\n' << warnings;
  EXPECT_NE(warnings.find(line), std::string::npos) << warnings << "\nshould have: " << line;
}

// ---- tuples that are too long -------------------------------------------------------------------

/// True for properties with an arbitrary number of values.
bool IsList(const Property& property) {
  const std::string name = property.name, entity = property.entity;
  return name == "ctrl" || name == "plugins" || name == "colors" || name == "odom" ||
         name == "response" || name == "directions" || entity == "window";
}

std::string WithOneMore(const Property& property) {
  const std::string value = property.value;
  const std::string last = properties::ElementsOf(value).back();
  if (value.front() == '[') return value.substr(0, value.size() - 1) + " " + last + "]";
  return "[" + value + " " + last + "]";
}

class LongTuples : public testing::TestWithParam<Property> {};

TEST_P(LongTuples, AreWarnedOf) {
  Property property = GetParam();
  if (IsList(property)) return;
  const size_t count = properties::ElementsOf(property.value).size();
  const std::string longer = WithOneMore(property);
  property.value = longer.c_str();
  const std::string warnings = WarningsOf(WorldWith(property, property.name));
  EXPECT_NE(warnings.find("property \"" + std::string(property.name) + "\": found " +
                          std::to_string(count + 1) + " values, expected " + std::to_string(count) +
                          "; the rest is not read"),
            std::string::npos)
      << WorldWith(property, property.name) << warnings;
}

std::string NameOf(const testing::TestParamInfo<Property>& info) {
  std::string name = std::to_string(info.index) + "_" + info.param.entity + "_" + info.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(World, LongTuples, testing::ValuesIn(properties::kWorld), NameOf);
INSTANTIATE_TEST_SUITE_P(EveryModel, LongTuples, testing::ValuesIn(properties::kEveryModel),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(Types, LongTuples, testing::ValuesIn(properties::kTypes), NameOf);

TEST(LongTuple, ReportsTheFirstUnusedValue) {
  EXPECT_EQ(WarningsOf("model( pose [1 2 0 30 7 8] )"),
            "t.world:1:23: warning: property \"pose\": found 6 values, expected 4; the rest is not "
            "read\n");
}

TEST(OdomError, SixValuesAreReportedAsACovariance) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(
      world.get(), "position( odom_error [0.03 0.04 999999 999999 999999 2] unit_angle 1 )");
  const Velocity error = Find<ModelPosition>(*world, "position:0")->GetOdomError();
  EXPECT_EQ(error.x, 0.03);
  EXPECT_EQ(error.y, 0.04);
  EXPECT_NEAR(error.a, 2 * M_PI / 180, 1e-12);
  EXPECT_NE(outcome.errors.find("t.world:1:23: warning: property \"odom_error\": found 6 values, "
                                "expected 4, [x y z turn]; the sixth is used for the turn"),
            std::string::npos)
      << outcome.errors;
}

TEST(OdomError, WarnsOfErrorsAboveTheMotion) {
  ExpectOneLine("position( odom_error [0 0 0 100] )", "found an error larger than the motion");
  ExpectOneLine("position( odom_error [-1.5 0 0 0] )", "found an error larger than the motion");
  EXPECT_EQ(WarningsOf("position( odom_error [1 1 9 57] )"), "");
}

// ---- properties of older Stages -----------------------------------------------------------------

struct Old {
  const char* section;  ///< the section, in which "%" stands for the property
  const char* property;
  const char* advice;
};

constexpr char kWorldSection[] = "%", kModel[] = "model( % )", kRanger[] = "ranger( % )",
               kSensor[] = "ranger( sensor( % ) )", kPosition[] = "position( % )",
               kWindow[] = "window( % )", kBlobs[] = "blobfinder( % )", kCamera[] = "camera( % )";

const Old kOld[] = {
    {kWorldSection, "interval_real 100", "use speedup"},
    {kWorldSection, "gui_interval 100", "use interval in the section window"},
    {kWorldSection, "gui_disable 1", "run with --gui"},
    {kWorldSection, "threadpool 4", "use threads"},
    {kWorldSection, "size [10 10]", "the world is as large as what is in it"},
    {kRanger, "range_max 8", "use range [LEAST MOST] in a section sensor"},
    {kSensor, "range_max 8", "use range [LEAST MOST]"},
    {kSensor, "range_min 0", "use range [LEAST MOST]"},
    {kRanger, "samples 180", "give it to a section sensor"},
    {kRanger, "fov 180", "give it to a section sensor"},
    {kRanger, "scount 16", "use sections sensor("},
    {kRanger, "spose[3] [0 0 0]", "use sections sensor("},
    {kRanger, "ssize [0.01 0.05]", "use size in sections sensor"},
    {kRanger, "sview [0 5 15]", "use range [LEAST MOST] and fov in sections sensor"},
    {kSensor, "view [0 5 15]", "use range [LEAST MOST] and fov"},
    {kModel, "laser_return 1", "use ranger_return"},
    {kPosition, "laser_return 1", "use ranger_return"},
    {kModel, "sonar_return 1", "use ranger_return"},
    {kModel, "blobfinder_return 1", "use blob_return"},
    {kModel, "polygons 1", "use sections block("},
    {kModel, "polygon[0].points 4", "use sections block("},
    {kModel, "polygon[2].point[3] [0 0]", "use sections block("},
    {kPosition, "blocks 1", "use sections block("},
    {kPosition, "block[0].z [0 1]", "use sections block("},
    {kModel, "size3 [1 1 1]", "use size [X Y Z]"},
    {kPosition, "offset [0 0 0]", "use origin [X Y Z HEADING]"},
    {kModel, "gui_boundary 1", "use gui_outline"},
    {kModel, "gui_movemask 0", "use gui_move 0 or 1"},
    {kWindow, "rangerdata 1", "use show_data"},
    {kWindow, "fill_polygons 1", "bodies are always drawn filled"},
    {kBlobs, "channels [\"red\"]", "use colors"},
    {kBlobs, "channel_count 1", "use colors_count"},
    {kBlobs, "range_max 8", "use range"},
    {kCamera, "width 64", "use resolution [WIDTH HEIGHT]"},
    {kCamera, "vertfov 60", "use fov [HORIZONTAL VERTICAL]"},
    {kCamera, "yaw 60", "use pantilt [PAN TILT]"},
};

TEST(OldProperties, SuggestTheirReplacement) {
  for (const Old& old : kOld) {
    std::string text = old.section;
    text.replace(text.find('%'), 1, old.property);
    const std::string name =
        std::string(old.property).substr(0, std::string(old.property).find(' '));
    ExpectOneLine(text,
                  "property \"" + name + "\" is never read; older Stages had it: " + old.advice);
  }
}

TEST(OldProperties, GetOneLineForAllIndices) {
  std::string sonars = "ranger( scount 16";
  for (int i = 0; i < 16; i++) sonars += " spose[" + std::to_string(i) + "] [0 0 0]";
  const std::string warnings = WarningsOf(sonars + " )");
  EXPECT_EQ(CountLines(warnings), 2u) << warnings;
  EXPECT_NE(warnings.find("\"spose[0]\" is never read (nor 15 more like it)"), std::string::npos)
      << warnings;
  std::string polygon = "model( ";
  for (int i = 0; i < 3; i++) {
    const std::string name = "polygon[" + std::to_string(i) + "].";
    polygon += name + "points 2 " + name + "point[0] [0 0] " + name + "point[1] [1 1] ";
  }
  ExpectOneLine(polygon + ")", "\"polygon[0].points\" is never read (nor 8 more like it)");
  ExpectOneLine("model( laser_return 1 ) model( laser_return 0 )", "(nor 1 more like it)");
}

/// A name that is obsolete in one section may be valid in another.
TEST(OldProperties, AreCurrentElsewhere) {
  EXPECT_EQ(WarningsOf("fiducial( range_max 8 range_min 0 ) camera( resolution [8 8] )"), "");
}

TEST(OldTypes, SuggestTheirReplacement) {
  const std::pair<const char*, const char*> kTypes[] = {
      {"laser", "older Stages had it: use a ranger with a section sensor"},
      {"ptz", "older Stages had it: use a camera"},
      {"map", "older Stages had it: use model with a bitmap"},
      {"puck", "older Stages had it: use model with gripper_return 1"},
      {"world", "properties of the world stand outside of all sections"},
      {"driver", "this looks like a Player configuration"}};
  for (const auto& [type, advice] : kTypes) {
    const LoadOutcome outcome = TryToLoad(std::string(type) + "( )");
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.errors.rfind("t.world:1:1: found \"" + std::string(type) + "\"", 0), 0u)
        << outcome.errors;
    EXPECT_NE(outcome.errors.find(advice), std::string::npos) << outcome.errors;
    EXPECT_EQ(CountLines(outcome.errors), 1u);
  }
}

TEST(OldIncludes, SuggestShippedIncludes) {
  const std::pair<const char*, const char*> kFiles[] = {{"old/roomba.inc", "irobot.inc"},
                                                        {"rplidar.inc", "round_scanner"},
                                                        {"../create.inc", "irobot.inc"}};
  for (const auto& [file, hint] : kFiles) {
    const auto world = EmptyWorld();
    const LoadOutcome outcome =
        TryToLoad(world.get(), "include \"" + std::string(file) + "\"\n", "/nonexistent/t.world");
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.errors.find("; among the files installed with Stage, "), std::string::npos)
        << outcome.errors;
    EXPECT_NE(outcome.errors.find(hint), std::string::npos) << outcome.errors;
  }
  EXPECT_EQ(TryToLoad("include \"mine.inc\"\n").errors.find("installed with Stage"),
            std::string::npos);
}

// ---- files of other formats ---------------------------------------------------------------------

TEST(ForeignFiles, AreNamed) {
  const std::pair<const char*, const char*> kFiles[] = {
      {"<?xml version=\"1.0\"?>\n<sdf version=\"1.4\"><world/></sdf>", "a Gazebo world (XML)"},
      {"  <gazebo:world>", "a Gazebo world (XML)"},
      {"<robot name=\"r\">", "a robot description (URDF)"},
      {"<launch>", "a ROS launch file (XML)"},
      {"<html>", "XML or HTML"},
      {"{\"a\": 1}", "JSON"},
      {"#VRML_SIM R2023b utf8\nWorldInfo {\n}", "a Webots world (VRML)"},
      {"image: map.pgm\nresolution: 0.05\n", "a map of ROS's map_server (YAML)"},
      {"driver( name \"stage\" provides [\"simulation:0\"] worldfile \"a.world\" }",
       "a Player configuration"}};
  for (const auto& [text, kind] : kFiles) {
    const LoadOutcome outcome = TryToLoad(text);
    EXPECT_EQ(outcome.status, 1) << text;
    EXPECT_NE(outcome.errors.find(std::string("; this looks like ") + kind), std::string::npos)
        << outcome.errors;
    EXPECT_EQ(CountLines(outcome.errors), 1u) << outcome.errors;
  }
  EXPECT_EQ(TryToLoad("model( size [1 2 }").errors.find("looks like"), std::string::npos);
}

// ---- colours ------------------------------------------------------------------------------------

TEST(Colours, MisspeltNamesGetASuggestion) {
  ExpectOneLine("model( color \"bleu\" )",
                "found \"bleu\", expected an X11 color name, such as "
                "\"red\" or \"#ff0000\"; using red; did you mean "
                "\"blue\"?");
  ExpectOneLine("model( color \"#12345\" )", "found \"#12345\"");
  EXPECT_EQ(WarningsOf("model( color \"Blue\" ) model( color \"dodgerblue\" pose [1 0 0 0] ) "
                       "model( color \"#ff0000\" pose [2 0 0 0] )"),
            "");
}

// ---- starts, sizes, bounds ----------------------------------------------------------------------

constexpr char kWall[] = "model( name \"wall\" pose [0 0 0 0] size [2 2 1] )\n";

TEST(Starts, InsideObstaclesCauseWarnings) {
  // Start on the outline, in the interior without occupied cells, and in the floor.
  ExpectOneLine(std::string(kWall) + "position( name \"r\" pose [1 0 0 0] )",
                "t.world:2:26: warning: found robot \"r\" where \"wall\" is, expected free space");
  ExpectOneLine(std::string(kWall) + "position( name \"r\" pose [0 0.2 0 0] size [0.4 0.4 0.4] )",
                "found robot \"r\" where \"wall\" is");
  ExpectOneLine("position( name \"r\" pose [0 0 -0.5 0] )", "found robot \"r\" where the floor is");
}

TEST(Starts, InFreeSpaceCauseNoWarnings) {
  EXPECT_EQ(WarningsOf("position( ) position( )"), "") << "programs may move them";
  EXPECT_EQ(WarningsOf(std::string(kWall) + "position( pose [2 0 0 0] )"), "");
  EXPECT_EQ(WarningsOf(std::string(kWall) + "position( pose [0 0 1 0] )"), "") << "on top of it";
  EXPECT_EQ(WarningsOf("model( size [2 2 1] obstacle_return 0 ) position( )"), "");
  EXPECT_EQ(WarningsOf(std::string(kWall) + "position( obstacle_return 0 )"), "");
  const std::string room =
      properties::WithSource("model( bitmap \"SOURCE/worlds/bitmaps/rooms.png\" size [16 16 1] )");
  EXPECT_EQ(WarningsOf(room + "position( pose [0 -6 0 0] )"), "");
}

TEST(Starts, AreNamedUpToTen) {
  std::string text = kWall;
  for (int i = 0; i < 15; i++) text += "position( pose [0 0 0 0] size [0.2 0.2 0.2] )\n";
  const std::string warnings = WarningsOf(text);
  EXPECT_EQ(CountLines(warnings), 11u) << warnings;
  EXPECT_NE(warnings.find("found 5 more robots that start inside other bodies"), std::string::npos);
}

TEST(Sizes, NegativeSizesCauseWarnings) {
  for (const char* size : {"[-1 1 1]", "[1 -1 1]", "[1 1 -1]"})
    ExpectOneLine(std::string("model( size ") + size + " )",
                  "found a negative size, expected 0 or more; it mirrors the body");
}

TEST(Bounds, DegenerateBoundsCauseWarnings) {
  const std::string least = "found the minimum equal to the maximum";
  ExpectOneLine("position( velocity_bounds [1 1 -1 1 -1 1 -1 1] )", least);
  ExpectOneLine("position( velocity_bounds [-1 1 -1 1 -1 1 0 0] )", least);
  ExpectOneLine("position( acceleration_bounds [0 0 -1 1 -1 1 -1 1] )", least);
  ExpectOneLine("ranger( sensor( range [5 5] ) )", least);
  ExpectOneLine("actuator( min_position 1 max_position 1 start_position 1 )", least);
  ExpectOneLine("fiducial( range_min 3 range_max 3 )", least);
  EXPECT_EQ(WarningsOf("position( velocity_bounds [-1 1 0 0 0 0 -90 90] )"), "")
      << "a robot that does not slide sideways";
}

// ---- sensors that can never see a body ----------------------------------------------------------

TEST(FlatBodies, CauseOneWarningPerKind) {
  ExpectOneLine(
      "define flat model( size [1 1 0] )\nflat( ) flat( pose [3 0 0 0] )",
      "t.world:1:26: warning: found a body without height, which rangers see at one height "
      "alone; expected a size whose third number is above 0");
  const std::string block =
      "block( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [1 1] )";
  ExpectOneLine("define flat model( size [1 1 1] " + block + " )\nflat( ) flat( pose [3 0 0 0] )",
                "expected z [BOTTOM TOP] with a top above the bottom");
  EXPECT_EQ(WarningsOf("model( size [1 1 0] ranger_return -1 )"), "");
  EXPECT_EQ(WarningsOf("model( size [1 1 0] noblocks 1 )"), "");
}

std::string TwoRobots(const std::string& ranger, const std::string& body = "size [0.4 0.4 0.3]") {
  return "define r position( " + body + " ranger( " + ranger +
         " sensor( samples 3 ) ) )\nr( pose [2 0 0 0] )\nr( )\n";
}

TEST(Rangers, AboveAllRobotsCauseWarnings) {
  const std::string line =
      "found sensors at a height of 0.31 m, where no other robot has a body, so "
      "that they see none (bodies of robots reach up to 0.3 m)";
  ExpectOneLine(TwoRobots("pose [0 0 0 0]"), "t.world:1:53: warning: " + line);
  EXPECT_EQ(WarningsOf(TwoRobots("pose [0 0 -0.1 0]")), "");
  EXPECT_EQ(WarningsOf(TwoRobots("pose [0 0 0 0] size [0.1 0.1 0.1] block( points 3 point[0] [0 0] "
                                 "point[1] [1 0] point[2] [0 1] z [0 1] )")),
            "")
      << "they see each other's sensors";
  EXPECT_EQ(WarningsOf("position( ranger( pose [0 0 1 0] sensor( ) ) )"), "") << "one robot";
  ExpectOneLine(TwoRobots("pose [0 0 -0.1 0]", "size [0.4 0.4 0.3] ranger_return -1"),
                "where no other robot has a body");
}

}  // namespace
}  // namespace Stg
