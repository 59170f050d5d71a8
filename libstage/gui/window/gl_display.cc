// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/gl_display.hh"

#include <FL/Fl.H>
#include <FL/Fl_Gl_Window.H>
#include <FL/x.H>
#include <GL/glx.h>

#include <cstdlib>
#include <cstring>

namespace Stg::internal::window {

namespace {

template <typename Function>
Function Extension(const char* name) {
  return reinterpret_cast<Function>(glXGetProcAddressARB(reinterpret_cast<const GLubyte*>(name)));
}

bool HasExtension(const char* name) {
  const char* all = glXQueryExtensionsString(fl_display, fl_screen);
  return all && std::strstr(all, name);
}

}  // namespace

std::string WhyNoDisplay() {
  const char* name = std::getenv("DISPLAY");
  if (!fl_display) {
    Display* display = XOpenDisplay(nullptr);
    if (!display) return std::string("Can't open display: ") + (name ? name : "");
    fl_open_display();
    XCloseDisplay(display);  // closed only now: a server may reset when its last client disconnects
  }
  int base = 0, events = 0;
  if (!glXQueryExtension(fl_display, &base, &events))
    return std::string("the X display ") + (name ? name : "") +
           " has no OpenGL (GLX), which the window needs; -g runs without a window";
  if (!Fl_Gl_Window::can_do(FL_RGB | FL_DOUBLE | FL_DEPTH))
    return std::string("the X display ") + (name ? name : "") +
           " has no OpenGL with 24 bits of color, depth and two buffers, which the window needs; "
           "-g runs without a window";
  return "";
}

bool HasGraphicsProcessor() {
  if (!HasExtension("GLX_MESA_query_renderer")) return true;  // a vendor's own driver
  const auto query = Extension<PFNGLXQUERYRENDERERINTEGERMESAPROC>("glXQueryRendererIntegerMESA");
  unsigned accelerated = 0;
  return query && query(fl_display, fl_screen, 0, GLX_RENDERER_ACCELERATED_MESA, &accelerated) &&
         accelerated != 0;
}

void DisableVerticalSync() {
  if (HasExtension("GLX_EXT_swap_control")) {
    const auto set = Extension<PFNGLXSWAPINTERVALEXTPROC>("glXSwapIntervalEXT");
    if (set) set(fl_display, glXGetCurrentDrawable(), 0);
  } else if (HasExtension("GLX_MESA_swap_control")) {
    const auto set = Extension<PFNGLXSWAPINTERVALMESAPROC>("glXSwapIntervalMESA");
    if (set) set(0);
  }
}

}  // namespace Stg::internal::window
