// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shipped worlds, includes and pictures are found by name from any folder, after those beside the
// world file and in STAGEPATH. Includes with the names of older Stages define working robots.

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "models/host.hh"
#include "support/model_testing.hh"
#include "worldfile/find_file.hh"

namespace Stg {
namespace {

namespace fs = std::filesystem;

class ShippedFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "stage-shipped-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    before_ = fs::current_path();
    folder_ = name;
    fs::current_path(folder_);
    unsetenv("STAGEPATH");
  }
  void TearDown() override {
    unsetenv("STAGEPATH");
    fs::current_path(before_);
    fs::remove_all(folder_);
  }
  static void Write(const std::string& name, const std::string& text) {
    if (fs::path(name).has_parent_path()) fs::create_directories(fs::path(name).parent_path());
    std::ofstream(name) << text;
  }
  /// The error message of loading a world; empty if it is loaded.
  static std::string Complaint(const std::string& name) {
    World world;
    testing::internal::CaptureStderr();
    const bool loaded = world.Load(name);
    const std::string said = testing::internal::GetCapturedStderr();
    return loaded ? "" : said;
  }
  static std::string Found(const std::string& name) { return worldfile::FindFile("", name); }

  fs::path folder_, before_;
};

TEST_F(ShippedFiles, AreFoundByName) {
  for (const char* name : {"simple.world",
                           "worlds/simple.world",
                           "cave.world",
                           "robots.inc",
                           "sensors.inc",
                           "maps.inc",
                           "pioneer.inc",
                           "sick.inc",
                           "map.inc",
                           "../pioneer.inc",
                           "../../map.inc",
                           "irobot.inc",
                           "hokuyo.inc",
                           "chatterbox.inc",
                           "beacons.inc",
                           "pantilt.inc",
                           "ubot.inc",
                           "walle.inc",
                           "usc-devices.inc",
                           "objects.inc",
                           "bitmaps/cave.png",
                           "rooms.png",
                           "../bitmaps/rooms.png",
                           "worlds/bitmaps/hospital.png",
                           "robots/epuck.inc",
                           "worlds/robots/epuck.world",
                           "../robots/lidars.inc"}) {
    const std::string found = Found(name);
    ASSERT_NE(found, "") << name;
    EXPECT_TRUE(fs::is_regular_file(found)) << found;
    EXPECT_EQ(fs::path(found).filename(), fs::path(name).filename());
  }
}

TEST_F(ShippedFiles, AreNotFoundUnderOtherNames) {
  for (const char* name :
       {"", ".", "..", "bitmaps", "../bitmaps", "bitmaps/", "simple", "x/simple.world",
        "/simple.world", "~/simple.world", "bitmaps/simple.world", "worlds/../worlds/simple.world",
        "./simple.world/", "bitmaps/../simple.world", "epuck.inc", "robots", "robots/",
        "robots/simple.world", "robots/bitmaps/rooms.png"})
    EXPECT_EQ(Found(name), "") << name;
}

TEST_F(ShippedFiles, UserFilesTakePrecedence) {
  const std::string shipped = Found("robots.inc");
  Write("path/robots.inc", "");
  setenv("STAGEPATH", "path", 1);
  EXPECT_EQ(Found("robots.inc"), "path/robots.inc");
  Write("robots.inc", "");
  EXPECT_EQ(Found("robots.inc"), "robots.inc");
  fs::remove("robots.inc");
  unsetenv("STAGEPATH");
  EXPECT_EQ(Found("robots.inc"), shipped);
}

TEST_F(ShippedFiles, AreFoundFromOtherFolders) {
  Write("w.world",
        "include \"sensors.inc\"\ninclude \"robots.inc\"\ninclude \"maps.inc\"\n"
        "floorplan( name \"a\" bitmap \"rooms.png\" size [16 16 0.8] )\n"
        "floorplan( name \"b\" pose [20 0 0 0] bitmap \"bitmaps/rooms.png\" size [16 16 0.8] )\n"
        "explorer( name \"r\" )\n");
  World world;
  ASSERT_TRUE(world.Load((folder_ / "w.world").string()));
  EXPECT_EQ(world.host().outlines_of_pictures.size(), 1u);  // two names, one picture
  EXPECT_NE(world.GetModel("r"), nullptr);
}

