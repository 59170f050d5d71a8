// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/window_state.hh"

#include <FL/fl_ask.H>

#include <cmath>
#include <cstdio>

#include "messages/report.hh"
#include "world/world_handle.hh"
#include "worldfile/worldfile.hh"

namespace Stg::internal::window {

namespace {
constexpr double kFaster = 1.2, kSlower = 0.8;
constexpr double kBelowFast = 100;  // multiple of real time that follows "as fast as possible"
}  // namespace

WindowState::WindowState(WorldGui& owner)
    : world(owner),
      menu(*this, owner.w(), view::ViewState::kMenuHeight),
      toolbar(*this, menu.bar(), owner.w(), view::ViewState::kMenuHeight),
      canvas(new Canvas(*this, 0, view::ViewState::kMenuHeight, owner.w(),
                        owner.h() - view::ViewState::kMenuHeight)),
      runner(owner, *canvas),
      pointer(*this),
      filter(*this) {
  toolbar.Refresh();  // shows the state of the runner, which is made after it
}

// ---- view ---------------------------------------------------------------------------------------

void WindowState::Toggle(std::size_t option) {
  view.options.Toggle(option);
  RefreshControls();
}

void WindowState::RefreshControls() {
  runner.SetInterval(view.interval / 1e3);
  menu.ShowOptions(view.options);
  filter.Refresh();
  runner.RequestFrame(true);
}

void WindowState::ResetView(bool everything) {
  view.camera().reset();
  if (everything && !view.is_perspective()) {
    Bounds x(0, 0), y(0, 0);
    for (const Model* model : world.World::GetChildren()) {
      const Pose pose = model->GetPose();
      const Size size = model->GetGeom().size;
      x = Bounds(std::min(x.min, pose.x - size.x / 2), std::max(x.max, pose.x + size.x / 2));
      y = Bounds(std::min(y.min, pose.y - size.y / 2), std::max(y.max, pose.y + size.y / 2));
    }
    view.ShowAll(x, y, canvas->w(), canvas->h());
  }
  runner.RequestFrame(true);
}

void WindowState::FollowModel() {
  if (view.options[view::Show::kFollow] && selection.last())
    view.Follow(selection.last()->GetGlobalPose());
}

void WindowState::ShowFilter() { filter.Toggle(); }

void WindowState::ShowLog(ReplayedLog log) {
  world.size(world.w(), world.h() + Timeline::kHeight);
  canvas->resize(0, view::ViewState::kMenuHeight, world.w(),
                 world.h() - view::ViewState::kMenuHeight - Timeline::kHeight);
  Fl_Group::current(nullptr);
  timeline =
      std::make_unique<Timeline>(*this, std::move(log), world.h() - Timeline::kHeight, world.w());
  world.add(timeline->row());
  world.init_sizes();
  menu.AddSkips([this](double seconds) { timeline->Skip(seconds); });
}

void WindowState::RefreshState() {
  toolbar.Refresh();
  if (timeline) timeline->Refresh(static_cast<double>(world.SimTimeNow()) / 1e6);
}

std::string WindowState::ClockText() const {
  if (!view.options[view::Show::kClock]) return "";
  std::string text = world.ClockString();
  const double rate = runner.frames_per_second();
  if (!world.paused && rate > 0) {
    char figure[32];
    std::snprintf(figure, sizeof figure, " %.0f fps", std::round(rate));
    text += figure;
  }
  return text;
}

// ---- running ------------------------------------------------------------------------------------

void WindowState::TogglePause() {
  if (!world.paused && runner.has_begun()) return world.Stop();
  const double now = static_cast<double>(world.SimTimeNow()) / 1e6;
  if (timeline && now >= timeline->log().end) timeline->SeekTo(timeline->log().start);
  world.Start();
}

void WindowState::OneStep() {
  world.Stop();
  world.Update();
}

void WindowState::Restart() {
  if (timeline) return timeline->SeekTo(timeline->log().start);
  restart_later = updating;
  if (!loaded || updating) return;
  World& its_world = world;
  const view::ViewState view_before = view;
  const double speedup = world.speedup;
  const bool was_paused = world.paused;
  const std::string last = selection.last() ? selection.last()->TokenStr() : "";
  runner.Halt();
  selection = Selection();
  const bool good = its_world.Reset(world.seed());
  if (!World::Exists(&its_world)) return;  // the world and this object were deleted
  loaded = good;
  if (!good) return Alert("The world cannot restart: see the messages in the terminal.");
  view = view_before;
  world.speedup = speedup;
  selection.SetLast(last.empty() ? nullptr : world.GetModel(last));
  RefreshControls();
  runner.Begin();
  if (was_paused)
    world.Stop();
  else
    world.Start();
}

void WindowState::SetSpeed(double speedup) {
  world.speedup = speedup;
  runner.Reschedule();
  runner.RequestFrame(true);
}

void WindowState::Faster() {
  if (world.speedup > 0)
    SetSpeed(world.speedup * kFaster);
  else
    fl_beep();
}

void WindowState::Slower() { SetSpeed(world.speedup > 0 ? world.speedup * kSlower : kBelowFast); }

// ---- files and quitting -------------------------------------------------------------------------

namespace {

/// Returns the world's file, or an empty string if it was loaded from a stream.
std::string FileOf(World& world) {
  return world.GetWorldFile() ? world.GetWorldFile()->filename : "";
}

}  // namespace

void WindowState::AskForFileToLoad() {
  const std::string file = ChooseFileToLoad(FileOf(world));
  if (file.empty()) return;
  if (updating)
    load_later = file;
  else
    Load(file);
}

void WindowState::Load(const std::string& file) {
  World& its_world = world;
  const WorldHandle handle(&its_world);
  const bool good = its_world.Load(file);
  if (!handle) return;  // the world and this object were deleted
  if (!good) return Alert("Unable to read selected world file.");
  if (!world.paused) world.Start();
}

void WindowState::SaveToItsFile() {
  if (FileOf(world).empty())
    AskForFileToSave("");
  else if (!world.Save(nullptr))
    Alert("Error saving world file.");
}

void WindowState::SaveAs() { AskForFileToSave(FileOf(world)); }

bool WindowState::AskForFileToSave(const std::string& suggested) {
  const std::string file = ChooseFileToSave(suggested);
  if (file.empty()) return false;
  if (world.Save(file.c_str())) return true;
  Alert("Error saving world file.");
  return false;
}

void WindowState::Quit(const char* message) {
  if (dialog_open) return;
  if (loaded && confirm_on_quit) {
    dialog_open = true;
    const QuitAnswer answer = AskBeforeQuitting();
    // Suggests a new name: saving the current poses over a hand-written file is rarely wanted.
    const bool stays =
        answer == QuitAnswer::kCancel ||
        (answer == QuitAnswer::kSave && !AskForFileToSave(FreeNameBeside(FileOf(world))));
    dialog_open = false;
    if (stays) return;
  }
  messages::Progress(message);
  filter.Close();
  world.QuitAll();
  world.hide();
}

}  // namespace Stg::internal::window
