// SPDX-License-Identifier: GPL-2.0-or-later
//
// The numbers of a field's scheme, and the brightness of pictures in its cells.

#ifndef STAGE_MODELS_TYPES_FIELD_EVOLUTION_HH
#define STAGE_MODELS_TYPES_FIELD_EVOLUTION_HH

#include <cstddef>

#include "models/field.hh"
#include "models/types/field_values.hh"
#include "pictures/picture.hh"

namespace Stg::field {

/// Largest number of substeps of an update. If a program asks for more, the field spreads by as
/// much as that many can do.
inline constexpr int kMaxSubsteps = 1000;

/// Number of substeps that an update of this length takes; kMaxSubsteps + 1 if there are more.
int CountSubsteps(const ModelField& field, double seconds);
/// One of `count` equal substeps of an update of this length.
FieldValues::Substep SubstepOf(const ModelField& field, double seconds, int count);

/// Mean brightness, from 0 to 1, of the pixels in a cell of a field that the picture covers.
double Brightness(const picture::Samples& picture, const FieldValues& values, size_t column,
                  size_t row);

}  // namespace Stg::field

#endif
