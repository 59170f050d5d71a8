// SPDX-License-Identifier: GPL-2.0-or-later
//
// Creates windows for programs that load libstagegui at run time; see world/gui_loader.hh.

#ifndef STAGE_GUI_WINDOW_FACTORY_HH
#define STAGE_GUI_WINDOW_FACTORY_HH

#include <functional>
#include <string>

namespace Stg {

class World;

struct WindowRequest {
  int width = 800, height = 630;  ///< pixels, with menu bar; a `window` section overrides it
  const char* caption = nullptr;
  bool ends_at_quit_time = false;  ///< if false, the world pauses at the quit time
  /// Name of the replayed log, empty if none, and its interval in simulated seconds.
  std::string log_name;
  double log_start = 0, log_end = 0;
  std::function<void(World&, double seconds)> seek_to;
};

}  // namespace Stg

/// Returns a world with a window, or null and a one-line reason.
extern "C" Stg::World* stage_make_window(const Stg::WindowRequest* request, std::string* message);

namespace Stg {
using MakeWindow = decltype(&stage_make_window);
}

#endif
