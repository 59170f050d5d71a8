// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a run of a world will take, worked out before it runs: from what is in it, what the parts
// of a step were measured to cost, and the memory of this process.

#ifndef STAGE_TOOLS_STAGE_ESTIMATE_HH
#define STAGE_TOOLS_STAGE_ESTIMATE_HH

#include <string>
#include <vector>

#include "stage.hh"

namespace Stg::program {

/// Memory of the process, MB.
struct MemoryReadings {
  double before = 0;  ///< the world was loaded
  double after = 0;   ///< that and its controllers' Init functions
  double peak = 0;    ///< until then
};

struct Part {
  std::string name;  ///< for JSON too: lower case, with underscores
  double value;      ///< milliseconds or MB
  std::string text;  ///< what it is, for people
};

struct Estimate {
  std::vector<Part> step;  ///< milliseconds of real time for an average step
  double step_ms = 0;      ///< their sum
  std::vector<double>
      kind_ms;               ///< of that: what each kind of sensors takes (SceneSummary::sensors)
  std::vector<Part> memory;  ///< MB
  double memory_mb = 0;      ///< their sum
  double peak_mb = 0;        ///< the same, or what loading took if that was more
  double rays = 0;           ///< a step, as far as known; of subscribed sensors
};

/// An explained world.
struct Explanation {
  std::string file;
  World* world = nullptr;
  SceneSummary scene;
  StepCosts costs;
  MemoryReadings memory;
  Estimate estimate;
  double steps = 0;  ///< until its end; 0: unknown
};

Estimate MakeEstimate(const SceneSummary& scene, const StepCosts& costs,
                      const MemoryReadings& memory, const RunOptions& options);

/// Nanoseconds for a ray of this kind, on the path that a run will choose.
double RayNs(const SensorCost& cost, const RunOptions& options);

/// Which knobs would pay, the best first; a sentence each.
std::vector<std::string> Hints(const Explanation& world);

}  // namespace Stg::program

#endif
