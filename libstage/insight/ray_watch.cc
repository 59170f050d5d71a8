// SPDX-License-Identifier: GPL-2.0-or-later

#include "insight/ray_watch.hh"

#include "world/engine.hh"

namespace Stg {

RayWatch::RayWatch(World* world, const ModelRanger& ranger, uint32_t sensor, uint32_t sample)
    : world_(*world) {
  world_.engine().tracer.Observe(&ranger, sensor, sample, ranger.TagOfRay(sensor, sample), this);
}

RayWatch::~RayWatch() { world_.engine().tracer.Observe(nullptr, 0, 0, 0, nullptr); }

void RayWatch::ReceiveRecord(const sensing::RayRecord& record) {
  last_ = std::make_unique<RayExplanation>();
  last_->time = world_.SimTimeNow();
  last_->record = record;
  for (const sensing::RayRecord::PotentialHit& cell : record.potential_hits) {
    std::vector<std::string>& names = last_->models.emplace_back();
    for (const sensing::RayRecord::BodyTest& test : cell.tests)
      names.push_back(test.model->TokenStr());
  }
  if (record.hit.model) last_->hit = record.hit.model->TokenStr();
}

}  // namespace Stg
