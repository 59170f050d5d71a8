// SPDX-License-Identifier: GPL-2.0-or-later
//
// Renders the frames of a window.

#ifndef STAGE_GUI_WINDOW_PICTURE_HH
#define STAGE_GUI_WINDOW_PICTURE_HH

#include "gui/draw/performance_overlay.hh"
#include "gui/draw/render_scene.hh"
#include "gui/draw/renderer.hh"

namespace Stg::internal::window {

struct WindowState;

class Picture {
 public:
  /// Draws into the current context. `fresh`: the context has lost everything drawn before.
  void Draw(WindowState& state, int width, int height, bool fresh);

 private:
  void ReportOnce(const std::string& error);

  draw::RenderScene scene_;
  draw::Renderer renderer_;
  draw::PerformanceOverlay overlay_;
  bool reported_ = false;
};

}  // namespace Stg::internal::window

#endif
