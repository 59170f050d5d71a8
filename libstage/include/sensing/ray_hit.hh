// SPDX-License-Identifier: GPL-2.0-or-later
//
// What becomes of a ray. Part of <stage.hh>.

#ifndef STAGE_SENSING_RAY_HIT_HH
#define STAGE_SENSING_RAY_HIT_HH

#include <stdint.h>

namespace Stg {

class Model;

/// True if the ray of `finder` stops at `candidate`. May be called by several threads at once. It
/// must say the same of the same arguments within a step: it is not asked again for each ray.
typedef bool (*ray_test_func_t)(Model* candidate, const Model* finder, const void* arg);

namespace internal {
namespace sensing {

struct RayHit {
  double range;  ///< metres; that of the fan if nothing was hit
  Model* model;  ///< null if nothing was hit
};

/// Neighbouring rays that have hit the same model, or nothing.
struct HitRun {
  uint32_t end;  ///< the number of the ray behind the last one, in its fan
  Model* model;  ///< as in RayHit
};

/// What the rays of a fan have hit.
struct RayHits {
  const double* ranges;  ///< as in RayHit: one for each sample
  const HitRun* runs;    ///< one after the other; the last one ends at `count`
  uint32_t count;        ///< of rays
};

/// Takes the outcome of fans. Different fans may be handed over by different threads at once.
class RaySink {
 public:
  virtual ~RaySink() = default;
  /// Says that TakeHits() will be called soon: what it writes to may be fetched meanwhile.
  virtual void ExpectHits(uint32_t /*tag*/) const {}
  /// `tag` is the one that came with the fan.
  virtual void TakeHits(uint32_t tag, const RayHits& hits) = 0;
};

}  // namespace sensing
}  // namespace internal
}  // namespace Stg

#endif
