// SPDX-License-Identifier: GPL-2.0-or-later
//
// --explain-ray: runs a world to some time and says why a ranger's sample reads what it reads.

#ifndef STAGE_TOOLS_STAGE_EXPLAIN_RAY_HH
#define STAGE_TOOLS_STAGE_EXPLAIN_RAY_HH

#include <cstdint>
#include <string>

#include "insight/ray_watch.hh"
#include "stage/options.hh"

namespace Stg::program {

/// ROBOT:RANGER:SENSOR:SAMPLE@SECONDS, as far as it can be read without a world.
struct RayChoice {
  std::string ranger;  ///< ROBOT:RANGER, ROBOT or RANGER
  uint32_t sensor = 0, sample = 0;
  double seconds = 0;
};

/// Throws UsageError.
RayChoice ParseRayChoice(const std::string& text);

/// The ranger that a choice names. Throws UsageError with names that there are.
ModelRanger* FindRanger(const World& world, const std::string& name);

/// Returns the status to exit with. Throws UsageError, std::runtime_error.
int ExplainRay(const Options& options);

/// A ray and the sensor that cast it.
struct ExplainedRay {
  const ModelRanger* ranger;
  uint32_t sensor, sample;
  RayExplanation ray;
  double reading() const { return ranger->GetSensors()[sensor].ranges[sample]; }
};
std::string RayText(const ExplainedRay& explained);
std::string RayJson(const ExplainedRay& explained);

}  // namespace Stg::program

#endif
