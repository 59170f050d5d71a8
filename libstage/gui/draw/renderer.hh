// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws scenes into the current OpenGL context. It must be 3.3 or later with the compatibility
// profile, because clients' visualizers use OpenGL 1. Independent of any window toolkit.

#ifndef STAGE_GUI_DRAW_RENDERER_HH
#define STAGE_GUI_DRAW_RENDERER_HH

#include <memory>
#include <string>
#include <vector>

#include "gui/draw/render_scene.hh"

namespace Stg::draw {

/// Text at fixed places of the screen.
struct Hud {
  std::string clock;                 ///< in the lower left corner; empty: no box
  std::vector<std::string> overlay;  ///< in the upper left corner, line by line
};

class Renderer {
 public:
  Renderer();
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Returns false and a one-line reason if the current context is unsuitable. Draw() calls it too,
  /// and draws nothing in that case.
  bool Prepare(std::string* error);
  /// Draws into the bound framebuffer, from its lower left corner. Restores the context's state
  /// except for bindings, which are reset.
  void Draw(const RenderScene& scene, const Hud& hud);
  /// Call when the context, with all its objects, was destroyed.
  void Forget();

  // Statistics of the last frame.
  unsigned draw_calls() const;
  std::size_t vertices() const;  ///< number sent through the shaders

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg::draw

#endif
