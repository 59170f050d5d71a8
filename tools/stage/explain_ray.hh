// SPDX-License-Identifier: GPL-2.0-or-later
//
// --explain-ray: runs a world to a time and explains the reading of a ranger's sample.

#ifndef STAGE_TOOLS_STAGE_EXPLAIN_RAY_HH
#define STAGE_TOOLS_STAGE_EXPLAIN_RAY_HH

#include <cstdint>
#include <string>

#include "insight/ray_watch.hh"
#include "stage/options.hh"

namespace Stg::program {

/// ROBOT:RANGER:SENSOR:SAMPLE@SECONDS, parsed as far as possible without a world.
struct RayChoice {
  std::string ranger;  ///< ROBOT:RANGER, ROBOT or RANGER
  uint32_t sensor = 0, sample = 0;
  double seconds = 0;
};

/// Throws UsageError.
RayChoice ParseRayChoice(const std::string& text);

/// Returns the chosen ranger. Throws UsageError with a list of valid names.
ModelRanger* FindRanger(const World& world, const std::string& name);

/// Returns the exit status. Throws UsageError, std::runtime_error.
int ExplainRay(const Options& options);

/// A ray and its sensor.
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
