// SPDX-License-Identifier: GPL-2.0-or-later
//
// RayCaster: very many rays at once, from anywhere, as localization wants them. Part of <stage.hh>.

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

/// What rays meet: what rangers see, that is all models but those with a negative ranger_return.
struct CastOptions {
  double z;           ///< height of the rays, metres; not a number: they meet what is at any height
  bool robots;        ///< they meet trees of models whose root is a position; false: only the rest
  const Model* from;  ///< they don't meet its tree; may be null
  RayModel ray_model;  ///< what ranges go to; kDefault: the world's

  CastOptions()
      : z(std::numeric_limits<double>::quiet_NaN()),
        robots(false),
        from(NULL),
        ray_model(RayModel::kDefault) {}
};

/// Casts fans of rays, all of the same bearings, from many poses. They are walked like those of
/// rangers: as one batch, on the threads of the world, and on its OpenCL device where that is
/// faster; ranges are to the last bit what a ranger without noise reads there.
class RayCaster : private internal::sensing::RaySink {
 public:
  /// The world must live as long as it is used.
  explicit RayCaster(World* world, const CastOptions& options = CastOptions());
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// From each of `count` poses (global; z has no effect), ray k in the direction of its heading
  /// plus bearings[k] (radians). ranges[i * bearings.size() + k] gets metres: `range` where nothing
  /// was hit, where the pose is not finite, and if `range` is not positive. It may be infinite.
  ///
  /// Between steps. False, with a message, within a step or while the world is loaded. Takes some
  /// 300 bytes for each pose meanwhile, and 12 for each ray: who has millions of poses makes
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
  void ForEachShare(size_t count, F f);
  void TakeHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  World& world_;
  const CastOptions options_;
  std::vector<char> seen_;  // of each model, by its number
  double* ranges_;          // of the call
  struct Place {
    uint64_t key;  // of neighbours in the plane, much the same
    uint32_t pose;
  };
  std::vector<Place> order_;  // in which the poses come into the batch
};

}  // namespace Stg

#endif
