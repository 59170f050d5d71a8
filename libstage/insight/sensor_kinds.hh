// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sorting sensors into kinds: what explaining a world and measuring its costs have in common.

#ifndef STAGE_INSIGHT_SENSOR_KINDS_HH
#define STAGE_INSIGHT_SENSOR_KINDS_HH

#include <vector>

#include "insight/explain.hh"
#include "models/model.hh"

namespace Stg {

struct SensorGroup {
  SensorKind kind;
  std::vector<Model*> models;  ///< in the order of creation
};

/// The share of a world's steps, of length `step`, in which a model updates.
double UpdatesPerStep(const Model& model, usec_t step);

/// Subscribed kinds first, those with the most rays a step first.
std::vector<SensorGroup> SortSensors(const std::vector<Model*>& models, usec_t step);

}  // namespace Stg

#endif
