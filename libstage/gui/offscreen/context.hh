// SPDX-License-Identifier: GPL-2.0-or-later
//
// An OpenGL context without a display, made with EGL, and its framebuffer.

#ifndef STAGE_GUI_OFFSCREEN_CONTEXT_HH
#define STAGE_GUI_OFFSCREEN_CONTEXT_HH

#include <memory>
#include <string>

#include "gui/offscreen/png_writer.hh"

namespace Stg::offscreen {

class Context {
 public:
  /// Makes the context current and binds a framebuffer of this size. Tries graphics cards first,
  /// then Mesa's software renderer. Returns null and a one-line reason if all fail.
  static std::unique_ptr<Context> Make(int width, int height, std::string* error);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  int width() const;
  int height() const;
  /// Name of the renderer, such as "llvmpipe (LLVM 15.0.6, 256 bits)".
  const std::string& device() const;
  /// Binds the framebuffer for the next frame.
  void Bind();
  /// Waits until the frame is rendered and copies it.
  void Read(Image* image);

 private:
  struct Impl;
  explicit Context(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg::offscreen

#endif
