// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/light.hh"

#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

// A light has no data to draw: its body's colour shows its state.
[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelLight>({view::Show::kBlink}));

}  // namespace

}  // namespace Stg::draw
