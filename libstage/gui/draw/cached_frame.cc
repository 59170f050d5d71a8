// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/cached_frame.hh"

namespace Stg::draw {

bool CachedFrame::Begin(int width, int height) {
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &target_);
  const bool good = frame_ != 0 && width == width_ && height == height_;
  if (!good) Make(width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  return good;
}

void CachedFrame::Make(int width, int height) {
  Delete();
  width_ = width;
  height_ = height;
  glGenFramebuffers(1, &frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  const auto attach = [&](GLuint* buffer, GLenum format, GLenum point) {
    glGenRenderbuffers(1, buffer);
    glBindRenderbuffer(GL_RENDERBUFFER, *buffer);
    glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, *buffer);
  };
  attach(&color_, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  attach(&depth_, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
}

void CachedFrame::End() {
  const auto target = static_cast<GLuint>(target_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, target);
}

void CachedFrame::Delete() {
  if (frame_ == 0) return;
  glDeleteFramebuffers(1, &frame_);
  glDeleteRenderbuffers(1, &color_);
  glDeleteRenderbuffers(1, &depth_);
  frame_ = color_ = depth_ = 0;
}

}  // namespace Stg::draw
