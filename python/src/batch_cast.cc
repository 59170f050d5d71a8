// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays from arbitrary poses in the worlds of a batch: in rows if they can be cast there, otherwise
// in World objects.

#include <algorithm>
#include <limits>

#include "batch.hh"
#include "gil.hh"
#include "world/world.hh"
#include "worlds/pool_access.hh"

namespace Stg::python {

namespace {

static_assert(sizeof(rows::Planar) == 3 * sizeof(double));

/// The range of rays in a world that does not exist.
constexpr double kNoRange = std::numeric_limits<double>::quiet_NaN();

rows::Casting CastingOf(const Batch::Cast& cast) {
  rows::Casting casting{cast.options.z, cast.options.robots, cast.range, {}, {}};
  for (const double bearing : cast.bearings) {
    casting.unit_vectors.push_back(internal::sensing::UnitVectorOf(bearing));
    casting.directions.push_back(internal::sensing::MakeDirection(casting.unit_vectors.back()));
  }
  return casting;
}

}  // namespace

/// Casts the rays of poses that follow each other and ignore the same robot at once.
void Batch::CastInWorld(uint32_t id, World* world, const Cast& cast, const double* poses,
                        double* ranges) const {
  const Crowd::Robots& robots = crowd_->robots()[pool_->Variant(id)];
  const std::vector<uint32_t>& ignored = cast.ignored;
  for (auto begin = ignored.begin(); begin != ignored.end();) {
    const auto end = std::find_if(begin, ignored.end(), [&](uint32_t i) { return i != *begin; });
    CastOptions options = cast.options;
    if (*begin < robots.size()) options.from = world->FindModel(robots[*begin].id);
    const auto first = static_cast<size_t>(begin - ignored.begin());
    const auto count = static_cast<size_t>(end - begin);
    std::vector<Pose> from;
    for (size_t i = first; i < first + count; i++)
      from.emplace_back(poses[3 * i], poses[3 * i + 1], 0, poses[3 * i + 2]);
    RayCaster(world, options)
        .Cast(from.data(), count, cast.bearings, cast.range, ranges + first * cast.bearings.size());
    begin = end;
  }
}

/// Returns false if the world is not in a row, or if its rays cannot be cast there.
bool Batch::CastInRow(uint32_t id, const rows::Casting& casting, const Cast& cast,
                      const double* poses, double* ranges) {
  const rows::Scene* const scene = PoolAccess::SceneOf(*pool_, id);
  if (!scene || !rows::Rows::CanCast(*scene, cast.options.ray_model, cast.range)) return false;
  const RowRobots& robots = crowd_->RobotsIn(*scene, pool_->Variant(id));
  std::vector<uint32_t> movers;
  for (const uint32_t robot : cast.ignored)
    movers.push_back(robot < robots.movers.size() ? robots.movers[robot] : RowRobots::kNone);
  const auto* const from = reinterpret_cast<const rows::Planar*>(poses);
  return PoolAccess::Cast(*pool_, id, casting, {from, movers.size()}, movers.data(), ranges);
}

void Batch::CastRays(const Indices& which, const Cast& cast, const double* poses, double* ranges) {
  const Use use(this);
  const GilRelease no_gil;
  constexpr size_t kBlock = 8;
  const size_t per_world = cast.ignored.size(), rays = per_world * cast.bearings.size();
  const rows::Casting casting = CastingOf(cast);
  pool_->Run((which.size() + kBlock - 1) / kBlock, [&](size_t block, unsigned) {
    for (size_t i = block * kBlock; i < std::min(which.size(), (block + 1) * kBlock); i++) {
      const double* const from = poses + 3 * i * per_world;
      double* const to = ranges + i * rays;
      if (CastInRow(which[i], casting, cast, from, to)) continue;
      const auto call = [&](World& world) { CastInWorld(which[i], &world, cast, from, to); };
      if (!PoolAccess::Look(*pool_, which[i], call)) std::fill_n(to, rays, kNoRange);
    }
  });
}

}  // namespace Stg::python
