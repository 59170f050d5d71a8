// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/picture.hh"

#include <FL/gl.h>

#include <cstdio>

#include "gui/window/window_state.hh"
#include "messages/report.hh"
#include "threads/wall_clock.hh"

namespace Stg::internal::window {

void Picture::Draw(WindowState& state, int width, int height, bool fresh) {
  if (fresh) renderer_.Forget();
  std::string error;
  if (!renderer_.Prepare(&error)) return ReportOnce(error);

  overlay_.Update(state.world, threads::WallClock());
  draw::Selection selection;
  selection.models = state.selection.models();
  selection.last = state.selection.last();
  scene_.Update(state.world, state.view, width, height, selection);
  draw::Hud hud;
  hud.clock = state.ClockText();
  if (state.view.options[view::Show::kOverlay]) hud.overlay = overlay_.lines();
  glViewport(0, 0, width, height);
  renderer_.Draw(scene_, hud);
}

/// Reports the error once. The simulation continues without a view.
void Picture::ReportOnce(const std::string& error) {
  glClear(GL_COLOR_BUFFER_BIT);
  if (!reported_) messages::Report(LogLevel::kError, "stage: nothing can be drawn: " + error);
  reported_ = true;
}

}  // namespace Stg::internal::window
