// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drawing helpers for Visualizer::Visualize() in the style of OpenGL 1. All need a current context.
// Text is drawn when the frame is finished, and only if requested within Visualize().

#ifndef STAGE_GUI_DRAW_GL_HELPERS_HH
#define STAGE_GUI_DRAW_GL_HELPERS_HH

#include <stddef.h>

#include "geometry/geometry.hh"

namespace Stg {

namespace Gl {

/// Multiplies the matrix by a translation and a rotation about z.
void pose_shift(const Pose& pose);
void pose_inverse_shift(const Pose& pose);
void coord_shift(double x, double y, double z, double a);
/// Draws 1 m grid lines over the box's x and y at z = 0, with numbers along the axes.
void draw_grid(bounds3d_t vol);
/// Draws text in the current colour, unless the point is outside of the frame.
void draw_string(float x, float y, float z, const char* string);
/// Draws upright text in a box with lower left corner (x, y) at z = 0 of the current frame. `align`
/// takes FLTK's bits FL_ALIGN_LEFT, _RIGHT, _TOP, _BOTTOM, and _WRAP to break lines that are too
/// long; the default is centred.
void draw_string_multiline(float x, float y, float w, float h, const char* string, unsigned align);
/// Draws the text alone, without a bubble.
void draw_speech_bubble(float x, float y, float z, const char* str);
/// Draws a rectangle with margin m and cut corners; its lower left corner is the origin or (x, y).
void draw_octagon(float w, float h, float m);
void draw_octagon(float x, float y, float w, float h, float m);
/// Draws a line from the origin to (x, y, z).
void draw_vector(double x, double y, double z);
/// Draws the three axes, `len` metres long.
void draw_origin(double len);
/// Draws a strip chart of a ring buffer whose oldest value is at `offset`.
void draw_array(float x, float y, float w, float h, float* data, size_t len, size_t offset,
                float min, float max);
/// Scales the chart to the minimum and maximum of the data.
void draw_array(float x, float y, float w, float h, float* data, size_t len, size_t offset);
void draw_centered_rect(float x, float y, float dx, float dy);

}  // namespace Gl
}  // namespace Stg

#endif
