// SPDX-License-Identifier: GPL-2.0-or-later
//
// Checks of values. The Check functions throw LoadError with the property's place.

#ifndef STAGE_MODELS_PROPERTY_CHECKS_HH
#define STAGE_MODELS_PROPERTY_CHECKS_HH

#include "geometry/geometry.hh"

namespace Stg {

class Worldfile;

/// `value` is the value of property `name`, or its default.
void CheckNotNegative(const Worldfile& wf, int entity, const char* name, double value);
/// Checks that two values of property `name` satisfy lower <= upper.
void CheckInOrder(const Worldfile& wf, int entity, const char* name, double lower, double upper);
/// Checks that each of `count` intervals satisfies min <= max.
void CheckInOrder(const Worldfile& wf, int entity, const char* name, const Bounds* bounds,
                  int count);

bool IsFinite(const Pose& pose);

/// Warns if the property is given and its two values are equal, which leaves no choice. `effect`
/// describes the consequence.
void WarnIfEqual(Worldfile* wf, int entity, const char* name, double lower, double upper,
                 const char* effect);

}  // namespace Stg

#endif
