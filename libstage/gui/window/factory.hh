// SPDX-License-Identifier: GPL-2.0-or-later
//
// Windows for programs that load libstagegui at run time: see world/gui_loader.hh.

#ifndef STAGE_GUI_WINDOW_FACTORY_HH
#define STAGE_GUI_WINDOW_FACTORY_HH

#include <functional>
#include <string>

namespace Stg {

class World;

struct WindowRequest {
  int width = 800, height = 630;  ///< pixels, menu bar included; a `window` section wins
  const char* caption = nullptr;
  bool ends_at_quit_time = false;  ///< otherwise the world pauses there
  /// The log that the world shows; its name is empty if it shows none. Simulated seconds.
  std::string log_name;
  double log_start = 0, log_end = 0;
  std::function<void(World&, double seconds)> go_to;
};

}  // namespace Stg

/// A world with a window. Null and the reason, one line, if there can be none.
extern "C" Stg::World* stage_make_window(const Stg::WindowRequest* request, std::string* message);

namespace Stg {
using MakeWindow = decltype(&stage_make_window);
}

#endif
