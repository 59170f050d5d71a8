// SPDX-License-Identifier: GPL-2.0-or-later
//
// Why does a ranger's sample read what it reads? Watches one ray of a world while it runs. The
// outcome of the run is the same.

#ifndef STAGE_INSIGHT_RAY_WATCH_HH
#define STAGE_INSIGHT_RAY_WATCH_HH

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "models/ranger.hh"
#include "sensing/ray_record.hh"
#include "world/world.hh"

namespace Stg {

/// The record of a ray, with names of the models, which may be gone when somebody reads it.
struct RayExplanation {
  usec_t time = 0;  ///< simulated, of the step in which the sensor updated
  sensing::RayRecord record;
  std::vector<std::vector<std::string>> models;  ///< of the questions of each potential hit
  std::string hit;                               ///< empty: nothing
};

class RayWatch : private sensing::RayObserver {
 public:
  /// The ranger outlives it. One watch at a time for each world.
  RayWatch(World* world, const ModelRanger& ranger, uint32_t sensor, uint32_t sample);
  ~RayWatch() override;
  RayWatch(const RayWatch&) = delete;
  RayWatch& operator=(const RayWatch&) = delete;

  /// Of the last time that the sensor cast the ray; null if it has not.
  const RayExplanation* last() const { return last_.get(); }

 private:
  void TakeRecord(const sensing::RayRecord& record) override;

  World& world_;
  std::unique_ptr<RayExplanation> last_;
};

}  // namespace Stg

#endif
