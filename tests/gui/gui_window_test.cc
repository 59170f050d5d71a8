// SPDX-License-Identifier: GPL-2.0-or-later
//
// Operating the window with mouse and keyboard.

#include <cmath>

#include "gui/gui_testing.hh"

namespace gui_testing {

using Stg::Model;
using Stg::Pose;
using Stg::view::Show;

namespace {

constexpr double kScale = 37;  // pixels per metre

/// A hall with a robot that stands still and a wall that can't be dragged.
const std::string kHall = R"(
  window ( size [635 666] scale 37 center [0 0] )
  model ( name "wall" pose [0 3 0 0] size [6 0.2 1] gui_move 0 )
  position ( name "r0" pose [1 0 0 0] size [0.6 0.4 0.5] )
  position ( name "r1" pose [-2 -1 0 90] size [0.6 0.4 0.5] )
)";

TEST_F(WindowTest, HasTheSizeOfItsSection) {
  Open(kHall);
  EXPECT_EQ(world_->w(), 635);
  EXPECT_EQ(world_->h(), 666);
  EXPECT_EQ(canvas().w(), 635);
  EXPECT_EQ(canvas().h(), 636);
  const Stg::point_t left = PlaceOf(Pose(-8, 0, 0, 0)), right = PlaceOf(Pose(8, 0, 0, 0));
  EXPECT_NEAR(right.x - left.x, 592, 1e-6);
}

TEST_F(WindowTest, PausesAndSteps) {
  Open(kHall);
  Type("p");
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() > 2; }));
  EXPECT_FALSE(world_->Paused());
  Type("p");
  EXPECT_TRUE(world_->Paused());
  EXPECT_TRUE(world_->ClockString().ends_with("[ PAUSED ]")) << world_->ClockString();

  const Stg::usec_t time = world_->SimTimeNow();
  Type("period");
  EXPECT_EQ(world_->SimTimeNow(), time + 100000);
  EXPECT_TRUE(world_->Paused());
  Run(0.3);
  EXPECT_EQ(world_->SimTimeNow(), time + 100000);
}

// ---- buttons of the toolbar ---------------------------------------------------------------------

class ToolbarTest : public WindowTest {
 protected:
  void Press(const Fl_Widget& button) {
    TheHand().MoveTo(world_->x_root() + button.x() + button.w() / 2,
                     world_->y_root() + button.y() + button.h() / 2);
    Settle();
    TheHand().Click();
    Settle();
  }
};

TEST_F(ToolbarTest, RunsPausesAndSteps) {
  Open(kHall);
  const auto& toolbar = state().toolbar;
  EXPECT_STREQ(toolbar.run().tooltip(), "Run (p)");
  Press(toolbar.step());
  EXPECT_EQ(world_->UpdateCount(), 1u);
  Press(toolbar.run());
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() > 3; }));
  EXPECT_STREQ(toolbar.run().tooltip(), "Pause (p)");
  Press(toolbar.run());
  EXPECT_TRUE(world_->Paused());
  const uint64_t steps = world_->UpdateCount();
  Press(toolbar.step());
  EXPECT_EQ(world_->UpdateCount(), steps + 1);
}

TEST_F(ToolbarTest, BeginsAnew) {
  Open(kHall);
  auto* robot = dynamic_cast<Stg::ModelPosition*>(world_->GetModel("r0"));
  robot->SetPose(Pose(0, 0, 0, 0));
  state().selection.SelectOnly(robot);
  state().view.flat.setScale(55);
  state().SetSpeed(3);
  for (int i = 0; i < 5; i++) Type("period");
  for (const bool by_key : {false, true}) {
    if (by_key)
      Type("Home");
    else
      Press(state().toolbar.restart());
    EXPECT_EQ(world_->SimTimeNow(), 0u);
    EXPECT_EQ(world_->GetModel("r0")->GetPose().x, 1);
    EXPECT_TRUE(world_->Paused());
    EXPECT_EQ(state().view.flat.scale(), 55);
    EXPECT_EQ(world_->speedup, 3);
    EXPECT_EQ(state().selection.last(), world_->GetModel("r0"));
    Type("period");
    EXPECT_EQ(world_->UpdateCount(), 1u);
  }
  world_->Start();
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() > 4; }));
  Type("Home");
  EXPECT_FALSE(world_->Paused());
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() > 4; }));
}

