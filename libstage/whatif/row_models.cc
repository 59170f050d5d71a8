// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/row_models.hh"

#include <algorithm>
#include <cmath>

#include "models/model.hh"
#include "motion/drive.hh"
#include "rows/device_rows.hh"
#include "rows/in_mover.hh"
#include "rows/planar.hh"
#include "whatif/command_check.hh"
#include "whatif/command_values.hh"
#include "world/world.hh"

namespace Stg::whatif {

RowModels::RowModels(const rows::Scene& scene, const std::vector<uint32_t>& watched)
    : scene_(scene) {
  for (const uint32_t model : watched) {
    Watched found = Find(model);
    if (found.mover != kStands) {
      const auto known = std::ranges::find(watched_movers_, static_cast<uint32_t>(found.mover));
      found.place = static_cast<size_t>(known - watched_movers_.begin());
      if (known == watched_movers_.end())
        watched_movers_.push_back(static_cast<uint32_t>(found.mover));
    }
    watched_.push_back(found);
  }
}

size_t RowModels::RobotOf(uint32_t model) const {
  const std::optional<uint32_t> mover = scene_.FindMover(model);
  return mover && scene_.movers[*mover].robot ? *mover : kStands;
}

bool RowModels::CanApply(const Command& command) const {
  const Model* const model = scene_.prototype->FindModel(command.model);
  CommandCheck::Check(command, model);
  const size_t robot = RobotOf(command.model);
  const bool runs = robot != kStands && scene_.movers[robot].runs;
  CommandCheck::CheckMotion(command, *model, runs);
  if (!runs) return robot == kStands;  // it has no effect
  const rows::Planar value = rows::PlanarOf(ValueOf(command));
  return std::isfinite(value.x) && std::isfinite(value.y) && std::isfinite(value.a);
}

void RowModels::Apply(const Command& command, rows::Rows* rows, size_t row) const {
  const size_t robot = RobotOf(command.model);
  if (robot == kStands) return;
  const size_t i = row * scene_.movers.size() + robot;
  rows->columns.mode[i] = static_cast<uint8_t>(ModeOf(command.kind));
  rows->columns.command[i] = rows::PlanarOf(ValueOf(command));
}

RowModels::Watched RowModels::Find(uint32_t id) const {
  Watched watched;
  const Model* const model = scene_.prototype->FindModel(id);
  if (!model) return watched;
  watched.seen.pose = model->GetGlobalPose();
  watched.seen.stalled = model->Stalled();
  rows::ForEachInMovers(*scene_.prototype, scene_, [&](const Model* part, rows::InMover at) {
    if (part != model) return;
    watched.mover = at.mover;
    watched.node = at.node;
  });
  return watched;
}

std::optional<row_given_t> RowModels::Given(const Command& command, size_t row) const {
  const size_t robot = RobotOf(command.model);
  if (robot == kStands) return std::nullopt;
  const rows::Planar value = rows::PlanarOf(ValueOf(command));
  return row_given_t{{value.x, value.y, value.a},
                     static_cast<uint32_t>(row),
                     static_cast<uint32_t>(robot),
                     static_cast<uint32_t>(ModeOf(command.kind)),
                     0};
}

/// Movers change neither their heights nor their shapes.
Sighting RowModels::See(const Watched& watched, const Seen& seen) const {
  Sighting sighting = watched.seen;
  const rows::Mover& mover = scene_.movers[watched.mover];
  sighting.pose = mover.GlobalPoseOf(watched.node, rows::PoseOf(seen.pose, mover.z));
  sighting.pose.z = watched.seen.pose.z;
  if (watched.node > 0) return sighting;
  sighting.stalled = seen.stalled;
  if (mover.robot) sighting.velocity = rows::VelocityOf(seen.velocity);
  return sighting;
}

void RowModels::Watch(const rows::Rows& rows, size_t row, std::vector<Sighting>* to) const {
  const rows::Columns& c = rows.columns;
  for (const Watched& watched : watched_) {
    const size_t i = row * scene_.movers.size() + watched.mover;
    to->push_back(watched.mover == kStands
                      ? watched.seen
                      : See(watched, {c.pose[i], c.velocity[i], c.stalled[i] != 0}));
  }
}

void RowModels::Watch(const double* numbers, std::vector<Sighting>* to) const {
  for (const Watched& watched : watched_) {
    const double* const n = numbers + rows::DeviceRows::kWatchedNumbers * watched.place;
    to->push_back(watched.mover == kStands
                      ? watched.seen
                      : See(watched, {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6] != 0}));
  }
}

}  // namespace Stg::whatif
