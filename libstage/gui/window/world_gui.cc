// SPDX-License-Identifier: GPL-2.0-or-later

#include "window/world_gui.hh"

#include <sys/time.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "geometry/load_error.hh"
#include "gui/window/parts.hh"
#include "messages/report.hh"
#include "models/power_pack.hh"
#include "stage.hh"
#include "world/world_handle.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

using internal::window::Parts;

namespace {

constexpr double kPatience = 0.2;      // seconds between checks for quit requests
constexpr double kTopViewAngle = 0.1;  // degrees

/// Resolves a side of the window: a negative value means the screen's.
int Side(int wanted, int screen) { return wanted < 0 ? screen : std::max(wanted, 1); }

void OnClose(Fl_Widget* widget, void*) {
  // Esc must not close the main window.
  if (Fl::event() == FL_SHORTCUT && Fl::event_key() == FL_Escape) return;
  static_cast<WorldGui*>(widget)->parts().Quit("Stage: User closed window");
}

/// Sizes the window and centres it on the screen. `extra` pixels are added to the height unless it
/// is the screen's.
void Place(Fl_Window* window, int wide, int high, int extra) {
  int x, y, width, height;
  Fl::screen_work_area(x, y, width, height, 0);
  const int w = Side(wide, width), h = Side(high < 0 ? high : high + extra, height);
  window->resize(x + std::max(0, (width - w) / 2), y + std::max(0, (height - h) / 2), w, h);
}

/// Exits the program with an error if there is no usable display, as FLTK does.
int CheckDisplay(int width) {
  const std::string obstacle = Canvas::Obstacle();
  if (!obstacle.empty()) {
    std::fflush(stdout);
    messages::Report(LogLevel::kError, "stage: " + obstacle);
    std::exit(1);
  }
  return width;
}

}  // namespace

WorldGui::WorldGui(int width, int height, const char* caption)
    : World(caption ? caption : "MyWorld"),
      Fl_Window(CheckDisplay(width), height),
      parts_(std::make_unique<Parts>(*this)) {
  end();
  parts_->caption = caption ? caption : std::string("Stage v") + Version();
  parts_->view.width = w();
  parts_->view.height = h();
  copy_label(parts_->caption.c_str());
  resizable(parts_->canvas);
  size_range(view::ViewState::kLeastSize, view::ViewState::kLeastSize);
  callback(OnClose);
  RecordTrails(true);
  Place(this, width, height, 0);
  show();
  parts_->canvas->take_focus();
  Fl::check();  // shows the window before loading, which may take a while
}

WorldGui::~WorldGui() {
  hide();
  clear();  // destroys the canvas before the parts it refers to
}

// ---- files --------------------------------------------------------------------------------------

void WorldGui::PrepareLoading() {
  parts_->runner.Halt();
  parts_->selection = internal::window::Selection();
  parts_->loaded = false;
  parts_->view = view::ViewState();
  parts_->view.width = w();
  parts_->view.height = h() - parts_->ExtraHeight();
}

bool WorldGui::Load(const std::string& worldfile_path) {
  PrepareLoading();
  const WorldHandle handle(this);
  const bool good = World::Load(worldfile_path);
  return handle && FinishLoading(good);
}

bool WorldGui::Load(std::istream& world_content, const std::string& worldfile_path) {
  PrepareLoading();
  const WorldHandle handle(this);
  const bool good = World::Load(world_content, worldfile_path);
  return handle && FinishLoading(good);
}

bool WorldGui::FinishLoading(bool good) {
  parts_->loaded = good;
  if (good) {
    const std::string file = wf->filename;
    const std::string shown = parts_->timeline ? "replay of " + parts_->timeline->log().name : file;
    copy_label((parts_->caption + (shown.empty() ? "" : ": " + shown)).c_str());
    Place(this, parts_->view.width, parts_->view.height, parts_->ExtraHeight());
    if (parts_->shows_all) parts_->ResetView(true);
  }
  parts_->RefreshControls();
  return good;
}

/// The default is real time, unless the file sets another speed.
void WorldGui::LoadWorldProperties() {
  World::LoadWorldProperties();
  if (!wf->PropertyExists(0, "speedup")) speedup = 1;
  paused = wf->ReadInt(0, "paused", 0) != 0;
  parts_->confirm_on_quit = wf->ReadInt(0, "confirm_on_quit", 1) != 0;
}

void WorldGui::LoadWindowSection() {
  Parts& parts = *parts_;
  parts.view.options.OfferFor(*this);
  parts.shows_all = !parts.view.Load(wf.get());
  if (parts.view.follow_model.empty()) return;
  Model* model = GetModel(parts.view.follow_model);
  if (!model) return;
  parts.selection.SetLast(model);
  parts.view.options.Set(view::Show::kFollow, true);
}

void WorldGui::UnLoad() {
  parts_->runner.Halt();
  parts_->selection = internal::window::Selection();
  parts_->loaded = false;
  World::UnLoad();
  Redraw();
}

