// SPDX-License-Identifier: GPL-2.0-or-later
//
// How pictures mark robots: a nose, which is a triangle on top of the body that points where the
// robot heads, and a dot in place of a robot that would be too small to be seen. The window,
// pictures from Python and the page in a browser all follow these rules, so that they agree.

#ifndef STAGE_MODELS_ROBOT_MARKS_HH
#define STAGE_MODELS_ROBOT_MARKS_HH

#include <array>
#include <cstddef>
#include <optional>

#include "geometry/color.hh"
#include "geometry/geometry.hh"

namespace Stg {
class BlockGroup;

/// Corners in the model's frame, metres, counter-clockwise; the first one is the tip, ahead.
using Nose = std::array<point_t, 3>;

/// The nose of a body whose frame lies at `frame` in the model's frame. Nothing if the body's
/// outlines don't enclose the middle of that frame, so that there is nothing to draw it on.
std::optional<Nose> NoseOf(const BlockGroup& body, const Pose& frame);

/// A light tone of the body's colour if that is dark, otherwise a dark one; as opaque as the body.
Color NoseColor(const Color& body);

/// Pixels. A robot that is narrower than a dot is drawn as a dot, so that it can be seen from any
/// distance. Dots are smaller where there are many robots.
inline constexpr double kDotWidth = 5, kSmallDotWidth = 3;
inline constexpr std::size_t kManyRobots = 1000;
inline double DotWidth(std::size_t robots) {
  return robots > kManyRobots ? kSmallDotWidth : kDotWidth;
}
/// Pixels. The edges of a narrower body are not drawn: they would hide its colour. A narrower robot
/// has no nose: nothing could be told from it.
inline constexpr double kEdgeWidth = 5, kNoseWidth = 6;

}  // namespace Stg

#endif
