// SPDX-License-Identifier: GPL-2.0-or-later
//
// What sensing counts. Part of <stage.hh>.

#ifndef STAGE_SENSING_COUNTERS_HH
#define STAGE_SENSING_COUNTERS_HH

#include <stdint.h>

#include <string>

namespace Stg {
namespace internal {
namespace sensing {

/// Counters of a trace, summed over rays.
struct TraceCounters {
  uint64_t rays = 0;
  uint64_t potential_hits = 0;  ///< cells whose bodies were looked at
  uint64_t resumed = 0;         ///< rays whose full hit list did not suffice
};

/// What a prefilter did so far, for --stats.
struct PrefilterStatistics {
  double compile_seconds = 0;
  /// Of the host: getting data ready and handing them over, waiting until the rays of the first
  /// part of a batch were walked, and waiting for lists.
  double send_seconds = 0, walk_seconds = 0, fetch_seconds = 0;
  uint64_t bytes_sent = 0, bytes_fetched = 0;
  /// What that cost: bytes that the host wrote into memory which the device sees, plus those that
  /// were then sent or fetched by a transfer; and bytes of the ranges that it mapped. Lists that
  /// the host reads where the device wrote them are mapped, not copied.
  uint64_t bytes_copied = 0, bytes_mapped = 0;
  bool shared_memory = false;  ///< of host and device, as far as the prefilter knows
};

/// What became of batches so far.
struct TraceStatistics {
  double prefilter_seconds = 0;  ///< of the wall clock: the device walked; 0 without one
  double trace_seconds = 0;      ///< rays to hits to readings
  uint64_t device_steps = 0;     ///< batches that went to the device
  uint64_t device_rays = 0;
  TraceCounters trace;
  std::string device;  ///< empty: none
  PrefilterStatistics prefilter;
};

}  // namespace sensing
}  // namespace internal
}  // namespace Stg

#endif
