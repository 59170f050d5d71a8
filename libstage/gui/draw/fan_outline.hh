// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a sensor's rays have reached, as an outline without the points that nobody could see: most
// rays of a sensor end on straight walls, and on a small picture less than a pixel apart.

#ifndef STAGE_GUI_DRAW_FAN_OUTLINE_HH
#define STAGE_GUI_DRAW_FAN_OUTLINE_HH

#include <cstddef>
#include <vector>

namespace Stg::draw {

/// A point beside a sensor, metres: x ahead, y to the left.
struct Tip {
  float x, y;
};

/// Directions of a sensor's rays: cosines and sines of its bearings.
struct Directions {
  std::vector<float> x, y;
};
Directions DirectionsOf(const std::vector<double>& bearings);

/// Appends where the rays end: the first, the last, and as many between that no other lies farther
/// than `tolerance` from the lines between these. Ranges beyond `longest` end there. Returns how
/// many.
std::size_t AppendOutline(const std::vector<double>& ranges, const Directions& directions,
                          float longest, float tolerance, std::vector<Tip>* tips);

}  // namespace Stg::draw

#endif
