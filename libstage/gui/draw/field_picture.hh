// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws fields on the floor.

#ifndef STAGE_GUI_DRAW_FIELD_PICTURE_HH
#define STAGE_GUI_DRAW_FIELD_PICTURE_HH

#include "gui/draw/primitives.hh"

namespace Stg {
class World;
}

namespace Stg::draw {

/// Draws each field in its colour, from transparent at its lowest value to opaque at its highest
/// one. Fields with more than 160 columns or rows are drawn in patches with the mean of their
/// cells.
void DrawFields(World& world, Painting* painting);

}  // namespace Stg::draw

#endif
