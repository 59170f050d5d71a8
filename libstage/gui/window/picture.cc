// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/picture.hh"

#include <FL/gl.h>

#include "gui/window/parts.hh"

namespace Stg::internal::window {

void Picture::Draw(Parts&, int width, int height, bool) {
  glViewport(0, 0, width, height);
  glClearColor(0.7f, 0.7f, 0.8f, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

}  // namespace Stg::internal::window
