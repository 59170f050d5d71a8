// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/picture.hh"

#include <FL/gl.h>

#include <cstdio>

#include "gui/window/parts.hh"
#include "messages/report.hh"
#include "threads/wall_clock.hh"

namespace Stg::internal::window {

void Picture::Draw(Parts& parts, int width, int height, bool fresh) {
  if (fresh) renderer_.Forget();
  std::string error;
  if (!renderer_.Prepare(&error)) return SayOnce(error);

  figures_.Update(parts.world, threads::WallClock());
  draw::Selection selection;
  selection.models = parts.selection.models();
  selection.last = parts.selection.last();
  scene_.Update(parts.world, parts.view, width, height, selection);
  draw::Hud hud;
  hud.clock = parts.ClockText();
  if (parts.view.options[view::Show::kOverlay]) hud.overlay = figures_.lines();
  glViewport(0, 0, width, height);
  renderer_.Draw(scene_, hud);
}

/// Reports the error once. The simulation continues without a view.
void Picture::SayOnce(const std::string& error) {
  glClear(GL_COLOR_BUFFER_BIT);
  if (!said_) messages::Report(LogLevel::kError, "stage: nothing can be drawn: " + error);
  said_ = true;
}

}  // namespace Stg::internal::window
