// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/type_picture.hh"

#include <deque>

namespace Stg::draw {

namespace {
/// A deque: pointers to entries stay valid when more are registered.
std::deque<TypePicture>& All() {
  static std::deque<TypePicture> all;
  return all;
}
}  // namespace

bool RegisterPicture(const TypePicture& picture) {
  All().push_back(picture);
  view::RegisterTypeSwitches(picture.switches);
  return true;
}

const TypePicture* FindPicture(const Model& model) {
  for (const TypePicture& picture : All())
    if (picture.switches.is(model)) return &picture;
  return nullptr;
}

}  // namespace Stg::draw
