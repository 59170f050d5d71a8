// SPDX-License-Identifier: GPL-2.0-or-later
//
// Helpers for those who draw in Visualizer::Visualize(), the way OpenGL 1 does. All need a current
// context. Texts appear when the picture is finished; elsewhere than in Visualize() they are lost.

#ifndef STAGE_GUI_DRAW_GL_HELPERS_HH
#define STAGE_GUI_DRAW_GL_HELPERS_HH

#include <stddef.h>

#include "geometry/geometry.hh"

namespace Stg {

namespace Gl {

/// Multiplies the matrix by a translation and a turn about z.
void pose_shift(const Pose& pose);
void pose_inverse_shift(const Pose& pose);
void coord_shift(double x, double y, double z, double a);
/// 1 m lines over the box's x and y at z = 0, with numbers on the axes.
void draw_grid(bounds3d_t vol);
/// In the current colour; nothing if the point is out of the picture.
void draw_string(float x, float y, float z, const char* string);
/// Lines of text in a box whose lower left corner is (x, y), at z = 0 of the current frame; upright
/// whatever the frame. `align` (FLTK's Fl_Align): FL_ALIGN_LEFT, FL_ALIGN_RIGHT, FL_ALIGN_TOP,
/// FL_ALIGN_BOTTOM; in the middle otherwise. With FL_ALIGN_WRAP lines are broken to fit the width.
void draw_string_multiline(float x, float y, float w, float h, const char* string, unsigned align);
/// Only the text.
void draw_speech_bubble(float x, float y, float z, const char* str);
/// A rectangle plus a margin with cut corners; its lower left corner is the origin or (x, y).
void draw_octagon(float w, float h, float m);
void draw_octagon(float x, float y, float w, float h, float m);
/// From the origin.
void draw_vector(double x, double y, double z);
/// Three axes.
void draw_origin(double len);
/// A strip chart of a ring buffer whose oldest value is at `offset`.
void draw_array(float x, float y, float w, float h, float* data, size_t len, size_t offset,
                float min, float max);
/// With the extremes of the data.
void draw_array(float x, float y, float w, float h, float* data, size_t len, size_t offset);
void draw_centered_rect(float x, float y, float dx, float dy);

}  // namespace Gl
}  // namespace Stg

#endif