/// After a reset, the run is the same as before.
TEST_F(ToolbarTest, ARunThatBeginsAnewIsTheSame) {
  Open(kHall +
       "position ( name \"r2\" pose [-1 1 0 0] alwayson 1 ranger ( alwayson 1 "
       "sensor ( samples 9 range [0 5] noise [0.1 0.1 0] ) ) )");
  world_->Start();
  world_->Stop();
  for (int i = 0; i < 9; i++) world_->Update();
  const uint64_t hash = world_->StateHash();
  Type("Home");
  for (int i = 0; i < 9; i++) world_->Update();
  EXPECT_EQ(world_->StateHash(), hash);
}

TEST_F(ToolbarTest, ShowsTheSpeed) {
  using Stg::internal::window::SpeedText;
  EXPECT_EQ(SpeedText(1), "1 \u00d7");
  EXPECT_EQ(SpeedText(0.25), "0.25 \u00d7");
  EXPECT_EQ(SpeedText(20), "20 \u00d7");
  EXPECT_EQ(SpeedText(0), "max");
  Open(kHall);
  const auto shown = [&] { return std::string(state().toolbar.speed().label()); };
  EXPECT_EQ(shown(), SpeedText(1));
  Type("bracketright");
  EXPECT_EQ(shown(), SpeedText(1.2));
  Type("braceright");
  EXPECT_EQ(shown(), "max");
  // The first entry of the list: a speed of 0.1.
  Fl::add_timeout(0.8, [](void*) { TheHand().Type("Down"); });  // while the list is open
  Fl::add_timeout(1.2, [](void*) { TheHand().Type("Return"); });
  Press(state().toolbar.speed());
  EXPECT_EQ(world_->speedup, 0.1);
  EXPECT_EQ(shown(), SpeedText(0.1));
}

TEST_F(ToolbarTest, KeysWorkOnTheButtonsAndAfterAClick) {
  Open(kHall);
  const auto& toolbar = state().toolbar;
  Press(toolbar.step());
  state().view.flat.setPitch(30);
  Type("space");  // the view from above, as on the canvas; must not press the button
  EXPECT_EQ(world_->UpdateCount(), 1u);
  EXPECT_TRUE(world_->IsTopView());
  for (int i = 0; i < 8 && Fl::focus() != &toolbar.step(); i++) Type("Tab");
  ASSERT_EQ(Fl::focus(), &toolbar.step());
  Type("space");
  Type("space");
  EXPECT_EQ(world_->UpdateCount(), 3u);
  Type("period");
  EXPECT_EQ(world_->UpdateCount(), 4u);
}

TEST_F(ToolbarTest, StaysInItsPlaceWhenTheWindowGrows) {
  Open(kHall);
  const int x = state().toolbar.speed().x(), width = state().toolbar.run().w();
  TheHand().Resize(WindowId(world_.get()), 1000, 700);
  EXPECT_TRUE(RunUntil([&] { return world_->w() == 1000; }));
  EXPECT_EQ(state().toolbar.speed().x(), x);
  EXPECT_EQ(state().toolbar.run().w(), width);
  EXPECT_EQ(canvas().h(), 670);
}

TEST_F(WindowTest, AWorldWithoutASectionIsShownWhole) {
  Open("model ( pose [100 50 0 0] size [2 2 1] ) model ( pose [-100 -50 0 0] size [2 2 1] )");
  for (const double side : {1.0, -1.0}) {
    const Stg::point_t place = PlaceOf(Pose(side * 100, side * 50, 0, 0));
    EXPECT_GT(place.x, 0);
    EXPECT_LT(place.x, canvas().w());
    EXPECT_GT(place.y, 0);
    EXPECT_LT(place.y, canvas().h());
  }
}

TEST_F(WindowTest, RunsAtTheWantedSpeed) {
  Open("interval_sim 10 " + kHall);
  world_->Start();
  for (int i = 0; i < 8; i++) Type("bracketright");
  EXPECT_NEAR(world_->speedup, std::pow(1.2, 8), 1e-9);
  const auto runs_at = [&](double speed) {
    return RunUntil([&] { return std::fabs(state().runner.speed().ratio() - speed) < 0.05; });
  };
  EXPECT_TRUE(runs_at(4.3)) << state().runner.speed().ratio();
  EXPECT_NE(world_->ClockString().find("[4.3]"), std::string::npos) << world_->ClockString();
  Type("bracketleft");
  EXPECT_NEAR(world_->speedup, std::pow(1.2, 8) * 0.8, 1e-9);
  Type("braceleft");
  EXPECT_EQ(world_->speedup, 1);
  EXPECT_TRUE(runs_at(1)) << state().runner.speed().ratio();
}

