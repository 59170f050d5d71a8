// SPDX-License-Identifier: GPL-2.0-or-later
//
// How a world is looked at: what its `window` section keeps. No toolkit, no OpenGL.

#ifndef STAGE_GUI_VIEW_VIEW_STATE_HH
#define STAGE_GUI_VIEW_VIEW_STATE_HH

#include <string>

#include "geometry/geometry.hh"
#include "gui/view/view_options.hh"
#include "models/camera_view.hh"

namespace Stg::view {

class ViewState {
 public:
  /// Height of the menu bar above the canvas, pixels: the section's `size` is that of both.
  static constexpr int kMenuHeight = 30;
  static constexpr int kLeastSize = 100;

  ViewState() { perspective.setPose(0, -4, 3); }

  ViewOptions options;
  OrthoCamera flat;
  PerspectiveCamera perspective;
  /// Of the window, menu bar included, pixels. A negative one means the screen's.
  int width = 400, height = 300;
  int interval = 40;         ///< from one frame to the next, real milliseconds
  int screenshot_skip = 1;   ///< every n-th frame is written
  std::string follow_model;  ///< to be followed from the start; empty: none

  /// The camera in use.
  const Camera& camera() const;
  Camera& camera();
  bool is_perspective() const { return options[Show::kPerspective]; }

  /// Puts the camera in use on a model at this pose: the flat one above it, the perspective one a
  /// hand above it, looking ahead.
  void Follow(const Pose& pose);
  /// Moves and zooms the flat camera until the rectangle fills most of a canvas of that size.
  void ShowAll(const Bounds& x, const Bounds& y, int canvas_width, int canvas_height);

  /// Reads the first `window` section; defaults without one. Returns whether there is one.
  bool Load(Worldfile* file);
  /// Updates what the section has. Nothing happens without one.
  void Save(Worldfile* file);
};

}  // namespace Stg::view

#endif
