// SPDX-License-Identifier: GPL-2.0-or-later
//
// WorldGui: a world with a window. Part of <stage.hh> if the window is built.
//
// Steps, frames and input share FLTK's event loop and thread. The loop is World::Run(), or a
// client's own loop around Fl::wait().

#ifndef STAGE_GUI_WINDOW_WORLD_GUI_HH
#define STAGE_GUI_WINDOW_WORLD_GUI_HH

// Included for clients, which rely on these headers.
#include <FL/Fl.H>
#include <FL/Fl_Box.H>
#include <FL/Fl_Gl_Window.H>
#include <FL/Fl_Menu_Bar.H>
#include <FL/Fl_Window.H>
#include <FL/fl_draw.H>
#include <FL/gl.h>
#include <GL/glu.h>

#include <iosfwd>
#include <memory>
#include <string>

#include "draw/gl_helpers.hh"
#include "models/model.hh"
#include "world/world.hh"

namespace Stg {

class Canvas;
namespace internal {
namespace window {
struct WindowState;
}
}  // namespace internal

class WorldGui : public World, public Fl_Window {
 public:
  /// Builds a window in the middle of the screen and shows it. Size in pixels, including the menu
  /// bar. Without a caption the title is the program's name and version.
  WorldGui(int width, int height, const char* caption = NULL);
  ~WorldGui() override;

  /// Loads a world together with its window section.
  bool Load(const std::string& worldfile_path) override;
  bool Load(std::istream& world_content,
            const std::string& worldfile_path = std::string()) override;
  void UnLoad() override;
  /// Saves the world and updates the properties that its window section contains.
  bool Save(const char* filename) override;
  /// Makes one step. At the quit time the world pauses and can be continued.
  bool Update(void) override;
  /// Lets the event loop step the world at `speedup` times real time.
  void Start() override;
  void Stop() override;
  void TogglePause() override;
  /// Runs FLTK's loop until no window is left or all worlds are to quit.
  void RunEventLoop() override;

  /// Requests a frame soon, even while paused.
  void Redraw(void) override;
  /// World::ClockString(), the ratio of simulated to real time, and the modes paused and follow.
  std::string ClockString() const override;
  /// Stored energy, input, output and mean power, one line each.
  std::string EnergyString(void) const;
  bool IsGUI() const override { return true; }
  /// The model clicked last, even if it is no longer selected.
  Model* RecentlySelectedModel() const override;
  /// Wall-clock time, microseconds.
  usec_t RealTimeNow(void) const;
  Canvas* GetCanvas(void) const;
  /// True if the flat camera looks straight down and north is up.
  bool IsTopView();
  /// Call only while a frame is drawn.
  void DrawBoundingBoxTree();

  void RemoveModel(Model* mod) override;
  void OfferVisualizer(Visualizer* visualizer, bool on_by_default) override;
  void PushColor(Color col) override;
  void PushColor(double r, double g, double b, double a) override;
  void PopColor() override;

  int handle(int event) override;

  internal::window::WindowState& state() { return *state_; }  ///< for the library

 protected:
  void LoadWorldProperties() override;
  void LoadWindowSection() override;

 private:
  void PrepareLoading();
  bool FinishLoading(bool good);

  std::unique_ptr<internal::window::WindowState> state_;
};

}  // namespace Stg

#endif
