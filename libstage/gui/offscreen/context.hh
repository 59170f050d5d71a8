// SPDX-License-Identifier: GPL-2.0-or-later
//
// An OpenGL context without a display, by EGL, and a framebuffer to draw into.

#ifndef STAGE_GUI_OFFSCREEN_CONTEXT_HH
#define STAGE_GUI_OFFSCREEN_CONTEXT_HH

#include <memory>
#include <string>

#include "gui/offscreen/png_writer.hh"

namespace Stg::offscreen {

class Context {
 public:
  /// A current context with a framebuffer of that size bound. Graphics cards come first, then
  /// Mesa's software. Null and one line if there is none.
  static std::unique_ptr<Context> Make(int width, int height, std::string* error);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  int width() const;
  int height() const;
  /// What draws, such as "llvmpipe (LLVM 15.0.6, 256 bits)".
  const std::string& device() const;
  /// Binds the framebuffer for the next picture.
  void Bind();
  /// Waits until all is drawn and fetches it.
  void Read(Image* image);

 private:
  struct Impl;
  explicit Context(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg::offscreen

#endif
