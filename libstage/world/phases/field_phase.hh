// SPDX-License-Identifier: GPL-2.0-or-later
//
// Changes fields at the end of a step: ground sensors add what their robots have asked for, in the
// order of creation, and then the values of each field that is due spread and evaporate. Threads
// share the rows of a large field; see FieldValues for why that changes no bit.

#ifndef STAGE_WORLD_PHASES_FIELD_PHASE_HH
#define STAGE_WORLD_PHASES_FIELD_PHASE_HH

#include "geometry/geometry.hh"

namespace Stg {

class FieldValues;
class ModelField;
class WorldEngine;

class FieldPhase {
 public:
  /// `now` is the time of the step, which has the length `step`. Call it only if there are fields.
  static void Run(WorldEngine* engine, usec_t now, usec_t step);
  /// Seconds that an update of the field takes in which values of each row change. The field stays
  /// as it is.
  static double MeasureUpdate(const ModelField& field, WorldEngine* engine);

 private:
  static void AddDeposits(WorldEngine* engine, double seconds);
  static void Evolve(ModelField* field, usec_t now, WorldEngine* engine);
  static void Evolve(const ModelField& field, double seconds, FieldValues* values,
                     WorldEngine* engine);
};

}  // namespace Stg

#endif