TEST_F(WindowTest, RunsAsFastAsPossible) {
  Open(kHall);
  world_->Start();
  Type("braceright");
  EXPECT_LT(world_->speedup, 0);
  const uint64_t steps = world_->UpdateCount();
  Run(0.5);
  EXPECT_GT(world_->UpdateCount(), steps + 500);
  Type("p");
  Type("bracketleft");  // must not resume
  const uint64_t paused = world_->UpdateCount();
  Run(0.2);
  EXPECT_EQ(world_->UpdateCount(), paused);
  EXPECT_EQ(world_->speedup, 100);
}

TEST_F(WindowTest, PausesAtTheQuitTimeAndGoesOn) {
  Open("quit_time 1 " + kHall);
  world_->speedup = -1;
  world_->Start();
  EXPECT_TRUE(RunUntil([&] { return world_->Paused(); }));
  EXPECT_EQ(world_->SimTimeNow(), 1000000u);
  Type("p");
  EXPECT_TRUE(RunUntil([&] { return world_->SimTimeNow() > 3000000; }));
}

TEST_F(WindowTest, SelectsAndDrags) {
  Open(kHall);
  Model* robot = world_->GetModel("r0");
  const Stg::point_t place = PlaceOf(robot->GetPose());
  DragBy(place.x, place.y, 75, 0);
  ASSERT_EQ(state().selection.models(), std::vector<Model*>{robot});
  EXPECT_EQ(world_->RecentlySelectedModel(), robot);
  EXPECT_NEAR(robot->GetPose().x, 1 + 75 / kScale, 1e-9);
  EXPECT_NEAR(robot->GetPose().y, 0, 1e-9);

  const Stg::point_t now = PlaceOf(robot->GetPose());
  DragBy(now.x, now.y, 20, 0, 3);
  EXPECT_NEAR(robot->GetPose().a, 1.0, 1e-9);

  TheHand().HoldKey("Control_L");
  DragBy(now.x, now.y, 0, -10);
  TheHand().ReleaseKey("Control_L");
  EXPECT_NEAR(robot->GetPose().a, 0.5, 1e-9);
}

TEST_F(WindowTest, SelectsSeveral) {
  Open(kHall);
  Model *first = world_->GetModel("r0"), *second = world_->GetModel("r1");
  const Stg::point_t a = PlaceOf(first->GetPose()), b = PlaceOf(second->GetPose());
  Click(a.x, a.y);
  TheHand().HoldKey("Shift_L");
  Click(b.x, b.y);
  TheHand().ReleaseKey("Shift_L");
  EXPECT_EQ(state().selection.models(), (std::vector<Model*>{first, second}));
  DragBy(a.x, a.y, 0, -37);
  EXPECT_NEAR(first->GetPose().y, 1, 1e-9);
  EXPECT_NEAR(second->GetPose().y, 0, 1e-9);
  Click(5, 5);
  EXPECT_TRUE(state().selection.empty());
  EXPECT_EQ(world_->RecentlySelectedModel(), first);
}

TEST_F(WindowTest, WallsAreEmptySpace) {
  Open(kHall);
  const Stg::point_t place = PlaceOf(world_->GetModel("wall")->GetPose());
  DragBy(place.x, place.y, 37, 0);
  EXPECT_TRUE(state().selection.empty());
  EXPECT_NEAR(state().view.flat.x(), -1, 1e-9);
  EXPECT_NEAR(world_->GetModel("wall")->GetPose().x, 0, 1e-9);
}

TEST_F(WindowTest, DragsRobotsThatDrive) {
  Open(kHall);
  auto* robot = dynamic_cast<Stg::ModelPosition*>(world_->GetModel("r0"));
  robot->Subscribe();
  robot->SetSpeed(0, 0, 1);
  world_->Start();
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() > 2; }));
  const Stg::point_t place = PlaceOf(robot->GetPose());
  DragBy(place.x, place.y, 0, 74);
  EXPECT_NEAR(robot->GetPose().y, -2, 1e-6);
  EXPECT_FALSE(world_->Paused());
  EXPECT_GT(robot->GetPose().a, 0.2);
}

TEST_F(WindowTest, ZoomsAboutThePointer) {
  Open(kHall);
  const auto before = canvas().Projection().FloorPoint(500, 100);
  MoveTo(500, 100);
  for (int i = 0; i < 4; i++) TheHand().Click(4);
  Settle();
  EXPECT_NEAR(state().view.flat.scale(), kScale * 1.4641, 1e-6);
  const auto after = canvas().Projection().FloorPoint(500, 100);
  EXPECT_NEAR(before->x, after->x, 1e-6);
  EXPECT_NEAR(before->y, after->y, 1e-6);
}

