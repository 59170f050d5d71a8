// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_PICTURES_COLOR_HH
#define STAGE_PICTURES_COLOR_HH

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

  /// Looks up an X11 colour name as Lookup() does (`light blue`, `LightBlue`). Unknown and empty
  /// names give opaque red.
  explicit Color(const std::string& name);

  /// Opaque red.
  constexpr Color() : r(1.0), g(0.0), b(0.0), a(1.0) {}

  /// True if no channel differs by more than 1e-4.
  bool operator==(const Color& other) const;
  bool operator!=(const Color& other) const { return !(*this == other); }

  /// Sets *color, opaque, to an X11 colour: a name, ignoring case and blanks, or #RGB, #RRGGBB and
  /// so on with up to four hexadecimal digits per channel. Returns false for anything else.
  static bool Lookup(const std::string& name, Color* color);

  /// A random opaque colour, from RandomStream::Current() or from the given stream.
  static Color RandomColor();
  static Color RandomColor(RandomStream& random);

  /// Prints `PREFIX [r g b a]` with two decimals on standard output.
  void Print(const char* prefix) const;

  /// Reads the property `color` (a name or "random"), else `color_rgba` (four numbers), of an
  /// entity in a world file; keeps the colour if there is neither. Defined in
  /// worldfile/load_values.cc, so that geometry does not depend on the worldfile module.
  const Color& Load(Worldfile* wf, int entity);

  static const Color blue, red, green, yellow, magenta, cyan;
};

}  // namespace Stg

#endif
