// SPDX-License-Identifier: GPL-2.0-or-later
//
// Debug views of the collision grid and of the paths that a robot's rays take through it.

#ifndef STAGE_GUI_DRAW_DEBUG_PICTURE_HH
#define STAGE_GUI_DRAW_DEBUG_PICTURE_HH

#include "gui/draw/primitives.hh"
#include "gui/view/projection.hh"

namespace Stg {
class Model;
class World;
}  // namespace Stg

namespace Stg::draw {

/// Draws superregions in blue, regions in green and occupied cells as green squares. Squares that
/// are out of view or smaller than a few pixels are skipped.
void DrawOccupancy(World& world, const view::Projection& projection, Painting* painting);

/// Draws how the rays of all rangers below `root` traverse the grid, or every n-th ray of a sensor
/// with many. Lines are leaps over empty space, darker for longer leaps, with a point at each
/// landing. Squares are cells with potential hits; the cell that stopped the ray is red.
void DrawRays(World& world, const Model& root, Painting* painting);

}  // namespace Stg::draw

#endif
