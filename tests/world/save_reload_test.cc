// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world that is saved and reloaded is the same, for every type of model and all shipped worlds.
// Saving writes poses, sizes, origins, visibility and the properties of some types where the file
// has them; everything else stays as in the file.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "models/body.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// The properties of a model that are determined by the file.
struct Traits {
  std::string type, parent, text;
  std::vector<double> numbers;
};

Traits TraitsOf(const Model& model) {
  const Size size = model.GetGeom().size;
  const Pose origin = model.GetGeom().pose;
  const Color color = model.GetColor();
  Traits traits{
      model.GetModelType(),
      model.Parent() ? model.Parent()->TokenStr() : "",
      const_cast<Model&>(model).GetSayString(),
      {size.x, size.y, size.z, origin.x, origin.y, origin.z, origin.a, color.r, color.g, color.b,
       color.a, model.GetTotalMass(), static_cast<double>(model.GetSubscriptionCount()),
       static_cast<double>(model.GetUpdateInterval())}};
  std::vector<double>& numbers = traits.numbers;
  if (const PowerPack* pack = model.FindPowerPack()) {
    numbers.push_back(pack->GetStored());
    numbers.push_back(pack->GetCapacity());
  }
  for (const auto& block : model.body().blocks()) {
    for (const point_t& point : block->points()) {
      numbers.push_back(point.x);
      numbers.push_back(point.y);
    }
    numbers.push_back(block->z_range().min);
    numbers.push_back(block->z_range().max);
  }
  return traits;
}

/// The models of a world by name.
std::map<std::string, Model*> ModelsOf(const World& world) {
  std::map<std::string, Model*> models;
  for (Model* model : world.GetAllModels()) models[model->TokenStr()] = model;
  return models;
}

std::unique_ptr<World> LoadQuietly(const std::string& path) {
  std::unique_ptr<World> world = EmptyWorld();
  OutputOf([&] { EXPECT_TRUE(world->Load(path)) << path; });
  return world;
}

std::string TextOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

void ExpectSameVisibility(const Visibility& a, const Visibility& b) {
  EXPECT_EQ(a.blob_return, b.blob_return);
  EXPECT_EQ(a.fiducial_key, b.fiducial_key);
  EXPECT_EQ(a.fiducial_return, b.fiducial_return);
  EXPECT_EQ(a.gripper_return, b.gripper_return);
  EXPECT_EQ(a.obstacle_return, b.obstacle_return);
  EXPECT_NEAR(a.ranger_return, b.ranger_return, 1e-6);
}

constexpr double kSaved = 2e-6;  // max rounding error of saved values, metres and radians

/// Expects that saved properties equal those of `saving`, and all others those of `original`.
void ExpectSaved(const World& saving, const World& saved, const World& original) {
  const auto expected = ModelsOf(saving), found = ModelsOf(saved), begun = ModelsOf(original);
  ASSERT_EQ(found.size(), begun.size());
  for (const auto& [name, model] : found) {
    SCOPED_TRACE(name);
    ASSERT_EQ(expected.count(name), 1u);
    const Model& before = *expected.at(name);
    const Pose pose = before.GetPose();
    ExpectPose(model->GetPose(), pose.x, pose.y, pose.z, pose.a, kSaved);
    ExpectSameVisibility(model->vis, before.vis);
    const Traits now = TraitsOf(*model), first = TraitsOf(*begun.at(name));
    EXPECT_EQ(now.type, first.type);
    EXPECT_EQ(now.parent, first.parent);
    EXPECT_EQ(now.text, first.text);
    EXPECT_EQ(now.numbers, first.numbers);
  }
}

class SaveAndReload : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = info->name();
    std::replace(name.begin(), name.end(), '/', '_');
    folder_ = std::filesystem::temp_directory_path() /
              ("stage_save_reload_" + name + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name), std::ios::binary) << text;
    return Path(name);
  }

  std::filesystem::path folder_;
};

// ---- every type ---------------------------------------------------------------------------------

struct Example {
  const char* type;
  const char* properties;
};

void PrintTo(const Example& example, std::ostream* out) { *out << example.type; }

