// SPDX-License-Identifier: GPL-2.0-or-later
//
// RayCaster: casts many rays from arbitrary poses, as localization needs. Part of <stage.hh>.

#ifndef STAGE_WORLD_RAY_CASTER_HH
#define STAGE_WORLD_RAY_CASTER_HH

#include <stddef.h>
#include <stdint.h>

#include <limits>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/ray_model.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class Model;
class World;

/// Selects what rays hit among the models that rangers see (ranger_return is not negative).
struct CastOptions {
  double z;            ///< height of the rays, metres; NaN: they hit bodies at any height
  bool robots;         ///< whether rays hit models of trees whose root is a position
  const Model* from;   ///< rays do not hit its tree; may be null
  RayModel ray_model;  ///< what ranges are measured to; kDefault: the world's

  CastOptions()
      : z(std::numeric_limits<double>::quiet_NaN()),
        robots(false),
        from(NULL),
        ray_model(RayModel::kDefault) {}
};

/// Casts fans of rays with equal bearings from many poses. They are traced as one batch on the
/// threads of the world, and on its OpenCL device where that is faster. Ranges are bit-equal to
/// those of a ranger without noise.
class RayCaster : private internal::sensing::RaySink {
 public:
  /// The world must outlive the caster.
  explicit RayCaster(World* world, const CastOptions& options = CastOptions());
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// From each of `count` poses (global; z has no effect), casts ray k in the direction heading +
  /// bearings[k] (radians). Stores metres in ranges[i * bearings.size() + k]: `range` if nothing
  /// was hit, if the pose is not finite, or if `range` is not positive. `range` may be infinite.
  ///
  /// Call it between steps. Returns false with a message during a step or while the world is
  /// loaded. Needs about 300 bytes per pose and 12 per ray meanwhile; split millions of poses into
  /// several calls.
  bool Cast(const Pose* poses, size_t count, const std::vector<double>& bearings, meters_t range,
            double* ranges);

 private:
  void FindSeen();
  void PlaceFans(const Pose* poses, size_t count, meters_t range, uint32_t samples,
                 uint32_t first_direction);
  void OrderByPlace(const Pose* poses, size_t count);
  void SortOrder();
  template <typename F>
  void ForEachSlice(size_t count, F f);
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  World& world_;
  const CastOptions options_;
  std::vector<char> seen_;  // by model id
  double* ranges_;          // destination of the current call
  struct Place {
    uint64_t key;  // similar for neighbours in the plane
    uint32_t pose;
  };
  std::vector<Place> order_;  // order of the poses in the batch
};

}  // namespace Stg

#endif
