// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/gl_helpers.hh"

#include <GL/gl.h>
#include <GL/glu.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "gui/draw/gl_texts.hh"
#include "gui/draw/screen_writer.hh"

namespace Stg::Gl {

namespace {

struct PendingText {
  double x, y;  // pixels
  draw::Rgba color;
  std::string text;
};
struct PendingParagraph {
  draw::TextBox box;
  draw::Rgba color;
  std::string text;
};
std::vector<PendingText> pending;
std::vector<PendingParagraph> pending_paragraphs;

/// Maps points of the current frame to pixels.
class ToPixels {
 public:
  ToPixels() {
    glGetDoublev(GL_MODELVIEW_MATRIX, modelview_);
    glGetDoublev(GL_PROJECTION_MATRIX, projection_);
    glGetIntegerv(GL_VIEWPORT, viewport_);
  }
  /// Returns false if the point is outside of the view; `allow_outside` allows points beside its
  /// frame.
  bool Place(float x, float y, float z, bool allow_outside, double* px, double* py) const {
    double depth;
    if (!gluProject(double{x}, double{y}, double{z}, modelview_, projection_, viewport_, px, py,
                    &depth))
      return false;
    const bool inside = *px >= 0 && *py >= 0 && *px <= viewport_[2] && *py <= viewport_[3];
    return depth >= 0 && depth <= 1 && (inside || allow_outside);
  }

 private:
  GLdouble modelview_[16], projection_[16];
  GLint viewport_[4];
};

draw::Rgba CurrentColor() {
  GLfloat c[4];
  glGetFloatv(GL_CURRENT_COLOR, c);
  return draw::ToRgba(Color(double{c[0]}, double{c[1]}, double{c[2]}, double{c[3]}));
}

// Bits of FLTK's Fl_Align. This module may not include FLTK's headers.
constexpr unsigned kTop = 1, kBottom = 2, kLeft = 4, kRight = 8, kWrap = 128;

draw::Align Alignment(unsigned bits, unsigned first, unsigned last) {
  if (bits & first) return draw::Align::kLeft;
  return bits & last ? draw::Align::kRight : draw::Align::kCentre;
}

constexpr int kMaxLines = 10000;

}  // namespace

void coord_shift(double x, double y, double z, double a) {
  glTranslated(x, y, z);
  glRotated(rtod(a), 0, 0, 1);
}

void pose_shift(const Pose& pose) { coord_shift(pose.x, pose.y, pose.z, pose.a); }

void pose_inverse_shift(const Pose& pose) {
  glRotated(rtod(-pose.a), 0, 0, 1);
  glTranslated(-pose.x, -pose.y, -pose.z);
}

void draw_grid(bounds3d_t vol) {
  if (!(vol.x.max - vol.x.min < kMaxLines && vol.y.max - vol.y.min < kMaxLines)) return;
  glBegin(GL_LINES);
  for (double i = std::floor(vol.x.min); i <= vol.x.max; i++) {
    glVertex2d(i, vol.y.min);
    glVertex2d(i, vol.y.max);
  }
  for (double i = std::floor(vol.y.min); i <= vol.y.max; i++) {
    glVertex2d(vol.x.min, i);
    glVertex2d(vol.x.max, i);
  }
  glEnd();
  char text[32];
  const auto label = [&](double x, double y, double value) {
    std::snprintf(text, sizeof text, "%d", static_cast<int>(value));
    draw_string(static_cast<float>(x), static_cast<float>(y), 0, text);
  };
  for (double i = std::floor(vol.x.min); i <= vol.x.max; i++) label(i, 0, i);
  for (double i = std::floor(vol.y.min); i <= vol.y.max; i++) label(0, i, i);
}

void draw_string(float x, float y, float z, const char* string) {
  if (!string || !*string) return;
  double px, py;
  if (ToPixels().Place(x, y, z, false, &px, &py))
    pending.push_back({px, py, CurrentColor(), string});
}

void draw_string_multiline(float x, float y, float w, float h, const char* string, unsigned align) {
  if (!string || !*string) return;
  const ToPixels to_pixels;
  Bounds across(1e9, -1e9), up(1e9, -1e9);
  for (const float cx : {x, x + w})
    for (const float cy : {y, y + h}) {
      double px, py;
      if (!to_pixels.Place(cx, cy, 0, true, &px, &py)) return;
      across = Bounds(std::min(across.min, px), std::max(across.max, px));
      up = Bounds(std::min(up.min, py), std::max(up.max, py));
    }
  pending_paragraphs.push_back({{across, up, Alignment(align, kLeft, kRight),
                                 Alignment(align, kBottom, kTop), (align & kWrap) != 0},
                                CurrentColor(),
                                string});
}

void draw_speech_bubble(float x, float y, float z, const char* str) { draw_string(x, y, z, str); }

void draw_octagon(float w, float h, float m) { draw_octagon(0, 0, w, h, m); }

void draw_octagon(float x, float y, float w, float h, float m) {
  glBegin(GL_POLYGON);
  glVertex2f(x + m, y);
  glVertex2f(x + w + m, y);
  glVertex2f(x + w + 2 * m, y + m);
  glVertex2f(x + w + 2 * m, y + h + m);
  glVertex2f(x + w + m, y + h + 2 * m);
  glVertex2f(x + m, y + h + 2 * m);
  glVertex2f(x, y + h + m);
  glVertex2f(x, y + m);
  glEnd();
}

void draw_vector(double x, double y, double z) {
  glBegin(GL_LINES);
  glVertex3d(0, 0, 0);
  glVertex3d(x, y, z);
  glEnd();
}

void draw_origin(double len) {
  draw_vector(len, 0, 0);
  draw_vector(0, len, 0);
  draw_vector(0, 0, len);
}

void draw_array(float x, float y, float w, float h, float* data, size_t len, size_t offset,
                float min, float max) {
  if (len == 0) return;
  const float span = max > min ? max - min : 1.0f;
  const float step = w / static_cast<float>(len);
  glBegin(GL_LINE_STRIP);
  for (size_t i = 0; i < len; i++)
    glVertex2f(x + static_cast<float>(i) * step, y + (data[(i + offset) % len] - min) * h / span);
  glEnd();
  char text[64];
  std::snprintf(text, sizeof text, "min %.2f max %.2f", double{min}, double{max});
  draw_string(x, y, 0, text);
}

void draw_array(float x, float y, float w, float h, float* data, size_t len, size_t offset) {
  if (len == 0) return;
  const auto [min_value, max_value] = std::minmax_element(data, data + len);
  draw_array(x, y, w, h, data, len, offset, *min_value, *max_value);
}

void draw_centered_rect(float x, float y, float dx, float dy) {
  glRectf(x - dx / 2, y - dy / 2, x + dx / 2, y + dy / 2);
}

void MoveTextTo(draw::ScreenWriter* writer) {
  for (const PendingText& text : pending) writer->AddText(text.text, text.x, text.y, text.color);
  pending.clear();
  for (const PendingParagraph& p : pending_paragraphs) writer->AddParagraph(p.text, p.box, p.color);
  pending_paragraphs.clear();
}

}  // namespace Stg::Gl