TEST_F(ShippedFiles, MissingOnesAreSuggested) {
  Write("own.world", "");
  Write("sub/own.world", "");
  struct {
    const char *name, *advice;
  } const cases[] = {
      {"cave", "; did you mean \"cave.world\", which comes with Stage?\n"},
      {"worlds/cave", "; did you mean \"worlds/cave.world\", which comes with Stage?\n"},
      {"cvae.world", "; did you mean \"cave.world\", which comes with Stage?\n"},
      {"own", "; did you mean \"own.world\"?\n"},
      {"sub/own", "; did you mean \"sub/own.world\"?\n"},
      {"nothing.like.it", "No such file or directory\n"},
      {"sub/cave.world", "No such file or directory\n"},
  };
  for (const auto& [name, advice] : cases)
    EXPECT_TRUE(Complaint(name).ends_with(advice)) << Complaint(name);
  Write("i.world", "include \"robotz.inc\"\n");
  EXPECT_TRUE(
      Complaint("i.world").ends_with("; did you mean \"robots.inc\", which comes with Stage?\n"))
      << Complaint("i.world");
}

// ---- includes under the names of older Stages
// ----------------------------------------------------

const char kOldIncludes[] = "include \"pioneer.inc\"\ninclude \"sick.inc\"\ninclude \"map.inc\"\n";

struct Robot {
  const char* type;
  size_t sonars;
  double length, width, height;
};
void PrintTo(const Robot& robot, std::ostream* out) { *out << robot.type; }

class OldRobots : public ShippedFiles, public testing::WithParamInterface<Robot> {};

