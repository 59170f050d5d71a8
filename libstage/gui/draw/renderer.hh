// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws scenes into the current OpenGL context (3.3 or later, compatibility profile, so that
// clients' visualizers can draw the old way). Knows nothing of windows.

#ifndef STAGE_GUI_DRAW_RENDERER_HH
#define STAGE_GUI_DRAW_RENDERER_HH

#include <memory>
#include <string>
#include <vector>

#include "gui/draw/scene.hh"

namespace Stg::draw {

/// Texts on the glass, not in the world.
struct Hud {
  std::string clock;                 ///< lower left corner; empty: no box
  std::vector<std::string> overlay;  ///< upper left corner, a line each
};

class Renderer {
 public:
  Renderer();
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// False and one line if the current context won't do. Called by Draw() too, which then draws
  /// nothing.
  bool Prepare(std::string* error);
  /// Draws into the framebuffer that is bound, from its lower left corner. The context's state is
  /// afterwards as it was, but for bindings, which are undone.
  void Draw(const Scene& scene, const Hud& hud);
  /// To be called when the context is gone, with all that was in it.
  void Forget();

  // Statistics of the last picture.
  unsigned draw_calls() const;
  std::size_t vertices() const;  ///< that were sent through the shaders

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg::draw

#endif
