// SPDX-License-Identifier: GPL-2.0-or-later
//
// Results of rays. Part of <stage.hh>.

#ifndef STAGE_SENSING_RAY_HIT_HH
#define STAGE_SENSING_RAY_HIT_HH

#include <stdint.h>

namespace Stg {

class Model;

/// True if the ray of `finder` stops at `candidate`. Several threads may call it concurrently.
/// Within a step it must be a pure function of its arguments: one call may count for several rays.
typedef bool (*ray_test_func_t)(Model* candidate, const Model* finder, const void* arg);

namespace internal {
namespace sensing {

struct RayHit {
  double range;  ///< metres; the fan's range without a hit
  Model* model;  ///< null without a hit
};

/// Consecutive rays with a hit on the same model, or without a hit.
struct HitInterval {
  uint32_t end;  ///< index in the fan, one past the last ray
  Model* model;  ///< as in RayHit
};

/// Results of the rays of a fan.
struct RayHits {
  const double* ranges;          ///< one per sample, as in RayHit
  const HitInterval* intervals;  ///< contiguous; the last one ends at `count`
  uint32_t count;                ///< number of rays
};

/// The ranges of a fan's rays as a device gives them. Everything that they hit has the same
/// ranger_return.
struct DeviceRanges {
  const double* ranges;  ///< negative for rays that hit nothing; NaN: the device can't tell
  uint32_t count;        ///< number of rays
  double ranger_return;  ///< of everything that is hit
};

/// Receives the results of fans. Several threads may deliver different fans concurrently.
class RaySink {
 public:
  virtual ~RaySink() = default;
  /// Announces a call of ReceiveHits(), so that the memory it writes to can be prefetched.
  virtual void PrefetchHits(uint32_t /*tag*/) const {}
  /// `tag` is that of the fan.
  virtual void ReceiveHits(uint32_t tag, const RayHits& hits) = 0;
  /// Like ReceiveHits(), for fans whose ranges a device gives. Returns false, and has done nothing,
  /// if the host must trace the fan instead.
  virtual bool ReceiveRanges(uint32_t /*tag*/, const DeviceRanges& /*ranges*/) { return false; }
};

}  // namespace sensing
}  // namespace internal
}  // namespace Stg

#endif