const Example kExamples[] = {
    {"actuator", "type \"linear\" axis [0 1 0] start_position 0.25 max_position 2 max_speed 0.5"},
    {"blinkenlight", "period 500 dutycycle 0.4 enabled 1 intensity 2"},
    {"blobfinder", "image [40 30] range 6 fov 90 pan 20 colors_count 1 colors [\"blue\"]"},
    {"bumper", "bcount 2 blength 0.3 bpose[0] [0.3 0 0 0] bpose[1] [0 0.3 0 90] blength[1] 0.5"},
    {"camera", "resolution [16 12] range [0.3 7] fov [60 45] pantilt [10 5]"},
    {"fiducial", "range_min 0.1 range_max 6 range_max_id 4 fov 200 ignore_zloc 1"},
    {"field", "size [2 2 0] field_resolution 0.5 diffusion 0.01 evaporation 0.1"},
    {"gripper", "paddle_size [0.5 0.1 0.4] paddle_state [\"closed\" \"up\"]"},
    {"groundsensor", "points 2 point[1] [0.1 0] noise 0.1 deposit_rate 0.5"},
    {"light", "intensity 2.5 on 0 color \"blue\""},
    {"lightindicator", "intensity 3"},
    {"lightsensor",
     "directions [0 45.5] range 7 fov 120 cosine_power 2 shadows 0 least_distance 0.2 ambient 0.1 "
     "noise [0.1 0.2] saturation 9"},
    {"model", "boundary 1 friction 0.2 map_resolution 0.05 trail_length 7"},
    {"position",
     "drive \"omni\" localization \"odom\" localization_origin [1 2 0 30] "
     "odom_error [0.01 0.02 0 3] wheelbase 0.7 "
     "velocity_bounds [-2 2 -2 2 0 0 -90 90] acceleration_bounds [-1 1 -1 1 0 0 -9 9]"},
    {"radio", "range 5 line_of_sight 1 delay 2 channel 3 loss 0.1 range_noise 0.02 capacity 9"},
    {"ranger",
     "sensor( pose [0.1 0 0 20] size [0.03 0.04 0.05] range [0 6] fov 170 samples 37 "
     "noise [0.01 0.02 0.5] color_rgba [0 1 0 0.2] )"},
    {"wifi", "model \"friis\" ip \"10.0.0.2\" mac \"0a\" essid \"net\" power 40 freq 2400"},
};

/// A model of the type among others, with all common properties.
std::string WorldWith(const Example& example) {
  return std::string("# a comment that stays\n") + "define thing " + example.type +
         "( mass 3 color \"blue\" size [0.4 0.3 0.5] )\n"
         "thing(\n  name \"it\" pose [1.25 -0.5 0.1 35] # where it is\n  origin [0.05 0 0 10]\n"
         "  obstacle_return 0 blob_return 1 fiducial_return 3 fiducial_key 2 gripper_return 1\n"
         "  ranger_return 0.5 joules 1000 watts 2 take_watts 5 say \"hello\" update_interval 200\n"
         "  alwayson 1\n  " +
         example.properties +
         "\n  model( name \"on_it\" pose [0.1 0.2 0 -15] size [0.1 0.1 0.1] )\n)\n"
         "model( name \"box\" pose [3 0.2 0 10] size [1 1 1] color \"red\" fiducial_return 7 )\n"
         "thing( name \"other\" pose [0.5 2 0 -90] alwayson 1 " +
         example.properties + " )\n";
}

class OfEveryType : public SaveAndReload, public testing::WithParamInterface<Example> {};

TEST_P(OfEveryType, SavedWorldContinuesUnchanged) {
  const std::string path = Write("a.world", WorldWith(GetParam()));
  const auto original = LoadQuietly(path), saving = LoadQuietly(path);
  Step(*saving, 10);
  ASSERT_TRUE(saving->Save(Path("b.world").c_str()));
  EXPECT_NE(TextOf(Path("b.world")).find("# where it is"), std::string::npos);

  const auto saved = LoadQuietly(Path("b.world"));
  ExpectSaved(*saving, *saved, *original);
  EXPECT_EQ(saved->StateHash(), original->StateHash());
  Step(*saved, 12);
  Step(*original, 12);
  EXPECT_EQ(saved->StateHash(), original->StateHash());
  EXPECT_GT(saved->GetAllModels().size(), 4u);
}

TEST_P(OfEveryType, MovedModelsAreSaved) {
  const std::string path = Write("a.world", WorldWith(GetParam()));
  const auto original = LoadQuietly(path), saving = LoadQuietly(path);
  const Pose place(-2.123456, 3.5, 0.25, 2.0);
  Find(*saving, "it")->SetPose(place);
  Find(*saving, "it.on_it")->SetPose(Pose(0, -0.25, 0.125, -1));
  Find(*saving, "it")->SetObstacleReturn(true);
  Find(*saving, "it")->SetRangerReturn(-1);
  Find(*saving, "it")->SetFiducialReturn(12);
  ASSERT_TRUE(saving->Save(Path("b.world").c_str()));
  const auto saved = LoadQuietly(Path("b.world"));
  ExpectSaved(*saving, *saved, *original);
  const Pose found = Find(*saved, "it")->GetPose();
  ExpectPose(found, place.x, place.y, place.z, place.a, kSaved);

  // Saving again gives the same text, except for an actuator's position, which is computed from its
  // pose and may differ by a rounding error.
  ASSERT_TRUE(saved->Save(Path("c.world").c_str()));
  if (GetParam().type != std::string("actuator")) {
    EXPECT_EQ(TextOf(Path("c.world")), TextOf(Path("b.world")));
  } else {
    const auto again = LoadQuietly(Path("c.world"));
    ExpectPose(Find(*again, "it")->GetPose(), found.x, found.y, found.z, found.a, 1e-14);
  }
}

