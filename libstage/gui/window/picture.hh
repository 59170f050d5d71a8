// SPDX-License-Identifier: GPL-2.0-or-later
//
// Renders the frames of a window.

#ifndef STAGE_GUI_WINDOW_PICTURE_HH
#define STAGE_GUI_WINDOW_PICTURE_HH

#include "gui/draw/figures.hh"
#include "gui/draw/renderer.hh"
#include "gui/draw/scene.hh"

namespace Stg::internal::window {

struct Parts;

class Picture {
 public:
  /// Draws into the current context. `fresh`: the context has lost everything drawn before.
  void Draw(Parts& parts, int width, int height, bool fresh);

 private:
  void SayOnce(const std::string& error);

  draw::Scene scene_;
  draw::Renderer renderer_;
  draw::Figures figures_;
  bool said_ = false;
};

}  // namespace Stg::internal::window

#endif
