// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replays in the window: stepping, pausing, seeking back and forth.

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "gui/gui_testing.hh"
#include "recording/recorder.hh"
#include "recording/replay.hh"

namespace gui_testing {

namespace {

using namespace Stg;

const char kDrives[] = R"(
speedup 5
position( name "r" size [0.4 0.4 0.4] alwayson 1
  ranger( alwayson 1 sensor( range [0 5] samples 9 fov 90 ) ) )
model( name "wall" pose [4 0 0 0] size [0.2 4 1] )
)";
constexpr usec_t kSecond = 1'000'000, kLength = 30 * kSecond;

class ReplayTest : public WindowTest {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "stage-gui-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    Record();
    replay_ = std::make_unique<recording::Replay>((folder_ / "run.mcap").string());
    const recording::UnpackedFiles files(replay_->files());
    world_ = std::make_unique<WorldGui>(400, 300, "test");
    state().ShowLog({"run.mcap", 0, 30, [this](double seconds) {
                       replay_->SeekTo(static_cast<usec_t>(seconds * kSecond + 0.5));
                     }});
    ASSERT_TRUE(world_->Load(files.world_file()));
    world_->Stop();
    TheHand().Focus(WindowId(world_.get()));
    Settle();
    world_->SetQuitTime(replay_->end());
    replay_->Attach(world_.get());
  }
  void TearDown() override {
    WindowTest::TearDown();
    std::filesystem::remove_all(folder_);
  }
  void Record() {
    std::ofstream(folder_ / "r.world") << kDrives;
    RunOptions options;
    options.listed = false;
    World world(options);
    ASSERT_TRUE(world.Load((folder_ / "r.world").string()));
    dynamic_cast<ModelPosition*>(world.GetModel("r"))->SetSpeed(0.1, 0, 0);
    recording::LogOptions log;
    log.file = (folder_ / "run.mcap").string();
    recording::Recorder recorder(log);
    recorder.Attach(&world);
    while (world.SimTimeNow() < kLength) world.Update();
    recorder.Finish();
  }
  /// Expects the robot where 0.1 m/s takes it by now.
  void ExpectItsPlace() {
    const double seconds = static_cast<double>(world_->SimTimeNow()) / kSecond;
    EXPECT_NEAR(world_->GetModel("r")->GetPose().x, 0.1 * seconds, 0.02);
  }

  std::filesystem::path folder_;
  std::unique_ptr<recording::Replay> replay_;
};

TEST_F(ReplayTest, StepsPausesAndGoesBackAndOn) {
  EXPECT_EQ(world_->SimTimeNow(), 0u);
  world_->Start();
  ASSERT_TRUE(RunUntil([this] { return world_->SimTimeNow() > 3 * kSecond; }));
  ExpectItsPlace();
  Type("p");
  ASSERT_TRUE(RunUntil([this] { return world_->Paused(); }));
  const usec_t there = world_->SimTimeNow();
  Type("greater");
  ASSERT_TRUE(RunUntil([&] { return world_->SimTimeNow() == there + 10 * kSecond; }));
  ExpectItsPlace();
  Type("period");
  ASSERT_TRUE(RunUntil([&] { return world_->SimTimeNow() > there + 10 * kSecond; }));
  ExpectItsPlace();
  Type("less");
  ASSERT_TRUE(RunUntil([&] { return world_->SimTimeNow() < there + kSecond; }));
  ExpectItsPlace();
  Type("less");
  ASSERT_TRUE(RunUntil([&] { return world_->SimTimeNow() == 0; }));
  ExpectItsPlace();
}

TEST_F(ReplayTest, ShowsTheLogsName) {
  EXPECT_STREQ(world_->label(), "test: replay of run.mcap");
  EXPECT_EQ(canvas().h(),
            300 - view::ViewState::kMenuHeight);  // the timeline has a separate row
}

TEST_F(ReplayTest, TheTimeLineGoesToAnyTime) {
  const Fl_Slider& slider = state().timeline->slider();
  TheHand().MoveTo(world_->x_root() + slider.x() + 8, world_->y_root() + slider.y() + 8);
  TheHand().Press(1);
  Settle();
  TheHand().MoveTo(world_->x_root() + slider.x() + slider.w() / 2,
                   world_->y_root() + slider.y() + 8);
  Settle();
  EXPECT_NEAR(static_cast<double>(world_->SimTimeNow()) / kSecond, 15, 1);
  ExpectItsPlace();
  TheHand().MoveTo(world_->x_root() + slider.x() + slider.w() + 20,
                   world_->y_root() + slider.y() + 8);
  Settle();
  TheHand().Release(1);
  Settle();
  EXPECT_EQ(world_->SimTimeNow(), kLength);
  ExpectItsPlace();
  Type("Home");
  EXPECT_EQ(world_->SimTimeNow(), 0u);
  EXPECT_NEAR(slider.value(), 0, 1e-9);
}

TEST_F(ReplayTest, TheTimeLineFollowsTheReplayAndEndsWithIt) {
  world_->Start();
  world_->speedup = -1;
  ASSERT_TRUE(RunUntil([this] { return world_->Paused(); }));
  Settle();
  EXPECT_EQ(world_->SimTimeNow(), kLength);
  EXPECT_NEAR(state().timeline->slider().value(), 30, 1e-9);
  Type("p");  // from the start
  ASSERT_TRUE(RunUntil([this] { return world_->Paused(); }));
  EXPECT_EQ(world_->SimTimeNow(), kLength);
}

}  // namespace

}  // namespace gui_testing
