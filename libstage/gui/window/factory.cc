// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/factory.hh"

#include "gui/window/window_state.hh"

extern "C" Stg::World* stage_make_window(const Stg::WindowRequest* request, std::string* message) {
  *message = Stg::Canvas::WhyUnavailable();
  if (!message->empty()) return nullptr;
  auto* world = new Stg::WorldGui(request->width, request->height, request->caption);
  world->state().ends_at_quit_time = request->ends_at_quit_time;
  if (!request->log_name.empty())
    world->state().ShowLog(
        {request->log_name, request->log_start, request->log_end,
         [world, seek_to = request->seek_to](double seconds) { seek_to(*world, seconds); }});
  return world;
}
