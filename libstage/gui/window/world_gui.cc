// SPDX-License-Identifier: GPL-2.0-or-later

#include "window/world_gui.hh"

#include <sys/time.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "geometry/load_error.hh"
#include "gui/window/window_state.hh"
#include "messages/report.hh"
#include "models/power_pack.hh"
#include "stage.hh"
#include "world/world_handle.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

using internal::window::WindowState;

namespace {

constexpr double kQuitPollInterval = 0.2;  // seconds between checks for quit requests
constexpr double kTopViewAngle = 0.1;      // degrees

/// Resolves a side of the window: a negative value means the screen's.
int Side(int wanted, int screen) { return wanted < 0 ? screen : std::max(wanted, 1); }

void OnClose(Fl_Widget* widget, void*) {
  // Esc must not close the main window.
  if (Fl::event() == FL_SHORTCUT && Fl::event_key() == FL_Escape) return;
  static_cast<WorldGui*>(widget)->state().Quit("Stage: User closed window");
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
  const std::string obstacle = Canvas::WhyUnavailable();
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
      state_(std::make_unique<WindowState>(*this)) {
  end();
  state_->caption = caption ? caption : std::string("Stage v") + Version();
  state_->view.width = w();
  state_->view.height = h();
  copy_label(state_->caption.c_str());
  resizable(state_->canvas);
  size_range(view::ViewState::kMinSize, view::ViewState::kMinSize);
  callback(OnClose);
  RecordTrails(true);
  Place(this, width, height, 0);
  show();
  state_->canvas->take_focus();
  Fl::check();  // shows the window before loading, which may take a while
}

WorldGui::~WorldGui() {
  hide();
  clear();  // destroys the canvas before the parts it refers to
}

// ---- files --------------------------------------------------------------------------------------

void WorldGui::PrepareLoading() {
  state_->runner.Halt();
  state_->selection = internal::window::Selection();
  state_->loaded = false;
  state_->view = view::ViewState();
  state_->view.width = w();
  state_->view.height = h() - state_->ExtraHeight();
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
  state_->loaded = good;
  if (good) {
    const std::string file = wf->filename;
    const std::string shown = state_->timeline ? "replay of " + state_->timeline->log().name : file;
    copy_label((state_->caption + (shown.empty() ? "" : ": " + shown)).c_str());
    Place(this, state_->view.width, state_->view.height, state_->ExtraHeight());
    if (state_->shows_all) state_->ResetView(true);
  }
  state_->RefreshControls();
  return good;
}

/// The default is real time, unless the file sets another speed.
void WorldGui::LoadWorldProperties() {
  World::LoadWorldProperties();
  if (!wf->PropertyExists(0, "speedup")) speedup = 1;
  paused = wf->ReadInt(0, "paused", 0) != 0;
  state_->confirm_on_quit = wf->ReadInt(0, "confirm_on_quit", 1) != 0;
}

void WorldGui::LoadWindowSection() {
  WindowState& state = *state_;
  state.view.options.OfferSwitchesFor(*this);
  state.shows_all = !state.view.Load(wf.get());
  if (state.view.follow_model.empty()) return;
  Model* model = GetModel(state.view.follow_model);
  if (!model) return;
  state.selection.SetLast(model);
  state.view.options.Set(view::Show::kFollow, true);
}

void WorldGui::UnLoad() {
  state_->runner.Halt();
  state_->selection = internal::window::Selection();
  state_->loaded = false;
  World::UnLoad();
  Redraw();
}

bool WorldGui::Save(const char* filename) {
  if (!wf) return false;
  state_->view.width = w();
  state_->view.height = h() - state_->ExtraHeight();
  state_->view.Save(wf.get());
  wf->WriteFloat(0, "speedup", speedup);
  wf->WriteInt(0, "paused", paused);
  wf->WriteInt(0, "confirm_on_quit", state_->confirm_on_quit);
  return World::Save(filename);
}

// ---- running ------------------------------------------------------------------------------------

bool WorldGui::Update(void) {
  WindowState& state = *state_;
  if (state.updating) return false;  // a controller runs the event loop within a step
  state.updating = true;
  const WorldHandle handle(this);
  const bool done = World::Update();
  if (!handle) return done;  // a callback deleted it
  state.updating = false;
  if (done) {
    if (PastQuitTime() && state.ends_at_quit_time)
      QuitAll();
    else if (PastQuitTime() && !state.timeline)  // a log ends there
      SetQuitTime(0);
    Stop();
  } else {
    state.runner.Stepped();
  }
  if (!state.load_later.empty())
    state.Load(std::exchange(state.load_later, ""));
  else if (std::exchange(state.restart_later, false))
    state.Restart();
  return done;
}

void WorldGui::Start() {
  World::Start();
  state_->runner.Begin();
  Redraw();
}

void WorldGui::Stop() {
  World::Stop();
  state_->runner.Reschedule();
  Redraw();
}

void WorldGui::TogglePause() { state_->TogglePause(); }

void WorldGui::RunEventLoop() {
  // A callback may delete this object.
  const WorldHandle handle(this);
  while (handle && Fl::first_window() && !TestQuit()) Fl::wait(kQuitPollInterval);
}

// ---- view ---------------------------------------------------------------------------------------

void WorldGui::Redraw(void) { state_->runner.RequestFrame(true); }

std::string WorldGui::ClockString() const {
  std::string text = World::ClockString();
  char ratio[32];
  std::snprintf(ratio, sizeof ratio, " [%.1f]", state_->runner.speed().ratio());
  if (state_->runner.speed().ratio() > 0) text += ratio;
  if (paused) text += " [ PAUSED ]";
  if (state_->view.options[view::Show::kFollow] && state_->selection.last())
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

Model* WorldGui::RecentlySelectedModel() const { return state_->selection.last(); }

usec_t WorldGui::RealTimeNow(void) const {
  timeval now;
  gettimeofday(&now, nullptr);
  return static_cast<usec_t>(now.tv_sec) * 1000000 + static_cast<usec_t>(now.tv_usec);
}

Canvas* WorldGui::GetCanvas(void) const { return state_->canvas; }

bool WorldGui::IsTopView() {
  const OrthoCamera& camera = state_->view.flat;
  return std::fabs(camera.pitch()) < kTopViewAngle && std::fabs(camera.yaw()) < kTopViewAngle;
}

void WorldGui::RemoveModel(Model* mod) {
  state_->selection.Forget(mod);
  World::RemoveModel(mod);
}

void WorldGui::OfferVisualizer(Visualizer* visualizer, bool on_by_default) {
  view::ViewOptions& options = state_->view.options;
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
  state_->filter.Refresh();
}

// ---- input --------------------------------------------------------------------------------------

int WorldGui::handle(int event) {
  // The menu item can have only one shortcut; this is the second.
  if (event == FL_SHORTCUT && Fl::event_key() == ' ' && Fl::event_state(FL_CTRL)) {
    state_->ResetView(true);
    return 1;
  }
  return Fl_Window::handle(event);
}

}  // namespace Stg
