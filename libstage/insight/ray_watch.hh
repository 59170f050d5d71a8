// SPDX-License-Identifier: GPL-2.0-or-later
//
// Explains why a ranger's sample has its value: records one ray of a running world. Recording does
// not change the results of the simulation.

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

/// Record of a ray. Models are stored by name because they may be deleted before it is read.
struct RayExplanation {
  usec_t time = 0;  ///< simulated time of the step in which the sensor updated
  sensing::RayRecord record;
  std::vector<std::vector<std::string>> models;  ///< models tested at each potential hit
  std::string hit;                               ///< model that the ray hit; empty: none
};

class RayWatch : private sensing::RayObserver {
 public:
  /// The ranger must outlive the watch. Only one watch per world at a time.
  RayWatch(World* world, const ModelRanger& ranger, uint32_t sensor, uint32_t sample);
  ~RayWatch() override;
  RayWatch(const RayWatch&) = delete;
  RayWatch& operator=(const RayWatch&) = delete;

  /// The latest record; null if the sensor has not cast the ray yet.
  const RayExplanation* last() const { return last_.get(); }

 private:
  void ReceiveRecord(const sensing::RayRecord& record) override;

  World& world_;
  std::unique_ptr<RayExplanation> last_;
};

}  // namespace Stg

#endif