TEST_P(OldRobots, HaveTheirSizeAndSensors) {
  const Robot& robot = GetParam();
  Write("w.world",
        std::string(kOldIncludes) + robot.type + "( name \"r\" sicklaser( pose [0.04 0 0 0] ) )\n");
  testing::internal::CaptureStderr();
  World world;
  ASSERT_TRUE(world.Load("w.world"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  Model* const model = world.GetModel("r");
  ASSERT_NE(dynamic_cast<ModelPosition*>(model), nullptr);
  const Size size = model->GetGeom().size;
  EXPECT_DOUBLE_EQ(size.x, robot.length);
  EXPECT_DOUBLE_EQ(size.y, robot.width);
  EXPECT_DOUBLE_EQ(size.z, robot.height);
  const std::string laser = robot.sonars > 0 ? "ranger:1" : "ranger:0";
  if (robot.sonars > 0) {
    const auto* sonar = dynamic_cast<ModelRanger*>(model->GetChild("ranger:0"));
    ASSERT_NE(sonar, nullptr);
    EXPECT_EQ(sonar->GetSensors().size(), robot.sonars);
  }
  const auto* sick = dynamic_cast<ModelRanger*>(model->GetChild(laser));
  ASSERT_NE(sick, nullptr);
  EXPECT_EQ(sick->GetSensors()[0].sample_count, 180u);
}

// Forward sonars and the laser measure the right distance to a wall, and see another robot of the
// same type, so that none looks over the other.
TEST_P(OldRobots, SeeWallsAndEachOther) {
  const Robot& robot = GetParam();
  for (const bool wall : {true, false}) {
    const std::string other = wall ? "floorplan( pose [2 0 0 0] size [0.2 4 1.5] )\n"
                                   : std::string(robot.type) + "( pose [2 0 0 0] sicklaser() )\n";
    Write("w.world", std::string(kOldIncludes) + "resolution 0.01\n" + robot.type +
                         "( name \"r\" sicklaser( pose [0.04 0 0 0] ) )\n" + other);
    World world;
    ASSERT_TRUE(world.Load("w.world"));
    Model* const model = world.GetModel("r");
    model->GetChild("ranger:0")->Subscribe();
    if (robot.sonars > 0) model->GetChild("ranger:1")->Subscribe();
    for (int i = 0; i < 3; i++) world.Update();
    const auto* last =
        dynamic_cast<ModelRanger*>(model->GetChild(robot.sonars > 0 ? "ranger:1" : "ranger:0"));
    const double ahead = last->GetSensors()[0].ranges[90];
    EXPECT_GT(ahead, 1.4) << "wall: " << wall;
    EXPECT_LT(ahead, 2.0) << "wall: " << wall;
    if (robot.sonars == 0) continue;
    const auto* sonar = dynamic_cast<ModelRanger*>(model->GetChild("ranger:0"));
    const size_t middle = robot.sonars == 8 && std::string(robot.type) == "amigobot" ? 2 : 3;
    for (const size_t i : {middle, middle + 1}) {
      EXPECT_GT(sonar->GetSensors()[i].ranges[0], 1.3) << "wall: " << wall;
      EXPECT_LT(sonar->GetSensors()[i].ranges[0], wall ? 2.1 : 5.1) << "wall: " << wall;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, OldRobots,
                         testing::Values(Robot{"pioneer_base", 0, 0.4, 0.4, 1},
                                         Robot{"pioneer2dx_base_no_sonar", 0, 0.44, 0.38, 0.22},
                                         Robot{"pioneer2dx_base", 16, 0.44, 0.38, 0.22},
                                         Robot{"pioneer2dx_base_front_sonar", 8, 0.44, 0.38, 0.22},
                                         Robot{"pioneer2dx", 16, 0.44, 0.38, 0.22},
                                         Robot{"pioneer2dx_front_sonar", 8, 0.44, 0.38, 0.22},
                                         Robot{"fancypioneer2dx", 16, 0.44, 0.38, 0.22},
                                         Robot{"pioneer3dx", 16, 0.455, 0.381, 0.237},
                                         Robot{"pioneer3at", 16, 0.508, 0.497, 0.277},
                                         Robot{"amigobot", 8, 0.33, 0.28, 0.15}),
                         [](const auto& robot) { return std::string(robot.param.type); });

/// The readings of the first sensor of a ranger after three steps.
std::vector<double> Scan(World* world, Model* ranger) {
  ranger->Subscribe();
  for (int i = 0; i < 3; i++) world->Update();
  return dynamic_cast<ModelRanger*>(ranger)->GetSensors()[0].ranges;
}

TEST_F(ShippedFiles, RoombasBumpIntoWallsWithTheirFront) {
  Write("w.world",
        "include \"irobot.inc\"\nresolution 0.01\ncreate( name \"r\" alwayson 1 "
        ")\nmodel( pose [1 0 0 0] size [0.2 4 1] )\n");
  World world;
  ASSERT_TRUE(world.Load("w.world"));
  Model* const robot = world.GetModel("r");
  dynamic_cast<ModelPosition*>(robot)->SetSpeed(0.4, 0, 0);
  auto* const bumper = dynamic_cast<ModelBumper*>(robot->GetChild("bumper:0"));
  ASSERT_NE(bumper, nullptr);
  ASSERT_EQ(bumper->bumper_count, 2u);
  bumper->Subscribe();
  for (int i = 0; i < 40; i++) world.Update();
  EXPECT_NEAR(robot->GetPose().x, 0.9 - 0.17, 0.02);
  for (const ModelBumper::BumperSample* sample = bumper->samples; sample < bumper->samples + 2;
       sample++)
    EXPECT_NE(sample->hit, nullptr);
}

TEST_F(ShippedFiles, ChatterboxesSeeWallsAndEachOther) {
  Write("w.world",
        "include \"chatterbox.inc\"\nresolution 0.01\nlaserchatterbox( name \"a\" )\n"
        "laserchatterbox( name \"b\" pose [1 0 0 180] )\nmodel( pose [0 1 0 0] size [4 0.2 1] )\n");
  World world;
  testing::internal::CaptureStderr();
  ASSERT_TRUE(world.Load("w.world"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  Model* const robot = world.GetModel("a");
  const std::vector<double> laser = Scan(&world, robot->GetChild("ranger:1"));
  ASSERT_EQ(laser.size(), 683u);
  EXPECT_NEAR(laser[341], 1 - 0.1 - 0.1 - 0.025, 0.02) << "the laser of the other";
  robot->GetChild("ranger:0")->Subscribe();
  world.Update();
  const auto* infrared = dynamic_cast<ModelRanger*>(robot->GetChild("ranger:0"));
  ASSERT_EQ(infrared->GetSensors().size(), 8u);
  EXPECT_NEAR(infrared->GetSensors()[0].ranges[0], 1 - 0.17 - 0.15, 0.02) << "the other";
  EXPECT_NEAR(infrared->GetSensors()[2].ranges[0], 0.9 - 0.15, 0.02) << "the wall";
  EXPECT_NEAR(infrared->GetSensors()[4].ranges[0], 1.5, 0.02) << "nothing";
}

TEST_F(ShippedFiles, ChargersChargeAndMarksAreFound) {
  Write("w.world",
        "include \"chatterbox.inc\"\ninclude \"objects.inc\"\ncharger( pose [0.2 0 0 0] )\n"
        "chatterbox( name \"r\" alwayson 1 joules 100 joules_capacity 2000 fiducial_return 1 )\n"
        "laserbeacon( name \"m\" pose [1 0 0 0] fiducial_return 7 )\nred_puck( name \"p\" )\n"
        "visionbeacon_cyan( name \"v\" pose [0 1 0 0] )\n");
  World world;
  ASSERT_TRUE(world.Load("w.world"));
  Model* const robot = world.GetModel("r");
  auto* const finder = dynamic_cast<ModelFiducial*>(robot->GetChild("fiducial:0"));
  ASSERT_NE(finder, nullptr);
  finder->Subscribe();
  for (int i = 0; i < 5; i++) world.Update();
  EXPECT_GT(robot->FindPowerPack()->GetStored(), 110);
  std::set<int> ids;
  for (const ModelFiducial::Fiducial& found : finder->GetFiducials()) ids.insert(found.id);
  EXPECT_TRUE(ids.contains(7));
  EXPECT_TRUE(world.GetModel("p")->vis.gripper_return);
  EXPECT_EQ(world.GetModel("v")->GetColor().g, 1);
}

TEST_F(ShippedFiles, OldLasersAndZones) {
  Write("w.world", std::string(kOldIncludes) +
                       "resolution 0.01\nposition( size [0.4 0.4 0.2] name \"r\" fancysicklaser( "
                       "alwayson 1 ) )\n"
                       "zone( pose [1 0 0 0] )\nmodel( pose [2 0 0 0] size [0.2 2 0.5] )\n");
  World world;
  ASSERT_TRUE(world.Load("w.world"));
  for (int i = 0; i < 3; i++) world.Update();
  const auto* sick = dynamic_cast<ModelRanger*>(world.GetModel("r")->GetChild("ranger:0"));
  ASSERT_NE(sick, nullptr);
  EXPECT_NEAR(sick->GetSensors()[0].ranges[90], 1.9, 0.02);  // the zone is transparent
}

/// A robot that faces a wall, as lines of a world file.
std::string Facing(const std::string& robot) {
  return robot + "( name \"r\" )\nmodel( pose [1 0 0 0] size [0.2 2 1] )\n";
}

TEST_F(ShippedFiles, UbotsSeeWithInfrared) {
  Write("w.world", "include \"ubot.inc\"\nresolution 0.01\n" + Facing("ubot") +
                       "model( pose [0 0.5 0 0] size [0.2 0.2 1] )\n");
  ASSERT_EQ(Complaint("w.world"), "");
  World world;
  ASSERT_TRUE(world.Load("w.world"));
  Scan(&world, world.GetModel("r")->GetChild("ranger:0"));
  const auto* ir = dynamic_cast<ModelRanger*>(world.GetModel("r")->GetChild("ranger:0"));
  ASSERT_EQ(ir->GetSensors().size(), 8u);
  EXPECT_NEAR(ir->GetSensors()[0].ranges[0], 0.8, 0.02) << "the wall is too far away";
  EXPECT_NEAR(ir->GetSensors()[2].ranges[0], 0.4 - 0.09, 0.02) << "the box on the left";
}

// A laser at the height of the eyes sees them, and one at the height of the tracks sees both
// tracks.
TEST_F(ShippedFiles, WalleHasTracksABodyAndEyes) {
  struct {
    double height, y, range;
  } const kRays[] = {{0.70, 0.08, 0.89}, {0.70, 0.25, 1.3}, {0.56, 0, 0.97}, {0.56, 0.08, 1.3},
                     {0.30, 0, 0.8},     {0.20, 0.25, 0.7}, {0.05, 0, 1.3}};
  for (const auto& ray : kRays) {
    Write("w.world", "include \"walle.inc\"\nresolution 0.01\nwalle( name \"w\" )\n" +
                         ("model( obstacle_return 0 ranger_return -1 size [0.1 0.1 0.01] pose [1 " +
                          std::to_string(-ray.y)) +
                         " " + std::to_string(ray.height) +
                         " 180] name \"eye\" ranger( size [0 0 0] "
                         "sensor( range [0 1.3] fov 0 samples 1 ) ) )\n");
    ASSERT_EQ(Complaint("w.world"), "");
    World world;
    ASSERT_TRUE(world.Load("w.world"));
    const std::vector<double> seen = Scan(&world, world.GetModel("eye")->GetChild("ranger:0"));
    EXPECT_NEAR(seen.at(0), ray.range, 0.025) << ray.height << " " << ray.y;
  }
}

TEST_F(ShippedFiles, CamerasPanAndTilt) {
  for (const char* type : {"pantiltcamera", "fancypantiltcamer"}) {
    Write("w.world",
          std::string("include \"pantilt.inc\"\nposition( name \"r\" size [0.4 0.4 0.3] ") + type +
              "( pantilt [30 10] ) )\n");
    ASSERT_EQ(Complaint("w.world"), "") << type;
    World world;
    ASSERT_TRUE(world.Load("w.world"));
    auto* const camera = dynamic_cast<ModelCamera*>(world.GetModel("r")->GetChild("camera:0"));
    ASSERT_NE(camera, nullptr);
    EXPECT_EQ(camera->getPan(), 30);
    EXPECT_EQ(camera->getTilt(), 10);
    EXPECT_EQ(camera->getWidth(), 320);
    EXPECT_EQ(camera->getHeight(), 240);
  }
}

TEST_F(ShippedFiles, RobotsOfUscHaveALaserAndSonar) {
  Write("w.world", "include \"pioneer.inc\"\ninclude \"usc-devices.inc\"\n" + Facing("robot_usc"));
  ASSERT_EQ(Complaint("w.world"), "");
  World world;
  ASSERT_TRUE(world.Load("w.world"));
  Model* const robot = world.GetModel("r");
  const std::vector<double> laser = Scan(&world, robot->GetChild("ranger:1"));
  ASSERT_EQ(laser.size(), 180u);
  EXPECT_NEAR(laser[90], 0.9 - 0.04, 0.05);
  EXPECT_EQ(dynamic_cast<ModelRanger*>(robot->GetChild("ranger:0"))->GetSensors().size(), 16u);
}

// All macros of older Stages are defined.
TEST_F(ShippedFiles, OldMacrosAreThere) {
  for (const char* macro :
       {"p2dx_sonar", "p2dx_sonar_front", "p3dx_sonar", "p3at_sonar", "amigo_sonar", "sickcommon",
        "sickbase", "fancysickbase", "sicklaser", "fancysicklaser", "floorplan", "zone"}) {
    Write("w.world", std::string(kOldIncludes) + macro + "( name \"m\" )\n");
    EXPECT_EQ(Complaint("w.world"), "") << macro;
  }
  for (const char* sensor : {"p2dxsonar", "p3dxsonar", "sicksensor"}) {
    Write("w.world", std::string(kOldIncludes) + "ranger( " + sensor + "() )\n");
    EXPECT_EQ(Complaint("w.world"), "") << sensor;
  }
}

}  // namespace
}  // namespace Stg
