// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws the glow of lights on the floor.

#ifndef STAGE_GUI_DRAW_LIGHT_PICTURE_HH
#define STAGE_GUI_DRAW_LIGHT_PICTURE_HH

#include "gui/draw/primitives.hh"

namespace Stg {
class LightSource;
}

namespace Stg::draw {

/// Draws the disc that models/types/glow.hh describes, if the light glows.
void DrawGlow(const LightSource& light, Painting* painting);

}  // namespace Stg::draw

#endif
