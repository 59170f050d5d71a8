// SPDX-License-Identifier: GPL-2.0-or-later
//
// WorldGui: a world with a window. Part of <stage.hh> where the window is built.
//
// Steps, pictures and input all take their turns in FLTK's event loop, in one thread: World::Run(),
// or a loop of the client's own around Fl::wait().

#ifndef STAGE_GUI_WINDOW_WORLD_GUI_HH
#define STAGE_GUI_WINDOW_WORLD_GUI_HH

// Clients rely on these.
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
struct Parts;
}
}  // namespace internal

class WorldGui : public World, public Fl_Window {
 public:
  /// Builds and shows the window, in the middle of the screen. Pixels, menu bar included. Without a
  /// caption the title is the program's name and version.
  WorldGui(int width, int height, const char* caption = NULL);
  ~WorldGui() override;

  /// Reads the window section too.
  bool Load(const std::string& worldfile_path) override;
  bool Load(std::istream& world_content,
            const std::string& worldfile_path = std::string()) override;
  void UnLoad() override;
  /// Writes the window section too: those of its properties that are in the file.
  bool Save(const char* filename) override;
  /// One step. When the world's end has come it is paused, and can be continued.
  bool Update(void) override;
  /// Lets the event loop step the world, `speedup` times as fast as real time.
  void Start() override;
  void Stop() override;
  void TogglePause() override;
  /// FLTK's loop, until no window is left or all worlds are to quit.
  void RunEventLoop() override;

  /// The next picture comes soon, even when paused.
  void Redraw(void) override;
  /// That of World; simulated by real time over the last steps; whether it is paused or follows.
  std::string ClockString() const override;
  /// Stored energy, input, output, mean power; a line each.
  std::string EnergyString(void) const;
  bool IsGUI() const override { return true; }
  /// The one that was clicked last, even if it is no longer selected.
  Model* RecentlySelectedModel() const override;
  /// Of the clock on the wall, microseconds.
  usec_t RealTimeNow(void) const;
  Canvas* GetCanvas(void) const;
  /// The flat camera looks straight down, and north is up.
  bool IsTopView();
  /// Within a picture.
  void DrawBoundingBoxTree();

  void RemoveModel(Model* mod) override;
  void OfferVisualizer(Visualizer* visualizer, bool on_by_default) override;
  void PushColor(Color col) override;
  void PushColor(double r, double g, double b, double a) override;
  void PopColor() override;

  int handle(int event) override;

  internal::window::Parts& parts() { return *parts_; }  ///< for the library

 protected:
  void LoadWorldProperties() override;
  void LoadWindowSection() override;

 private:
  void PrepareLoading();
  bool FinishLoading(bool good);

  std::unique_ptr<internal::window::Parts> parts_;
};

}  // namespace Stg

#endif
