// SPDX-License-Identifier: GPL-2.0-or-later
//
// Groups sensors into kinds, for the summary of a world and for measuring its costs.

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

/// Fraction of the world's steps, each of length `step`, in which the model updates.
double UpdatesPerStep(const Model& model, usec_t step);

/// Sorted: subscribed kinds first, then by rays per step, most first.
std::vector<SensorGroup> SortSensors(const std::vector<Model*>& models, usec_t step);

}  // namespace Stg

#endif
