// SPDX-License-Identifier: GPL-2.0-or-later
//
// How a world is viewed: the content of its `window` section. No toolkit, no OpenGL.

#ifndef STAGE_GUI_VIEW_VIEW_STATE_HH
#define STAGE_GUI_VIEW_VIEW_STATE_HH

#include <string>

#include "geometry/geometry.hh"
#include "gui/view/view_options.hh"
#include "models/camera_view.hh"

namespace Stg::view {

class ViewState {
 public:
  /// Height in pixels of the menu bar above the canvas. The section's `size` includes both.
  static constexpr int kMenuHeight = 30;
  static constexpr int kMinSize = 100;

  ViewState() { perspective.setPose(0, -4, 3); }

  ViewOptions options;
  OrthoCamera flat;
  PerspectiveCamera perspective;
  /// Size of the window including the menu bar, pixels. A negative value means the screen's size.
  int width = 400, height = 300;
  int interval = 40;         ///< between frames, milliseconds of real time
  int screenshot_skip = 1;   ///< write every n-th frame
  std::string follow_model;  ///< model to follow from the start; empty: none

  /// The active camera.
  const Camera& camera() const;
  Camera& camera();
  bool is_perspective() const { return options[Show::kPerspective]; }

  /// Points the active camera at a model's pose: the flat one from above, the perspective one from
  /// slightly above it, looking ahead.
  void Follow(const Pose& pose);
  /// Moves and zooms the flat camera so that the rectangle fills most of a canvas of this size.
  void ShowAll(const Bounds& x, const Bounds& y, int canvas_width, int canvas_height);

  /// Reads the first `window` section. Without one, sets the defaults and returns false.
  bool Load(Worldfile* file);
  /// Updates the properties that the section contains. Does nothing without a section.
  void Save(Worldfile* file);
};

}  // namespace Stg::view

#endif
