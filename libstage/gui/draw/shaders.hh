// SPDX-License-Identifier: GPL-2.0-or-later
//
// GLSL sources. The uniform `matrix` maps world to clip coordinates.

#ifndef STAGE_GUI_DRAW_SHADERS_HH
#define STAGE_GUI_DRAW_SHADERS_HH

namespace Stg::draw {

/// Outputs the interpolated colour unchanged.
inline constexpr char kColorFragment[] = R"(#version 140
in vec4 shade;
out vec4 fragment;
void main() { fragment = shade; }
)";

/// Instanced bodies. `height` scales z (0 draws footprints), `brightness` scales the colour.
inline constexpr char kBodyVertex[] = R"(#version 140
uniform mat4 matrix;
uniform float height, brightness;
in vec3 corner;
in vec4 color;
in vec4 place;
out vec4 shade;
void main() {
  float c = cos(place.w), s = sin(place.w);
  vec2 plan = mat2(c, s, -s, c) * corner.xy + place.xy;
  gl_Position = matrix * vec4(plan, height * (corner.z + place.z), 1.0);
  shade = vec4(color.rgb * brightness, color.a);
}
)";

/// Points, lines and triangles in world coordinates.
inline constexpr char kPlainVertex[] = R"(#version 140
uniform mat4 matrix;
in vec3 corner;
in vec4 color;
out vec4 shade;
void main() {
  gl_Position = matrix * vec4(corner, 1.0);
  shade = color;
}
)";

/// Areas swept by rays: a triangle fan from the sensor to its ray ends. `corner` is the sensor's
/// pose (x, y, z, heading), `place` the index of its first ray end.
inline constexpr char kFanVertex[] = R"(#version 140
uniform mat4 matrix;
uniform samplerBuffer tips;
in vec4 corner;
in uint place;
in vec4 color;
out vec4 shade;
void main() {
  vec2 end = vec2(0.0);
  if (gl_VertexID > 0) {
    vec2 tip = texelFetch(tips, int(place) + gl_VertexID - 1).rg;
    float c = cos(corner.w), s = sin(corner.w);
    end = vec2(tip.x * c - tip.y * s, tip.x * s + tip.y * c);
  }
  gl_Position = matrix * vec4(corner.xy + end, corner.z, 1.0);
  shade = color;
}
)";

/// The floor: squares of 1 m, blended to one colour where they get smaller than pixels.
inline constexpr char kFloorVertex[] = R"(#version 140
uniform mat4 matrix;
in vec3 corner;
out vec2 metres;
void main() {
  gl_Position = matrix * vec4(corner, 1.0);
  metres = corner.xy;
}
)";
inline constexpr char kFloorFragment[] = R"(#version 140
uniform float checked;
in vec2 metres;
out vec4 fragment;
void main() {
  vec2 square = floor(metres);
  float odd = mod(square.x + square.y, 2.0);
  vec2 grain = fwidth(metres);
  float mixed = clamp(2.0 * max(grain.x, grain.y) - 0.5, 0.0, 1.0);
  float blue = checked * mix(odd, 0.5, mixed);
  fragment = vec4(mix(vec3(1.0), vec3(0.961, 0.961, 1.0), blue), 1.0);
}
)";

/// Text and boxes in canvas pixels. A negative u marks a plain area.
inline constexpr char kTextVertex[] = R"(#version 140
uniform vec2 canvas;
in vec4 corner;
in vec4 color;
out vec4 shade;
out vec2 letter;
void main() {
  gl_Position = vec4(2.0 * corner.xy / canvas - 1.0, 0.0, 1.0);
  letter = corner.zw;
  shade = color;
}
)";
inline constexpr char kTextFragment[] = R"(#version 140
uniform sampler2D atlas;
in vec4 shade;
in vec2 letter;
out vec4 fragment;
void main() {
  float opacity = letter.x < 0.0 ? 1.0 : texture(atlas, letter).r;
  fragment = vec4(shade.rgb, shade.a * opacity);
}
)";

}  // namespace Stg::draw

#endif
