// SPDX-License-Identifier: GPL-2.0-or-later
#include "geometry/color.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "geometry/random.hh"
#include "geometry/x11_colors.hh"

namespace Stg {

// constinit: other files' static objects may use these before main() starts.
constinit const Color Color::blue(0, 0, 1);
constinit const Color Color::red(1, 0, 0);
constinit const Color Color::green(0, 1, 0);
constinit const Color Color::yellow(1, 1, 0);
constinit const Color Color::magenta(1, 0, 1);
constinit const Color Color::cyan(0, 1, 1);

Color::Color(const std::string& name) : Color() { Lookup(name, this); }

bool Color::operator==(const Color& other) const {
  constexpr double kTolerance = 1e-4;
  return std::fabs(r - other.r) <= kTolerance && std::fabs(g - other.g) <= kTolerance &&
         std::fabs(b - other.b) <= kTolerance && std::fabs(a - other.a) <= kTolerance;
}

bool Color::Lookup(const std::string& name, Color* color) {
  const auto table = geometry::X11Colors();
  const auto found =
      std::lower_bound(table.begin(), table.end(), name,
                       [](const geometry::X11Color& entry, const std::string& wanted) {
                         return entry.name < wanted;
                       });
  if (found == table.end() || found->name != name) return false;
  *color = Color(found->red / 255.0, found->green / 255.0, found->blue / 255.0);
  return true;
}

Color Color::RandomColor() { return RandomColor(RandomStream::Current()); }

Color Color::RandomColor(RandomStream& random) {
  Color color;
  color.r = random.Uniform();
  color.g = random.Uniform();
  color.b = random.Uniform();
  return color;
}

void Color::Print(const char* prefix) const {
  std::printf("%s [%.2f %.2f %.2f %.2f]\n", prefix, r, g, b, a);
}

}  // namespace Stg
