// SPDX-License-Identifier: GPL-2.0-or-later
//
// What values of properties have to be. Each throws LoadError with the place of the property.

#ifndef STAGE_MODELS_PROPERTY_CHECKS_HH
#define STAGE_MODELS_PROPERTY_CHECKS_HH

#include "geometry/geometry.hh"

namespace Stg {

class Worldfile;

/// `value` is what the property of that name said, or its default.
void CheckNotNegative(const Worldfile& wf, int entity, const char* name, double value);
/// `lower` and `upper` are two values of it, as messages call them.
void CheckInOrder(const Worldfile& wf, int entity, const char* name, double lower, double upper);
/// The same of `count` intervals.
void CheckInOrder(const Worldfile& wf, int entity, const char* name, const Bounds* bounds,
                  int count);

/// Warns if the property is given and its two values are equal, which leaves no choice; `effect`
/// tells what follows from that.
void WarnIfEqual(Worldfile* wf, int entity, const char* name, double lower, double upper,
                 const char* effect);

}  // namespace Stg

#endif
