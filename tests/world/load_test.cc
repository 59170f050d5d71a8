// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::Load() reports errors of world files in one line: file:line:column, what was found and
// what was expected.

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "models/body.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A folder for the files of one test.
class Folder {
 public:
  Folder() : path_(testing::TempDir() + "stage_load_test_" + std::to_string(getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ + "/" + name) << text;
    return path_ + "/" + name;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// The last line on standard error; all tests here expect exactly one.
std::string TheErrorLine(const LoadOutcome& outcome) {
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
  return outcome.errors.substr(0, outcome.errors.find('\n'));
}

struct BadFile {
  std::string text;
  int status;
  const char* place;                   // line:column in t.world
  std::vector<const char*> fragments;  // expected parts of the message
};

void PrintTo(const BadFile& bad, std::ostream* out) { *out << bad.text.substr(0, 60); }

class Refused : public testing::TestWithParam<BadFile> {};

TEST_P(Refused, ReportsPlaceStatusAndMessage) {
  const BadFile& bad = GetParam();
  const LoadOutcome outcome = TryToLoad(bad.text);
  EXPECT_FALSE(outcome.loaded);
  EXPECT_EQ(outcome.status, bad.status);
  EXPECT_EQ(outcome.models, 1u);  // the ground
  const std::string line = TheErrorLine(outcome);
  EXPECT_EQ(line.rfind("t.world:" + std::string(bad.place) + ": ", 0), 0u) << line;
  for (const char* fragment : bad.fragments)
    EXPECT_NE(line.find(fragment), std::string::npos) << line << "\nlacks " << fragment;
}

const BadFile kBadFiles[] = {
    // Sections in wrong places.
    {"\n unicorn( )", 1, "2:2", {"\"unicorn\"", "expected", "position", "ranger", "block"}},
    {"define u unicorn( )\nu( )", 1, "2:1", {"unicorn"}},
    {"model( unicorn( ) )", 1, "1:8", {"unicorn"}},
    {"block( points 0 )", 1, "1:1", {"block outside of any model"}},
    {"window( block( points 0 ) )", 1, "1:9", {"block outside of any model"}},
    {"sensor( )", 1, "1:1", {"sensor outside of any ranger"}},
    {"model( sensor( ) )", 1, "1:8", {"sensor outside of any ranger"}},
    {"ranger( model( sensor( ) ) )", 1, "1:16", {"sensor outside of any ranger"}},
    {"model( block( points 0 model( ) ) )", 1, "1:24", {"\"model\" inside a block"}},
    {"model( block( points 0 block( ) ) )", 1, "1:24", {"\"block\" inside a block"}},
    {"ranger( sensor( position( ) ) )", 1, "1:17", {"\"position\" inside a sensor"}},
    {"ranger( sensor( unicorn( ) ) )", 1, "1:17", {"inside a sensor"}},
    // Missing or invalid files.
    {"model( bitmap \"missing.png\" )", 255, "1:15", {"missing.png"}},
    {"model( bitmap \"\" )", 255, "1:15", {"empty"}},
    {"model( bitmap \"/dev/null\" )", 255, "1:15", {"/dev/null"}},
#ifdef STAGE_STATIC
    {"model(\n  ctrl \"no_such_controller\" )",
     255,
     "2:8",
     {"no_such_controller", "expected one of ", "wander", "RegisterController()"}},
    {"plugins \"sonar_ring\"", 255, "1:9", {"sonar_ring", "STAGE_STATIC"}},
#else
    {"model(\n  ctrl \"no_such_controller\" )",
     255,
     "2:8",
     {"no_such_controller", "no_such_controller.so", "STAGEPATH"}},
    {"model( ctrl [\"/no/such/file arg\"] )", 255, "1:14", {"/no/such/file", "No such file"}},
#endif
    {"model( ctrl 5 )", 255, "1:13", {"\"5\""}},
    // Numbers of the world.
    {"interval_sim 0", 1, "1:14", {"not positive"}},
    {"interval_sim -100", 1, "1:14", {"not positive"}},
    {"interval_sim 0.0001", 1, "1:14", {"0.001 to"}},
    {"resolution 0", 1, "1:12", {"not positive"}},
    {"\n\nresolution  -0.02", 1, "3:13", {"not positive"}},
    {"resolution \"nan\"", 1, "1:12", {"nan"}},
    {"quit_time \"inf\"", 1, "1:11", {"inf"}},
    // Numbers of models.
    {"position( wheelbase 0 )", 1, "1:21", {"wheelbase", "not positive"}},
    {"position( wheelbase -1 )", 1, "1:21", {"wheelbase", "not positive"}},
    {"ranger( sensor( samples -1 ) )", 1, "1:25", {"-1 samples"}},
    {"ranger( sensor( samples 1000001 ) )", 1, "1:25", {"1000001 samples", "0 to 1000000"}},
    {"ranger( sensor( range [0 -1] ) )", 1, "1:24", {"negative"}},
    {"ranger( sensor( noise [-1 0 0] ) )", 1, "1:24", {"negative"}},
    {"ranger( sensor( fov \"nan\" ) )", 1, "1:21", {"nan"}},
    {"model( pose [0 0 0 \"inf\"] )", 1, "1:20", {"inf"}},
    {"model( pose [0 \"nan\" 0 0] )", 1, "1:16", {"nan"}},
    {"model( size [1 1 \"nan\"] )", 1, "1:18", {"nan"}},
    {"model( origin [0 0 0 \"-inf\"] )", 1, "1:22", {"inf"}},
    {"model( ranger_return \"nan\" )", 1, "1:22", {"nan"}},
    {"position( velocity_bounds [0 1 0 1 0 1 0 \"nan\"] )", 1, "1:42", {"nan"}},
    {"model( block( points -1 ) )", 1, "1:22", {"-1 points"}},
    {"model( block( points 1 point[0] [\"inf\" 0] ) )", 1, "1:34", {"inf"}},
    // Tuples that are too short.
    {"model( pose [1 2 3] )", 1, "1:14", {"pose", "3", "4"}},
    {"model( size [1 2] )", 1, "1:14", {"size", "2", "3"}},
    {"model( color_rgba [1 0 0] )", 1, "1:20", {"color_rgba"}},
    {"model( origin 1 )", 1, "1:15", {"origin"}},
    {"ranger( sensor( range 5 ) )", 1, "1:23", {"range"}},
    {"model( block( points 1 point[0] [1] ) )", 1, "1:34", {"point[0]"}},
    {"model( block( z [1] ) )", 1, "1:18", {"z"}},
    // Syntax.
    {"model( pose [1, 2, 0] )", 1, "1:15", {}},
    {"model(\n", 1, "2:1", {")"}},
    {"model( name robot )", 1, "1:13", {}},
};
INSTANTIATE_TEST_SUITE_P(All, Refused, testing::ValuesIn(kBadFiles));

// ---- limits of memory and time ------------------------------------------------------------------

std::string Repeated(size_t times, const std::string& text) {
  std::string result;
  for (size_t i = 0; i < times; i++) result += text;
  return result;
}

std::string Text(size_t length) { return "\"" + std::string(length, 'x') + "\""; }

const BadFile kTooLarge[] = {
    {"model( block( points 100001 ) )", 1, "1:22", {"100001 points", "0 to 100000"}},
    {"bumper( bcount 10001 )", 1, "1:16", {"10001 bumpers", "1 to 10000"}},
    {"camera( resolution [4096 2305] )", 1, "1:21", {"4096 by 2305", "at most 9437184"}},
    {"blobfinder( image [100001 1] )", 1, "1:20", {"width of 100001", "0 to 100000"}},
    {"blobfinder( colors_count 1001 colors [" + Repeated(1001, "\"red\" ") + "] )",
     1,
     "1:26",
     {"1001 colors", "at most 1000"}},
    {"model( ctrl [" + Repeated(101, "\"sink\" ") + "] )", 1, "1:14", {"101 controllers"}},
    {"model( ctrl " + Text(1001) + " )", 1, "1:13", {"1001 bytes"}},
    {"model( say " + Text(1001) + " )", 1, "1:12", {"1001 bytes"}},
    {"model( name " + Text(1001) + " )", 1, "1:13", {"name of 1001 bytes"}},
    {"model( name " + Text(1000) + " model( ) model( ) )", 1, "1:1016", {"name of 1008 bytes"}},
    {"model( size [160001 160001 1] )", 1, "1:14", {"more than 16001000 cells", "coarser"}},
    {"resolution 0.000001 model( size [5 5 1] )", 1, "1:34", {"more than 16001000 cells"}},
    {Repeated(10, "model( size [10000 10000 1] )\n"), 1, "9:14", {"more than 16009000 cells"}},
};
INSTANTIATE_TEST_SUITE_P(TooLarge, Refused, testing::ValuesIn(kTooLarge));

TEST(Limits, AcceptValuesAtTheLimit) {
  for (const std::string& text :
       {"ranger( alwayson 1 sensor( samples 1000000 ) )" + std::string(),
        "model( block( points 100000 ) )" + std::string(),
        "bumper( alwayson 1 bcount 10000 blength 1 )" + std::string(),
        "camera( alwayson 1 resolution [4096 2304] )" + std::string(),
        "blobfinder( alwayson 1 image [100000 100] )" + std::string(),
        "model( say " + Text(1000) + " )", "model( name " + Text(1000) + " )",
        std::string("model( size [20000 20000 1] )")}) {
    const auto world = EmptyWorld();
    EXPECT_TRUE(TryToLoad(world.get(), text).loaded) << text.substr(0, 80);
    for (int i = 0; i < 2; i++) world->Update();
  }
}

TEST(Limits, LongTrailsAreCut) {
  const LoadOutcome outcome = TryToLoad("position( trail_length 2000000000 )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("t.world:1:24: warning: found a trail_length of 2000000000; using "
                                "100000"),
            std::string::npos)
      << outcome.errors;
}

// Loading must not take quadratic time: a new body, block or picture must not examine all others.
TEST(Limits, CrowdsInOnePlace) {
  const auto world = EmptyWorld();
  EXPECT_TRUE(TryToLoad(world.get(), Repeated(20000, "model( )\n")).loaded);
  EXPECT_EQ(world->GetAllModels().size(), 20001u);
}

TEST(Limits, BodiesOfManyBlocks) {
  const std::string block = "block( points 3 point[0] [0 0] point[1] [0 1] point[2] [1 0] )\n";
  EXPECT_TRUE(TryToLoad("model( " + Repeated(20000, block) + ")").loaded);
}

TEST(Limits, ManyModelsWithOnePicture) {
  const char* const source = std::getenv("STAGE_SOURCE_DIR");
  ASSERT_NE(source, nullptr);
  const std::string picture = std::string(source) + "/worlds/bitmaps/hospital.png";
  const auto world = EmptyWorld();
  const LoadOutcome outcome =
      TryToLoad(world.get(), Repeated(60, "model( size [5 2 1] bitmap \"" + picture + "\" )\n"));
  EXPECT_TRUE(outcome.loaded);
  for (const Model* model : world->GetChildren()) {
    const size_t expected = model == world->GetGround() ? 0 : 590;
    EXPECT_EQ(model->body().blocks().size(), expected);
  }
}

// ---- mistakes in included files -----------------------------------------------------------------

TEST(Include, ErrorsNameTheFileTheyAreIn) {
  const Folder folder;
  const std::string included =
      folder.Write("machines.inc", "define bad position(\n  wheelbase 0 )\n\nunicorn( )\n");
  const std::string main_file = folder.Write("main.world", "include \"machines.inc\"\nbad( )\n");
  const auto world = EmptyWorld();
  std::string errors = ErrorsOf([&] { EXPECT_FALSE(world->Load(main_file)); });
  EXPECT_EQ(errors.rfind(included + ":4:1: ", 0), 0u) << errors;

  folder.Write("machines.inc", "define bad position(\n  wheelbase 0 )\n");
  errors = ErrorsOf([&] { EXPECT_FALSE(world->Load(main_file)); });
  EXPECT_EQ(errors.rfind(included + ":2:13: ", 0), 0u) << errors;

  folder.Write("machines.inc", "define bad position( wheelbase [ )\n");
  errors = ErrorsOf([&] { EXPECT_FALSE(world->Load(main_file)); });
  EXPECT_EQ(errors.rfind(included + ":1:", 0), 0u) << errors;

  std::filesystem::remove(included);
  errors = ErrorsOf([&] { EXPECT_FALSE(world->Load(main_file)); });
  EXPECT_EQ(errors.rfind(main_file + ":1:", 0), 0u) << errors;
  EXPECT_NE(errors.find("machines.inc"), std::string::npos) << errors;
}

TEST(Include, UnusedPropertiesNameTheFileTheyAreIn) {
  const Folder folder;
  const std::string included = folder.Write("r.inc", "define r position(\n  wheelbas 2 )\n");
  const std::string main_file = folder.Write("main.world", "include \"r.inc\"\nr( ) r( ) r( )\n");
  const auto world = EmptyWorld();
  const std::string errors = ErrorsOf([&] { EXPECT_TRUE(world->Load(main_file)); });
  EXPECT_EQ(errors, included +
                        ":2:3: warning: property \"wheelbas\" is never read; did you mean "
                        "\"wheelbase\"?\n");
}

TEST(Include, AStreamFindsFilesBesideThePathGiven) {
  const Folder folder;
  folder.Write("r.inc", "define r position( name \"robot\" )\n");
  const auto world = EmptyWorld();
  const LoadOutcome outcome =
      TryToLoad(world.get(), "include \"r.inc\"\nr( )", folder.path() + "/not_there.world");
  EXPECT_TRUE(outcome.loaded) << outcome.errors;
  EXPECT_NE(world->GetModel("robot"), nullptr);
}

// ---- warnings -----------------------------------------------------------------------------------

TEST(Warning, UnusedPropertiesOnceWithTheNearestName) {
  const LoadOutcome outcome = TryToLoad(
      "quit_tme 3\n"
      "define r position( siez [1 1 1] )\n"
      "r( ) r( ranger_retrun 0.5 )\n"
      "ranger( sensor( sampels 3 ) samples 4 )\n"
      "window( siez [3 3] size [300 300] )\n"
      "model( my_own_property 7 pose [5 0 0 0] )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(
      outcome.errors,
      "t.world:1:1: warning: property \"quit_tme\" is never read; did you mean "
      "\"quit_time\"?\n"
      "t.world:2:20: warning: property \"siez\" is never read; did you mean \"size\"?\n"
      "t.world:3:9: warning: property \"ranger_retrun\" is never read; did you mean "
      "\"ranger_return\"?\n"
      "t.world:4:17: warning: property \"sampels\" is never read; did you mean "
      "\"samples\"?\n"
      "t.world:4:29: warning: property \"samples\" is never read; older Stages had it: give it "
      "to a section sensor inside of the ranger\n"
      "t.world:5:9: warning: property \"siez\" is never read\n"
      "t.world:6:8: warning: property \"my_own_property\" is never read\n");
}

TEST(Warning, NoneForAFileThatUsesEverything) {
  const LoadOutcome outcome = TryToLoad(
      "name \"w\" unit_length \"m\" unit_angle \"degrees\" interval_sim 100 quit_time 3\n"
      "resolution 0.02 show_clock 0 show_clock_interval 100 threads 1 speedup 1 paused 1\n"
      "confirm_on_quit 0\n"
      "window( size [400 300] center [0 0] rotate [0 0] scale 30 show_data 1 interval 50 )\n"
      "model( name \"m\" event_queue 0 watts 1 debug 0 origin [0 0 0 0] size [1 1 1]\n"
      "  pose [0 0 0 0] color \"red\" noblocks 0 boundary 0 stack_children 1 mass 1\n"
      "  blob_return 1 fiducial_key 1 fiducial_return 1 gripper_return 1 obstacle_return 1\n"
      "  ranger_return 1 gui_nose 1 gui_grid 1 gui_move 1 gui_outline 1 map_resolution 0.1\n"
      "  friction 0 update_interval 100 say \"hello\" trail_length 1 trail_interval 1 alwayson 1\n"
      "  block( points 1 point[0] [0 0] z [0 1] ) )\n"
      "position( velocity [0 0 0 0] drive \"car\" wheelbase 1 localization \"odom\"\n"
      "  localization_origin [0 0 0 0] odom_error [0 0 0 0]\n"
      "  velocity_bounds [-1 1 -1 1 -1 1 -1 1] acceleration_bounds [-1 1 -1 1 -1 1 -1 1] )\n"
      "ranger( color_rgba [1 1 1 1] sensor( pose [0 0 0 0] size [1 1 1] range [0 1] fov 1\n"
      "  samples 3 noise [0 0 0] color_rgba [0 0 1 1] ) )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_EQ(outcome.errors, "");
}

TEST(Warning, NoneForEnergyProperties) {
  const LoadOutcome outcome = TryToLoad("model( kjoules 100 give_watts 10 take_watts 5 )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_EQ(outcome.errors, "");
}

TEST(Warning, EmptyControllerNamesAreIgnored) {
  for (const char* ctrl : {"\"\"", "[\"\"]", "\"  \""}) {
    const LoadOutcome outcome = TryToLoad("model( ctrl " + std::string(ctrl) + " )");
    EXPECT_TRUE(outcome.loaded) << ctrl;
    EXPECT_EQ(TheErrorLine(outcome).rfind("t.world:1:", 0), 0u) << outcome.errors;
    EXPECT_NE(outcome.errors.find("warning"), std::string::npos);
  }
  const LoadOutcome none = TryToLoad("model( ctrl [ ] )");
  EXPECT_TRUE(none.loaded);
}

TEST(Warning, ThreadsBelowOneBecomeOne) {
  for (const char* threads : {"0", "-3"}) {
    const LoadOutcome outcome = TryToLoad("threads " + std::string(threads));
    EXPECT_TRUE(outcome.loaded);
    EXPECT_NE(TheErrorLine(outcome).find("t.world:1:9: warning: "), std::string::npos);
  }
  std::string told;
  SetLogSink([&](LogLevel, const std::string& line) { told += line + '\n'; });
  TryToLoad("threads 3");
  SetLogSink(nullptr);
  EXPECT_NE(told.find("[threads 3]"), std::string::npos) << told;
}

TEST(Warning, UnknownColoursAreRed) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(world.get(), "model( name \"a\" color \"liteblue\" )");
  EXPECT_NE(TheErrorLine(outcome).find("liteblue"), std::string::npos);
  EXPECT_EQ(Find(*world, "a")->GetColor().r, 1);
  EXPECT_EQ(Find(*world, "a")->GetColor().b, 0);
}

TEST(Warning, NegativeTrailsAreHarmless) {
  const LoadOutcome outcome = TryToLoad("model( trail_length -5 trail_interval 0 )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_EQ(outcome.errors,
            "t.world:1:21: warning: found a trail_length of -5; using 0\n"
            "t.world:1:39: warning: found a trail_interval of 0; using 1\n");
}

// ---- values -------------------------------------------------------------------------------------

TEST(Values, NestedInAWindowIsTopLevel) {
  const auto world = LoadText("window( model( name \"a\" ) )");
  EXPECT_EQ(Find(*world, "a")->Parent(), nullptr);
}

TEST(Values, OfTheBaseModelAreRead) {
  const auto world = LoadText(
      "unit_length \"cm\" unit_angle \"radians\"\n"
      "model( name \"a\" pose [100 200 300 4] size [10 20 30] origin [1 2 3 4] color \"blue\" mass "
      "3\n"
      " blob_return 0 fiducial_key 5 fiducial_return 6 gripper_return 1 obstacle_return 0\n"
      " ranger_return 0.25 update_interval 250 say \"hello\" )");
  const Model* a = Find(*world, "a");
  ExpectPose(a->GetPose(), 1, 2, 3, 4 - 2 * M_PI);
  ExpectPose(a->GetGeom().pose, 0.01, 0.02, 0.03, 4);  // not normalised
  EXPECT_DOUBLE_EQ(a->GetGeom().size.z, 0.3);
  EXPECT_EQ(a->GetColor().b, 1);
  EXPECT_EQ(a->GetTotalMass(), 3);
  EXPECT_FALSE(a->vis.blob_return || a->vis.obstacle_return);
  EXPECT_TRUE(a->vis.gripper_return);
  EXPECT_EQ(a->vis.fiducial_key, 5);
  EXPECT_EQ(a->GetFiducialReturn(), 6);
  EXPECT_EQ(a->vis.ranger_return, 0.25);
  EXPECT_EQ(a->GetUpdateInterval(), 250000u);
  EXPECT_EQ(Find(*world, "a")->GetSayString(), "hello");
}

}  // namespace
}  // namespace Stg
