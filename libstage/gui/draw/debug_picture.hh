// SPDX-License-Identifier: GPL-2.0-or-later
//
// Pictures of how the simulation works: the collision grid, and the walks of a robot's rays.

#ifndef STAGE_GUI_DRAW_DEBUG_PICTURE_HH
#define STAGE_GUI_DRAW_DEBUG_PICTURE_HH

#include "gui/draw/primitives.hh"
#include "gui/view/projection.hh"

namespace Stg {
class Model;
class World;
}  // namespace Stg

namespace Stg::draw {

/// Superregions in blue, regions in green, occupied cells as green squares, as far as they are in
/// view and large enough to be seen.
void DrawOccupancy(World& world, const view::Projection& projection, Painting* painting);

/// The walks of the rays, or every n-th if there are many, of the rangers in a tree of models:
/// leaps over what is empty as lines, the longer the darker, with a point where each lands; cells
/// with potential hits as squares, the last one of each ray, where it stopped, in red.
void DrawRays(World& world, const Model& root, Painting* painting);

}  // namespace Stg::draw

#endif
