// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the value types of the geometry room are read from a world file and written to one. It is
// here so that geometry does not depend on this room.
#include <string>

#include "geometry/color.hh"
#include "geometry/geometry.hh"
#include "worldfile/document.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

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
             "found " + worldfile::Quoted(name) + ", expected the name of a colour; using red");
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
