// SPDX-License-Identifier: GPL-2.0-or-later
//
// Predicts the cost of a run from the world's content, the measured cost of each part of a step,
// and the memory of this process.

#ifndef STAGE_TOOLS_STAGE_ESTIMATE_HH
#define STAGE_TOOLS_STAGE_ESTIMATE_HH

#include <string>
#include <vector>

#include "stage.hh"

namespace Stg::program {

/// Memory of the process in MB at three times.
struct MemoryReadings {
  double before = 0;  ///< before the world was loaded
  double after = 0;   ///< after loading the world and calling the controllers' Init functions
  double peak = 0;    ///< maximum so far
};

struct CostPart {
  std::string name;  ///< also used in JSON: lower case with underscores
  double value;      ///< milliseconds or MB
  std::string text;  ///< description for people
};

struct Estimate {
  std::vector<CostPart> step;    ///< milliseconds of real time for an average step
  double step_ms = 0;            ///< their sum
  std::vector<double> kind_ms;   ///< of these, per kind of sensor in SceneSummary::sensors
  std::vector<CostPart> memory;  ///< MB
  double memory_mb = 0;          ///< their sum
  double peak_mb = 0;            ///< memory_mb, or the peak while loading if that was higher
  double rays = 0;               ///< per step, of subscribed sensors, as far as known
};

/// One world's explanation.
struct Explanation {
  std::string file;
  World* world = nullptr;
  SceneSummary scene;
  StepCosts costs;
  MemoryReadings memory;
  Estimate estimate;
  double steps = 0;            ///< until its end; 0: unknown
  std::string why_not_closed;  ///< see WhyNotClosed()
};

Estimate MakeEstimate(const SceneSummary& scene, const StepCosts& costs,
                      const MemoryReadings& memory, const RunOptions& options);

/// Nanoseconds per ray of this kind on the path that a run will choose.
double RayNs(const SensorCost& cost, const RunOptions& options);

/// Returns suggestions that would pay off, best first, one sentence each.
std::vector<std::string> Hints(const Explanation& world);

}  // namespace Stg::program

#endif
