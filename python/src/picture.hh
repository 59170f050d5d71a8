// SPDX-License-Identifier: GPL-2.0-or-later
//
// Pictures of a world from above.

#ifndef STAGE_PYTHON_PICTURE_HH
#define STAGE_PYTHON_PICTURE_HH

#include <cstdint>

#include "canvas.hh"

namespace Stg {
class World;
}

namespace Stg::python {

/// Draws the world into `pixels` (layout: see Canvas). Higher bodies cover lower ones, and robots
/// show their headings. `data` adds the areas that the rays of rangers have swept.
void DrawWorld(World& world, const View& view, bool data, uint8_t* pixels);

/// The view of `width` x `height` pixels that just contains all bodies.
View FittedView(World& world, int width, int height);

}  // namespace Stg::python

#endif
