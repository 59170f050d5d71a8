// SPDX-License-Identifier: GPL-2.0-or-later
//
// Files in the window: loading, saving, quitting, dialogs.

#include <FL/Fl.H>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "gui/gui_testing.hh"
#include "gui/window/logo.hh"

namespace gui_testing {

namespace fs = std::filesystem;
using Stg::Pose;
using Stg::view::Show;

namespace {

const char kWorld[] = R"(# A comment that stays.
include "part.inc"
speedup 2   # twice
paused 1
confirm_on_quit 1

window
(
  size [ 500 430 ]
  center [ 0 0 ]   # of the view
  rotate [ 0 0 ]
  scale 30
  show_data 0
  show_flags 1
  show_status 1
)

robot( name "r0" pose [ 1 0 0 45 ] )
robot( name "r1" pose [ -1 0 0 0 ] )
)";

std::string ReadFile(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> Lines(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class FilesTest : public WindowTest {
 protected:
  void SetUp() override {
    old_folder_ = fs::current_path();
    folder_ = fs::temp_directory_path() / ("gui_files_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    fs::current_path(folder_);
    std::ofstream("w.world") << kWorld;
    std::ofstream("other.world") << "paused 1 window( center [ 3 4 ] ) model( name \"m\" )\n";
    std::ofstream("part.inc") << "define robot position( size [ 0.6 0.4 0.5 ] )\n";
  }
  void TearDown() override {
    WindowTest::TearDown();
    fs::current_path(old_folder_);
    fs::remove_all(folder_);
  }
  /// Presses keys after a delay, when a dialog is open.
  void TypeLater(double seconds, std::vector<std::string> keys) {
    later_ = std::move(keys);
    Fl::add_timeout(
        seconds,
        [](void* keys_to_type) {
          for (const std::string& key : *static_cast<std::vector<std::string>*>(keys_to_type))
            TheHand().Type(key);
        },
        &later_);
  }

  fs::path folder_, old_folder_;
  std::vector<std::string> later_;
};

TEST_F(FilesTest, ReadsTheFile) {
  OpenFile("w.world");
  EXPECT_STREQ(world_->label(), "test: w.world");
  EXPECT_EQ(world_->w(), 500);
  EXPECT_EQ(world_->h(), 430);
  EXPECT_EQ(world_->speedup, 2);
  EXPECT_EQ(state().view.flat.scale(), 30);
}

TEST_F(FilesTest, ObeysPaused) {
  world_ = std::make_unique<Stg::WorldGui>(400, 300, "test");
  ASSERT_TRUE(world_->Load("w.world"));
  EXPECT_TRUE(world_->Paused());
  state().Load("w.world");
  Run(0.4);
  EXPECT_TRUE(world_->Paused());
  EXPECT_EQ(world_->UpdateCount(), 0u);
}

TEST_F(FilesTest, RefusesABadSection) {
  std::ofstream("bad.world") << "window( scale \"nan\" ) model( )\n";
  world_ = std::make_unique<Stg::WorldGui>(400, 300, "test");
  testing::internal::CaptureStderr();
  EXPECT_FALSE(world_->Load("bad.world"));
  EXPECT_NE(testing::internal::GetCapturedStderr().find("bad.world:1:"), std::string::npos);
  EXPECT_FALSE(state().loaded);
}

TEST_F(FilesTest, SavesOnlyExistingProperties) {
  OpenFile("w.world");
  Type("d");
  Type("l");
  Type("g");  // not saved to the file
  Type("Right");
  world_->GetModel("r0")->SetPose(Pose(2, 1, 0, 0));
  Type("s", {"Control_L"});
  const std::vector<std::string> before = Lines(kWorld), after = Lines(ReadFile("w.world"));
  ASSERT_EQ(before.size(), after.size());
  std::string changed;
  for (size_t i = 0; i < after.size(); i++)
    if (before[i] != after[i]) changed += after[i] + "\n";
  EXPECT_EQ(changed,
            "  center [ 0.3333333333333333 0 ]   # of the view\n"
            "  show_data 1\n"
            "  show_flags 0\n"
            "robot( name \"r0\" pose [ 2 1 0 0 ] )\n");
  EXPECT_EQ(ReadFile("part.inc"), "define robot position( size [ 0.6 0.4 0.5 ] )\n");

  state().Load("w.world");
  EXPECT_EQ(world_->GetModel("r0")->GetPose().x, 2);
  EXPECT_TRUE(state().view.options[Show::kData]);
  EXPECT_FALSE(state().view.options[Show::kFlags]);
  EXPECT_NEAR(state().view.flat.x(), 1.0 / 3, 1e-6);
}

TEST_F(FilesTest, LoadsAnotherWorld) {
  OpenFile("w.world");
  world_->Start();
  EXPECT_TRUE(RunUntil([&] { return world_->UpdateCount() > 2; }));
  state().Load("other.world");
  Settle();
  EXPECT_EQ(world_->SimTimeNow(), 0u);
  EXPECT_EQ(state().view.flat.x(), 3);
  EXPECT_EQ(state().view.flat.scale(), 15);
  EXPECT_TRUE(state().selection.empty());
  TypeLater(0.5, {"Return"});
  state().Load("absent.world");  // shows an alert
  EXPECT_FALSE(state().loaded);
  Run(0.3);
}

TEST_F(FilesTest, LoadsThroughTheDialog) {
  OpenFile("w.world");
  TypeLater(0.8, {"Escape"});
  Type("l", {"Control_L"});
  EXPECT_EQ(world_->TokenStr(), "w.world");
  TypeLater(0.8, {"o", "t", "h", "e", "r", "period", "w", "o", "r", "l", "d", "Return"});
  Type("l", {"Control_L"});
  EXPECT_TRUE(RunUntil([&] { return world_->TokenStr().ends_with("other.world"); }))
      << world_->TokenStr();
}

TEST_F(FilesTest, AsksBeforeItQuits) {
  OpenFile("w.world");
  world_->Start();
  const uint64_t steps = world_->UpdateCount();
  TypeLater(0.8, {"Escape"});
  Type("q", {"Control_L"});
  EXPECT_FALSE(world_->TestQuit());
  EXPECT_TRUE(world_->shown());
  EXPECT_GT(world_->UpdateCount(), steps + 5) << "the world stopped while the dialog was open";

  state().confirm_on_quit = false;
  TheHand().Close(WindowId(world_.get()));
  EXPECT_TRUE(RunUntil([&] { return world_->TestQuit(); }));
  EXPECT_FALSE(world_->shown());
  world_->CancelQuitAll();
}

void TypeEscape(void*) { TheHand().Type("Escape"); }

TEST_F(FilesTest, QuittingLeavesTheWorldFileAsItIs) {
  OpenFile("w.world");
  world_->GetModel("r0")->SetPose(Pose(2, 1, 0, 0));
  TypeLater(0.8, {"Return"});
  for (const double seconds : {2.5, 3.5, 4.5}) Fl::add_timeout(seconds, TypeEscape);
  Type("q", {"Control_L"});  // Esc answers any unexpected dialog
  Fl::remove_timeout(TypeEscape);
  EXPECT_TRUE(world_->TestQuit());
  EXPECT_EQ(ReadFile("w.world"), kWorld);
  world_->CancelQuitAll();
}

TEST_F(FilesTest, SavingBeforeQuittingSuggestsAnotherName) {
  using Stg::internal::window::FreeNameBeside;
  EXPECT_EQ(FreeNameBeside("w.world"), "w-1.world");
  std::ofstream("w-1.world") << "taken";
  EXPECT_EQ(FreeNameBeside("w.world"), "w-2.world");
  EXPECT_EQ(FreeNameBeside((folder_ / "w.world").string()), (folder_ / "w-2.world").string());
  EXPECT_EQ(FreeNameBeside(""), "");
}

TEST_F(FilesTest, SaveAsAsksBeforeItReplaces) {
  OpenFile("w.world");
  world_->GetModel("r0")->SetPose(Pose(2, 1, 0, 0));
  TypeLater(0.8, {"Return"});  // accepts the suggested name, the world's own
  Fl::add_timeout(1.6, [](void*) { TheHand().Type("Escape"); });
  Type("s", {"Control_L", "Shift_L"});
  EXPECT_EQ(ReadFile("w.world"), kWorld);
}

TEST_F(FilesTest, RunEndsWhenTheWindowIsClosed) {
  OpenFile("w.world");
  state().confirm_on_quit = false;
  world_->Start();
  Fl::add_timeout(
      0.3, [](void* window) { TheHand().Close(WindowId(static_cast<Fl_Window*>(window))); },
      static_cast<Fl_Window*>(world_.get()));
  Stg::World::Run();
  EXPECT_TRUE(world_->TestQuit());
  world_->CancelQuitAll();
}

/// A controller that runs FLTK's loop within a step; the window is closed in it.
int CloseWithinAStep(Stg::World* world, void* closed) {
  auto* window = static_cast<Stg::WorldGui*>(world);
  if (*static_cast<bool*>(closed)) return 0;
  *static_cast<bool*>(closed) = true;
  TheHand().Close(WindowId(window));
  TheHand().Type("period");
  const double end = WallClock() + 0.5;
  while (WallClock() < end) Fl::wait(0.02);
  return 0;
}

TEST_F(FilesTest, WindowMayBeClosedWithinAStep) {
  OpenFile("w.world");
  state().confirm_on_quit = false;
  bool closed = false;
  world_->AddUpdateCallback(CloseWithinAStep, &closed);
  world_->Start();
  Stg::World::Run();
  EXPECT_TRUE(world_->TestQuit());
  EXPECT_EQ(world_->UpdateCount(), 1u);
  world_->CancelQuitAll();
}

int LoadWithinAStep(Stg::World* world, void*) {
  auto* window = static_cast<Stg::WorldGui*>(world);
  window->state().load_later = "other.world";
  return 1;
}

TEST_F(FilesTest, LoadingWaitsForTheEndOfAStep) {
  OpenFile("w.world");
  world_->AddUpdateCallback(LoadWithinAStep, nullptr);
  world_->Start();
  EXPECT_TRUE(RunUntil([&] { return world_->TokenStr() == "other.world"; }));
  Run(0.2);
}

TEST_F(FilesTest, WritesScreenshots) {
  OpenFile("w.world");
  state().view.options.Set(Show::kScreenshots, true);
  world_->Start();
  Run(1);
  EXPECT_FALSE(fs::exists("stage-000030.png"));  // at most 25 per second
  // There are fewer on a busy machine or with sanitizers.
  EXPECT_TRUE(RunUntil([] { return fs::exists("stage-000005.png"); }));
  state().view.options.Set(Show::kScreenshots, false);
  for (const auto& entry : fs::directory_iterator("."))
    if (entry.path().extension() == ".png") {
      const std::string bytes = ReadFile(entry.path());
      ASSERT_GT(bytes.size(), 24u);
      const auto number = [&](size_t at) {
        return static_cast<unsigned char>(bytes[at + 2]) * 256 +
               static_cast<unsigned char>(bytes[at + 3]);
      };
      EXPECT_EQ(number(16), 500);
      EXPECT_EQ(number(20), 400);
    }
  EXPECT_TRUE(fs::exists("stage-000000.png"));
}

TEST_F(FilesTest, ScreenshotsReplaceNothing) {
  // Files as from an earlier recording. Numbers continue throughout the process.
  std::vector<std::string> names;
  for (int i = 0; i < 60; i++) {
    char name[32];
    std::snprintf(name, sizeof name, "stage-%06d.png", 10 * i);
    std::ofstream(names.emplace_back(name)) << "precious";
  }
  OpenFile("w.world");
  state().view.options.Set(Show::kScreenshots, true);
  world_->Start();
  const auto count = [] {
    return std::distance(fs::directory_iterator("."), fs::directory_iterator());
  };
  const auto before = count();
  EXPECT_TRUE(RunUntil([&] { return count() >= before + 15; }));
  state().view.options.Set(Show::kScreenshots, false);
  for (const std::string& name : names) EXPECT_EQ(ReadFile(name), "precious") << name;
}

TEST_F(FilesTest, SurvivesFailingScreenshots) {
  OpenFile("w.world");
  fs::current_path(old_folder_);
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  fs::current_path(folder_);
  fs::remove_all(folder_);  // so that the current directory can't be written
  state().view.options.Set(Show::kScreenshots, true);
  world_->Redraw();
  Settle();
  EXPECT_FALSE(state().view.options[Show::kScreenshots]);
}

/// Checks the About window's logo: robot, wall, the area seen by the scan and that behind the wall.
void ExpectLogo() {
  Fl_Window* about = Fl::first_window();
  while (about && std::string(about->label() ? about->label() : "") != "About Stage")
    about = Fl::next_window(about);
  ASSERT_TRUE(about);
  const auto* logo = dynamic_cast<Stg::internal::window::Logo*>(about->child(1));
  ASSERT_TRUE(logo);
  const auto at = [&](int x, int y) { return PixelOf(about, logo->x() + x, logo->y() + y); };
  EXPECT_EQ(at(22, 48), 0xd9731au);
  EXPECT_EQ(at(78, 48), 0x5a5a60u);
  EXPECT_EQ(at(60, 48), 0xcdd4f8u);
  EXPECT_NE(at(96, 48), 0xcdd4f8u);
  int dark = 0, at_the_edge = 0;  // pixels of the name
  for (int y = 20; y < 62; y++)
    for (int x = 112; x < 264; x += 2)
      (x < 116 || x > 260 ? at_the_edge : dark) += at(x, y) == 0x282830u;
  EXPECT_GT(dark, 100);
  EXPECT_EQ(at_the_edge, 0);  // not cut off
}

TEST_F(FilesTest, HelpAndAbout) {
  OpenFile("w.world");
  Stg::internal::window::ShowHelp();
  Stg::internal::window::ShowAbout();
  Settle();
  EXPECT_NE(TheHand().Find("Getting help with Stage"), 0u);
  EXPECT_NE(TheHand().Find("About Stage"), 0u);
  ExpectLogo();
  while (Fl_Window* window = Fl::first_window())
    if (window == world_.get()) {
      if (!Fl::next_window(window)) break;
      Fl::next_window(window)->hide();
    } else {
      window->hide();
    }
}

}  // namespace

}  // namespace gui_testing
