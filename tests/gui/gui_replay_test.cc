// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replays in the window: it steps, pauses, goes back and on.

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
    OpenFile(files.world_file());
    replay_->Attach(world_.get());
    parts().menu.AddSkips([this](double seconds) {
      const double now = static_cast<double>(world_->SimTimeNow()) + seconds * 1e6;
      replay_->GoTo(now > 0 ? static_cast<usec_t>(now) : 0);
    });
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
  /// Where the robot has to be now: its speed is 0.1 m/s.
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

}  // namespace

}  // namespace gui_testing
