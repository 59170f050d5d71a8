// SPDX-License-Identifier: GPL-2.0-or-later
//
// The icon above robots that cannot move: a yellow triangle with an exclamation mark.

#ifndef STAGE_GUI_DRAW_STALL_ICON_HH
#define STAGE_GUI_DRAW_STALL_ICON_HH

#include <vector>

#include "geometry/geometry.hh"
#include "gui/draw/primitives.hh"
#include "gui/view/projection.hh"

namespace Stg::draw {

/// Appends an icon half a metre high, centred at `place` and facing the viewer.
void AppendStallIcon(const point3_t& place, const view::Matrix& modelview,
                     std::vector<Vertex>* triangles);

}  // namespace Stg::draw

#endif
