// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world seen from above.

#ifndef STAGE_PYTHON_PICTURE_HH
#define STAGE_PYTHON_PICTURE_HH

#include <cstdint>

#include "canvas.hh"

namespace Stg {
class World;
}

namespace Stg::python {

/// Draws it into the pixels, see Canvas: bodies, the higher above the lower, with the headings of
/// what drives, and, if asked for, the areas that the rays of rangers have swept.
void DrawWorld(World& world, const View& view, bool data, uint8_t* pixels);

/// The view of that size that all bodies just fit into.
View FittedView(World& world, int width, int height);

}  // namespace Stg::python

#endif