TEST_F(WindowTest, TurnsTheCamera) {
  Open(kHall);
  MoveTo(300, 300);
  TheHand().HoldKey("Control_L");
  MoveTo(310, 220);
  TheHand().ReleaseKey("Control_L");
  Settle();
  EXPECT_NEAR(state().view.flat.yaw(), -5, 1e-9);
  EXPECT_NEAR(state().view.flat.pitch(), 40, 1e-9);
  EXPECT_FALSE(world_->IsTopView());
  Type("space");
  EXPECT_TRUE(world_->IsTopView());
  state().view.flat.setPose(100, 100);
  Type("space", {"Control_L"});
  EXPECT_NEAR(state().view.flat.x(), 0, 0.01);
}

TEST_F(WindowTest, ArrowsMoveTheView) {
  Open(kHall);
  Type("Right");
  Type("Up");
  EXPECT_NEAR(state().view.flat.x(), 10 / kScale, 1e-9);
  EXPECT_NEAR(state().view.flat.y(), 10 / kScale, 1e-9);
  Type("r");
  EXPECT_TRUE(state().view.is_perspective());
  const double x = state().view.perspective.x();
  Type("Left");
  EXPECT_NEAR(state().view.perspective.x(), x - 0.5, 1e-9);
}

TEST_F(WindowTest, FollowsTheLastSelected) {
  Open(kHall);
  Model* robot = world_->GetModel("r0");
  const Stg::point_t place = PlaceOf(robot->GetPose());
  Click(place.x, place.y);
  Type("f");
  EXPECT_NEAR(state().view.flat.x(), 1, 1e-9);
  Click(5, 5);
  EXPECT_TRUE(state().selection.empty());
  robot->SetPose(Pose(-1, -1, 0, 0));
  world_->Redraw();
  Settle();
  EXPECT_NEAR(state().view.flat.x(), -1, 1e-9);
  EXPECT_TRUE(world_->ClockString().ends_with(" [FOLLOW MODE]"));
}

TEST_F(WindowTest, ShortcutsSwitchOptions) {
  Open(kHall);
  struct {
    const char* key;
    std::vector<std::string> held;
    Show option;
  } const kCases[] = {
      {"d", {}, Show::kData},
      {"b", {}, Show::kBlocks},
      {"l", {}, Show::kFlags},
      {"c", {}, Show::kClock},
      {"f", {}, Show::kFollow},
      {"o", {}, Show::kFootprints},
      {"g", {}, Show::kGrid},
      {"s", {}, Show::kStatus},
      {"r", {}, Show::kPerspective},
      {"o", {"Control_L"}, Show::kOccupancy},
      {"b", {"Control_L"}, Show::kBoundingBoxes},
      {"a", {"Control_L"}, Show::kTrailArrows},
      {"f", {"Control_L"}, Show::kTrailFast},
      {"r", {"Control_L"}, Show::kTrailBlocks},
  };
  for (const auto& c : kCases) {
    const bool before = state().view.options[c.option];
    Type(c.key, c.held);
    EXPECT_NE(state().view.options[c.option], before) << c.key;
    Type(c.key, c.held);
    EXPECT_EQ(state().view.options[c.option], before) << c.key;
  }
}

TEST_F(WindowTest, FilterOpensAndCloses) {
  Open(kHall + "position ( name \"r2\" pose [3 3 0 0] ranger ( ) )");
  Type("d", {"Shift_L"});
  EXPECT_NE(TheHand().Find("Visualize"), 0u);
  Type("d", {"Shift_L"});
  EXPECT_EQ(TheHand().Find("Visualize"), 0u);
}

TEST_F(WindowTest, EscapeDoesNotClose) {
  Open(kHall);
  Type("Escape");
  EXPECT_TRUE(world_->shown());
  EXPECT_FALSE(world_->TestQuit());
}

TEST_F(WindowTest, SurvivesAnySize) {
  Open(kHall);
  world_->Start();
  const auto window = TheHand().Find("test");
  ASSERT_NE(window, 0u);
  for (const unsigned size : {1u, 5u, 31u, 1400u}) {
    TheHand().Resize(window, size, size);
    Run(0.3);
    Click(0, 0);
    Type("space", {"Control_L"});
  }
  EXPECT_GT(world_->UpdateCount(), 5u);
}

}  // namespace

}  // namespace gui_testing
