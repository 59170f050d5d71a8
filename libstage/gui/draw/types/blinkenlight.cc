// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/blinkenlight.hh"

#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

// A blinkenlight has no data to draw: its body's colour shows its state.
[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelBlinkenlight>({view::Show::kBlink, view::Show::kLights}));

}  // namespace

}  // namespace Stg::draw
