// SPDX-License-Identifier: GPL-2.0-or-later
//
// Reading and writing the geometry types in world files. Implemented here so that the geometry
// module does not depend on this one.
#include <algorithm>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "pictures/color.hh"
#include "pictures/x11_colors.hh"
#include "worldfile/document.hh"
#include "worldfile/worldfile.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg {
namespace {

/// "; did you mean "dodger blue"?", or "" if no colour has a similar name.
std::string SimilarColor(const std::string& name) {
  const auto is_upper = [](char c) { return c >= 'A' && c <= 'Z'; };
  std::string lower = name;
  for (char& c : lower)
    if (is_upper(c)) c = static_cast<char>(c - 'A' + 'a');
  std::vector<std::string> names;  // every colour has a lower-case name
  for (const geometry::X11Color& color : geometry::X11Colors())
    if (std::ranges::none_of(color.name, is_upper)) names.emplace_back(color.name);
  const std::string similar = worldfile::FindSimilar(lower, names);
  return similar.empty() ? "" : "; did you mean " + worldfile::Quoted(similar) + "?";
}

}  // namespace

const Color& Color::Load(Worldfile* wf, int entity) {
  if (!wf->PropertyExists(entity, "color")) {
    wf->ReadTuple(entity, "color_rgba", 0, 4, "ffff", &r, &g, &b, &a);
    return *this;
  }
  const std::string name = wf->ReadString(entity, "color", "");
  *this = name == "random" ? RandomColor() : Color(name);
  Color ignored;
  if (!name.empty() && name != "random" && !Lookup(name, &ignored)) {
    wf->Warn(entity, "color",
             "found " + worldfile::Quoted(name) +
                 ", expected an X11 color name, such as \"red\" or "
                 "\"#ff0000\"; using red" +
                 SimilarColor(name));
  }
  return *this;
}

Size& Size::Load(Worldfile* wf, int section, const char* keyword) {
  wf->ReadTuple(section, keyword, 0, 3, "lll", &x, &y, &z);
  return *this;
}

void Size::Save(Worldfile* wf, int section, const char* keyword) const {
  wf->WriteTuple(section, keyword, 0, 3, "lll", x, y, z);
}

Pose& Pose::Load(Worldfile* wf, int section, const char* keyword) {
  wf->ReadTuple(section, keyword, 0, 4, "llla", &x, &y, &z, &a);
  return *this;
}

void Pose::Save(Worldfile* wf, int section, const char* keyword) {
  a = normalize(a);
  wf->WriteTuple(section, keyword, 0, 4, "llla", x, y, z, a);
}

Velocity& Velocity::Load(Worldfile* wf, int section, const char* keyword) {
  Pose::Load(wf, section, keyword);
  return *this;
}

Bounds& Bounds::Load(Worldfile* wf, int section, const char* keyword) {
  wf->ReadTuple(section, keyword, 0, 2, "ll", &min, &max);
  return *this;
}

}  // namespace Stg
