// SPDX-License-Identifier: GPL-2.0-or-later
//
// Marks of robots in pictures: a nose, which is a triangle on the body that points ahead, and a dot
// for robots too small to be visible. The window, Python's pictures and the browser page all use
// these rules.

#ifndef STAGE_MODELS_ROBOT_MARKS_HH
#define STAGE_MODELS_ROBOT_MARKS_HH

#include <array>
#include <cstddef>
#include <optional>

#include "geometry/geometry.hh"
#include "pictures/color.hh"

namespace Stg {
class BlockGroup;

/// Corners in the model's frame, metres, counter-clockwise; the first is the tip.
using Nose = std::array<point_t, 3>;

/// The nose of a body whose frame lies at `frame` in the model's frame. Empty if the outlines do
/// not enclose the frame's origin, so that there is nothing to draw it on.
std::optional<Nose> NoseOf(const BlockGroup& body, const Pose& frame);

/// A lighter tone of the body's colour if that is dark, a darker tone if it is light. Keeps the
/// opacity.
Color NoseColor(const Color& body);

/// In pixels. Robots narrower than a dot are drawn as a dot, to be visible at any distance. Dots
/// are smaller if there are many robots.
inline constexpr double kDotWidth = 5, kSmallDotWidth = 3;
inline constexpr std::size_t kManyRobots = 1000;
inline double DotWidth(std::size_t robots) {
  return robots > kManyRobots ? kSmallDotWidth : kDotWidth;
}
/// In pixels. Narrower bodies have no edges drawn, which would hide the colour; narrower robots
/// have no nose, which would be illegible.
inline constexpr double kEdgeWidth = 5, kNoseWidth = 6;

}  // namespace Stg

#endif