INSTANTIATE_TEST_SUITE_P(Types, OfEveryType, testing::ValuesIn(kExamples),
                         [](const auto& test) { return std::string(test.param.type); });

TEST(SaveAndReloadTable, HasEveryType) {
  InitLibrary();
  for (const auto& [type, creator] : Model::name_map)
    EXPECT_TRUE(std::any_of(std::begin(kExamples), std::end(kExamples),
                            [&, &name = type](const Example& e) { return name == e.type; }))
        << type;
}

// ---- models that move ---------------------------------------------------------------------------

TEST_F(SaveAndReload, ARobotOnItsWay) {
  const std::string path = Write(
      "a.world",
      "position( name \"r\" pose [1 2 0 30] velocity [0.5 0 0 20] alwayson 1 drive \"diff\" )\n"
      "position( name \"s\" pose [4 2 0 0] alwayson 1 )\n");
  const auto original = LoadQuietly(path), saving = LoadQuietly(path);
  Find<ModelPosition>(*saving, "r")->SetSpeed(0.5, 0, 0.3);
  Step(*saving, 10);
  EXPECT_GT(Find(*saving, "r")->GetPose().Distance(Pose(1, 2, 0, 0)), 0.3);
  ASSERT_TRUE(saving->Save(Path("b.world").c_str()));
  ExpectSaved(*saving, *LoadQuietly(Path("b.world")), *original);
}

TEST_F(SaveAndReload, AJointInTheMiddle) {
  const std::string path =
      Write("a.world",
            "actuator( name \"j\" pose [1 2 0 90] type \"linear\" axis [1 0 0] max_position 2"
            " start_position 0.5 alwayson 1 )\n"
            "actuator( name \"k\" pose [1 5 0 0] type \"rotational\" min_position -3"
            " max_position 3 start_position 0 alwayson 1 )\n");
  const auto original = LoadQuietly(path), saving = LoadQuietly(path);
  for (const char* name : {"j", "k"}) Find<ModelActuator>(*saving, name)->SetSpeed(0.4);
  Step(*saving, 10);
  ASSERT_TRUE(saving->Save(Path("b.world").c_str()));
  const auto saved = LoadQuietly(Path("b.world"));
  ExpectSaved(*saving, *saved, *original);
  for (const char* name : {"j", "k"}) {
    const double position = Find<ModelActuator>(*saving, name)->GetPosition();
    EXPECT_GT(std::fabs(position), 0.3);
    EXPECT_NEAR(Find<ModelActuator>(*saved, name)->GetPosition(), position, kSaved);
  }
}

TEST_F(SaveAndReload, AGripperThatHasClosed) {
  const std::string path =
      Write("a.world",
            "gripper( name \"g\" pose [1 2 0 0] paddle_state [\"open\" \"down\"]"
            " alwayson 1 )\n");
  const auto saving = LoadQuietly(path);
  auto* gripper = Find<ModelGripper>(*saving, "g");
  gripper->CommandClose();
  Step(*saving, 60);
  gripper->CommandUp();
  Step(*saving, 60);
  ASSERT_EQ(gripper->GetConfig().paddles, ModelGripper::PADDLE_CLOSED);
  ASSERT_TRUE(saving->Save(Path("b.world").c_str()));
  const auto saved = LoadQuietly(Path("b.world"));
  const auto config = Find<ModelGripper>(*saved, "g")->GetConfig();
  EXPECT_EQ(config.paddles, ModelGripper::PADDLE_CLOSED);
  EXPECT_EQ(config.lift, ModelGripper::LIFT_UP);
}

// ---- the worlds that come with Stage ------------------------------------------------------------

std::filesystem::path WorldsFolder() {
  const char* source = std::getenv("STAGE_SOURCE_DIR");
  return std::filesystem::path(source ? source : "..") / "worlds";
}

std::vector<std::string> WorldFiles() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(WorldsFolder()))
    if (entry.path().extension() == ".world") files.push_back(entry.path().filename());
  std::sort(files.begin(), files.end());
  return files;
}

TEST_F(SaveAndReload, TheWorldsThatComeWithStage) {
  std::filesystem::copy(
      WorldsFolder(), folder_,
      std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
  ASSERT_FALSE(WorldFiles().empty());
  for (const std::string& file : WorldFiles()) {
    SCOPED_TRACE(file);
    const auto original = LoadQuietly(Path(file)), saving = LoadQuietly(Path(file));
    Step(*saving, 10);
    ASSERT_TRUE(saving->Save(Path("saved_" + file).c_str()));
    const auto saved = LoadQuietly(Path("saved_" + file));
    ExpectSaved(*saving, *saved, *original);
    ASSERT_TRUE(saved->Save(Path("again_" + file).c_str()));
    EXPECT_EQ(TextOf(Path("again_" + file)), TextOf(Path("saved_" + file)));
  }
}

}  // namespace
}  // namespace Stg
