// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_GEOMETRY_COLOR_HH
#define STAGE_GEOMETRY_COLOR_HH

#include <string>

namespace Stg {

class RandomStream;
class Worldfile;

/// A colour: red, green, blue and opacity, nominally 0..1, stored as given.
class Color {
 public:
  double r, g, b, a;

  constexpr explicit Color(double red_part, double green_part, double blue_part,
                           double opacity = 1.0)
      : r(red_part), g(green_part), b(blue_part), a(opacity) {}

  /// An X11 colour name, spelled as X11 does (`light blue`, `LightBlue`). Any other name, the
  /// empty one too, gives opaque red.
  explicit Color(const std::string& name);

  /// Opaque red.
  constexpr Color() : r(1.0), g(0.0), b(0.0), a(1.0) {}

  /// Equal when no channel differs by more than 1e-4.
  bool operator==(const Color& other) const;
  bool operator!=(const Color& other) const { return !(*this == other); }

  /// Sets *color, opaque, if `name` is a colour as X11 spells it: a name, in which case and blanks
  /// do not matter, or #RGB, #RRGGBB and so on, up to four hexadecimal digits each. Else returns
  /// false.
  static bool Lookup(const std::string& name, Color* color);

  /// An opaque colour, from RandomStream::Current() or the stream given.
  static Color RandomColor();
  static Color RandomColor(RandomStream& random);

  /// Prints `PREFIX [r g b a]` with two decimals on standard output.
  void Print(const char* prefix) const;

  /// Reads the property `color` (a name or "random") or else `color_rgba` (four numbers) of a world
  /// file's entity; leaves the colour alone if there is neither. (In worldfile/load_values.cc, so
  /// that geometry stays free of the worldfile room.)
  const Color& Load(Worldfile* wf, int entity);

  static const Color blue, red, green, yellow, magenta, cyan;
};

}  // namespace Stg

#endif
