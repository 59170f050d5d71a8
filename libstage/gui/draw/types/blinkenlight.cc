// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/blinkenlight.hh"

#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

// Its light is the colour of its body.
[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelBlinkenlight>({view::Show::kBlink}));

}  // namespace

}  // namespace Stg::draw
