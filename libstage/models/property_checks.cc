// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/property_checks.hh"

#include <cmath>
#include <string>

#include "worldfile/worldfile.hh"

namespace Stg {

namespace {
std::string Start(const char* name) { return std::string("property \"") + name + "\": found "; }
}  // namespace

bool IsFinite(const Pose& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.z) &&
         std::isfinite(pose.a);
}

void CheckNotNegative(const Worldfile& wf, int entity, const char* name, double value) {
  if (value < 0) wf.Fail(entity, name, Start(name) + "a negative number, expected 0 or more");
}

void CheckInOrder(const Worldfile& wf, int entity, const char* name, double lower, double upper) {
  if (lower > upper)
    wf.Fail(entity, name,
            Start(name) + "the minimum above the maximum, expected the minimum first");
}

void CheckInOrder(const Worldfile& wf, int entity, const char* name, const Bounds* bounds,
                  int count) {
  for (int i = 0; i < count; i++) CheckInOrder(wf, entity, name, bounds[i].min, bounds[i].max);
}

void WarnIfEqual(Worldfile* wf, int entity, const char* name, double lower, double upper,
                 const char* effect) {
  if (lower == upper && wf->PropertyExists(entity, name))
    wf->Warn(entity, name,
             Start(name) +
                 "the minimum equal to the maximum, expected the maximum above the minimum; " +
                 effect);
}

}  // namespace Stg
