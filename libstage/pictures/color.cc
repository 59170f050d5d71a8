// SPDX-License-Identifier: GPL-2.0-or-later
#include "pictures/color.hh"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "pictures/x11_colors.hh"
#include "random/random.hh"

namespace Stg {

// constinit, because static objects of other files may use these before main() starts.
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

namespace {

const geometry::X11Color* FindExactly(const std::string& name) {
  const auto table = geometry::X11Colors();
  const auto found = std::ranges::lower_bound(table, name, {}, &geometry::X11Color::name);
  return found == table.end() || found->name != name ? nullptr : &*found;
}

/// Normalizes a name: X11 ignores case and blanks.
std::string Folded(std::string_view name) {
  std::string folded;
  for (const char c : name)
    if (c != ' ') folded += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return folded;
}

const geometry::X11Color* FindFolded(const std::string& name) {
  const std::string folded = Folded(name);
  for (const geometry::X11Color& entry : geometry::X11Colors())
    if (Folded(entry.name) == folded) return &entry;
  return nullptr;
}

/// Parses "#RGB" with one to four hexadecimal digits per channel. As in X11, the value is a
/// fraction of the largest number with that many digits.
bool ReadDigits(std::string_view text, Color* color) {
  const size_t digits = (text.size() - 1) / 3;
  if (text[0] != '#' || text.size() % 3 != 1 || digits < 1 || digits > 4) return false;
  double parts[3];
  for (size_t i = 0; i < 3; i++) {
    unsigned value = 0;
    const char* const end = text.data() + 1 + (i + 1) * digits;
    const auto [at, error] = std::from_chars(end - digits, end, value, 16);
    if (error != std::errc() || at != end) return false;
    parts[i] = value / (std::ldexp(1.0, static_cast<int>(4 * digits)) - 1);
  }
  *color = Color(parts[0], parts[1], parts[2]);
  return true;
}

}  // namespace

bool Color::Lookup(const std::string& name, Color* color) {
  if (name.empty()) return false;
  if (name[0] == '#') return ReadDigits(name, color);
  const geometry::X11Color* found = FindExactly(name);
  if (!found) found = FindFolded(name);
  if (!found) return false;
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
