// SPDX-License-Identifier: GPL-2.0-or-later
//
// Each world that comes with Stage in a window: open, step, drag a robot, change the view, save,
// load again, close. Screenshots are compared with pictures/*.png, reduced screenshots that were
// checked by eye when made (by this test with STAGE_UPDATE_PICTURES set).

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "gui/gui_testing.hh"
#include "gui/picture_files.hh"

namespace gui_testing {

namespace fs = std::filesystem;
using Stg::Model;
using Stg::Pose;
using Stg::view::Show;

namespace {

constexpr unsigned kFactor = 4;      // factor of reduction
constexpr double kTolerance = 0.02;  // fraction of the pixels

struct Case {
  const char* world;
  int steps;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.world; }

/// Runs in a temporary folder with a copy of the worlds.
class PictureTest : public WindowTest {
 protected:
  void SetUp() override {
    old_folder_ = fs::current_path();
    source_ = std::getenv("STAGE_SOURCE_DIR");
    folder_ = fs::temp_directory_path() / ("gui_worlds_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    fs::copy(source_ / "worlds", folder_ / "worlds", fs::copy_options::recursive);
    fs::current_path(folder_);
  }
  void TearDown() override {
    WindowTest::TearDown();
    fs::current_path(old_folder_);
    fs::remove_all(folder_);
  }

  /// Takes a screenshot with the window's own command.
  Picture Look() {
    for (const auto& entry : fs::directory_iterator("."))
      if (entry.path().extension() == ".png") fs::remove(entry.path());
    MoveTo(2, 2);
    state().view.options.Set(Show::kScreenshots, true);
    world_->Redraw();
    Settle();
    state().view.options.Set(Show::kScreenshots, false);
    for (const auto& entry : fs::directory_iterator("."))
      if (entry.path().extension() == ".png") return ReadPicture(entry.path());
    return Picture();
  }
  /// Compares a screenshot with the committed picture.
  void ExpectToSee(const std::string& name) {
    const Picture full = Look();
    ASSERT_EQ(full.width, static_cast<unsigned>(canvas().w()));
    ASSERT_EQ(full.height, static_cast<unsigned>(canvas().h()));
    const Picture seen = Reduced(full, kFactor);
    const fs::path expected = source_ / "tests" / "gui" / "pictures" / (name + ".png");
    if (std::getenv("STAGE_UPDATE_PICTURES")) WritePicture(expected, seen);
    const double difference = Difference(seen, ReadPicture(expected));
    if (difference < kTolerance) return;
    const fs::path found = old_folder_ / (name + "_found.png");
    WritePicture(found, full);
    ADD_FAILURE() << name << ": " << difference * 100 << " % of the pixels differ; see " << found;
  }
  /// True if no other movable model is near.
  bool IsAlone(const Model* robot, const Stg::point_t& place) {
    for (const Model* model : world_->World::GetChildren()) {
      if (model == robot || !model->IsMovable()) continue;
      const Stg::point_t other = PlaceOf(model->GetPose());
      if (std::hypot(other.x - place.x, other.y - place.y) < 10) return false;
    }
    return true;
  }
  /// A robot that is visible in the window and alone; null: none.
  Model* RobotInView() {
    for (Model* model : world_->World::GetChildren()) {
      if (!model->IsMovable() || model->GetModelType() != "position") continue;
      const Stg::point_t place = PlaceOf(model->GetPose());
      const bool inside = place.x > 60 && place.x < canvas().w() - 60 && place.y > 60 &&
                          place.y < canvas().h() - 60;
      if (inside && IsAlone(model, place)) return model;
    }
    return nullptr;
  }

  fs::path source_, folder_, old_folder_;
};

class WorldsTest : public PictureTest, public testing::WithParamInterface<Case> {};

TEST_P(WorldsTest, CanBeSeenAndDriven) {
  const std::string file = std::string("worlds/") + GetParam().world + ".world";
  OpenFile(file);
  for (int i = 0; i < GetParam().steps; i++) world_->Update();
  Type("period");
  EXPECT_EQ(world_->UpdateCount(), static_cast<uint64_t>(GetParam().steps) + 1);
  ExpectToSee(std::string(GetParam().world) + "_flat");

  Type("d");
  ExpectToSee(std::string(GetParam().world) + "_data");
  Type("d");

  Model* robot = RobotInView();
  ASSERT_NE(robot, nullptr);
  const Stg::point_t place = PlaceOf(robot->GetPose());
  const Pose before = robot->GetPose();
  DragBy(place.x, place.y, 30, 30);
  EXPECT_EQ(world_->RecentlySelectedModel(), robot);
  EXPECT_NEAR(robot->GetPose().x, before.x + 30 / state().view.flat.scale(), 1e-6);
  const Pose dragged = robot->GetPose();
  const std::string name = robot->TokenStr();

  Type("s", {"Control_L"});
  state().Load(file);
  world_->Stop();
  EXPECT_NEAR(world_->GetModel(name)->GetPose().x, dragged.x, 0.00051);
  EXPECT_TRUE(state().selection.empty());

  state().confirm_on_quit = false;
  TheHand().Close(WindowId(world_.get()));
  EXPECT_TRUE(RunUntil([&] { return world_->TestQuit(); }));
  world_->CancelQuitAll();
}

INSTANTIATE_TEST_SUITE_P(Shipped, WorldsTest,
                         testing::Values(Case{"simple", 40}, Case{"zoo", 40}, Case{"foraging", 100},
                                         Case{"cave", 20}, Case{"hospital", 2}));

/// Several threads compute each step; the window draws between steps.
TEST_F(PictureTest, ThreadsOfTheSimulationBesideTheWindow) {
  std::ifstream cave("worlds/cave.world");
  std::ofstream("worlds/threads.world") << cave.rdbuf() << "\nthreads 4\nspeedup -1\n";
  OpenFile("worlds/threads.world");
  EXPECT_EQ(world_->statistics().threads, 4u);
  state().view.options.Set(Show::kData, true);
  world_->Start();
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() >= 20; }));
  world_->Stop();
  const uint64_t steps = world_->UpdateCount();
  std::vector<Pose> poses;
  for (const Model* model : world_->World::GetChildren()) poses.push_back(model->GetPose());

  OpenFile("worlds/cave.world");
  while (world_->UpdateCount() < steps) world_->Update();
  size_t i = 0;
  for (const Model* model : world_->World::GetChildren()) {
    const Pose &one = model->GetPose(), &many = poses.at(i++);
    EXPECT_TRUE(one.x == many.x && one.y == many.y && one.a == many.a) << model->TokenStr();
  }
}

TEST_F(PictureTest, Perspective) {
  OpenFile("worlds/zoo.world");
  for (int i = 0; i < 40; i++) world_->Update();
  state().view.flat.setPitch(50);
  state().view.flat.setYaw(20);
  ExpectToSee("zoo_tilted");
  Type("r");
  state().view.perspective.setPose(0, -9, 6);
  ExpectToSee("zoo_perspective");
}

}  // namespace

}  // namespace gui_testing