bool WorldGui::Save(const char* filename) {
  if (!wf) return false;
  parts_->view.width = w();
  parts_->view.height = h() - parts_->ExtraHeight();
  parts_->view.Save(wf.get());
  wf->WriteFloat(0, "speedup", speedup);
  wf->WriteInt(0, "paused", paused);
  wf->WriteInt(0, "confirm_on_quit", parts_->confirm_on_quit);
  return World::Save(filename);
}

// ---- running ------------------------------------------------------------------------------------

bool WorldGui::Update(void) {
  Parts& parts = *parts_;
  if (parts.updating) return false;  // a controller runs the event loop within a step
  parts.updating = true;
  const WorldHandle handle(this);
  const bool done = World::Update();
  if (!handle) return done;  // a callback deleted it
  parts.updating = false;
  if (done) {
    if (PastQuitTime() && parts.ends_at_quit_time)
      QuitAll();
    else if (PastQuitTime() && !parts.timeline)  // a log ends there
      SetQuitTime(0);
    Stop();
  } else {
    parts.runner.Stepped();
  }
  if (!parts.load_later.empty())
    parts.Load(std::exchange(parts.load_later, ""));
  else if (std::exchange(parts.restart_later, false))
    parts.Restart();
  return done;
}

void WorldGui::Start() {
  World::Start();
  parts_->runner.Begin();
  Redraw();
}

void WorldGui::Stop() {
  World::Stop();
  parts_->runner.Reschedule();
  Redraw();
}

void WorldGui::TogglePause() { parts_->TogglePause(); }

void WorldGui::RunEventLoop() {
  // A callback may delete this object.
  const WorldHandle handle(this);
  while (handle && Fl::first_window() && !TestQuit()) Fl::wait(kPatience);
}

// ---- view ---------------------------------------------------------------------------------------

void WorldGui::Redraw(void) { parts_->runner.WantFrame(true); }

std::string WorldGui::ClockString() const {
  std::string text = World::ClockString();
  char ratio[32];
  std::snprintf(ratio, sizeof ratio, " [%.1f]", parts_->runner.speed().ratio());
  if (parts_->runner.speed().ratio() > 0) text += ratio;
  if (paused) text += " [ PAUSED ]";
  if (parts_->view.options[view::Show::kFollow] && parts_->selection.last())
    text += " [FOLLOW MODE]";
  return text;
}

std::string WorldGui::EnergyString(void) const {
  constexpr double kKilo = 1000;
  const double seconds = static_cast<double>(sim_time) / 1e6;
  const double out = PowerPack::global_dissipated / kKilo;
  char text[512];
  std::snprintf(text, sizeof text,
                "Energy\n  stored:   %.0f / %.0f KJ\n  input:    %.0f KJ\n  output:   %.0f KJ at "
                "%.2f KW\n",
                PowerPack::global_stored / kKilo, PowerPack::global_capacity / kKilo,
                PowerPack::global_input / kKilo, out, seconds > 0 ? out / seconds : 0);
  return text;
}

Model* WorldGui::RecentlySelectedModel() const { return parts_->selection.last(); }

usec_t WorldGui::RealTimeNow(void) const {
  timeval now;
  gettimeofday(&now, nullptr);
  return static_cast<usec_t>(now.tv_sec) * 1000000 + static_cast<usec_t>(now.tv_usec);
}

Canvas* WorldGui::GetCanvas(void) const { return parts_->canvas; }

bool WorldGui::IsTopView() {
  const OrthoCamera& camera = parts_->view.flat;
  return std::fabs(camera.pitch()) < kTopViewAngle && std::fabs(camera.yaw()) < kTopViewAngle;
}

void WorldGui::RemoveModel(Model* mod) {
  parts_->selection.Forget(mod);
  World::RemoveModel(mod);
}

void WorldGui::OfferVisualizer(Visualizer* visualizer, bool on_by_default) {
  view::ViewOptions& options = parts_->view.options;
  const std::size_t known = options.all().size();
  const std::size_t option =
      options.Register(visualizer->GetMenuName(), visualizer->GetWorldfileName(), on_by_default);
  const int section = wf ? wf->LookupEntity("window") : -1;
  if (option >= known && section >= 0) try {
      const char* property = visualizer->GetWorldfileName().c_str();
      options.Set(option, wf->ReadInt(section, property, on_by_default) != 0);
    } catch (const LoadError& error) {
      messages::Report(LogLevel::kError, error.what());
    }
  parts_->filter.Refresh();
}

// ---- input --------------------------------------------------------------------------------------

int WorldGui::handle(int event) {
  // The menu item can have only one shortcut; this is the second.
  if (event == FL_SHORTCUT && Fl::event_key() == ' ' && Fl::event_state(FL_CTRL)) {
    parts_->ResetView(true);
    return 1;
  }
  return Fl_Window::handle(event);
}

}  // namespace Stg
