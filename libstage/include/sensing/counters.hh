// SPDX-License-Identifier: GPL-2.0-or-later
//
// Statistics of sensing. Part of <stage.hh>.

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
  uint64_t potential_hits = 0;  ///< cells whose bodies were examined
  uint64_t resumed = 0;         ///< rays whose full hit list was not sufficient
  uint64_t ranges_given = 0;    ///< rays whose ranges a device gave, without potential hits
};

/// Costs of a prefilter so far, for --stats.
struct PrefilterStatistics {
  double compile_seconds = 0;
  /// Wall-clock seconds of the host: preparing and sending data, waiting until the rays of the
  /// first part of a batch were walked, and waiting for hit lists.
  double send_seconds = 0, walk_seconds = 0, fetch_seconds = 0;
  uint64_t bytes_sent = 0, bytes_fetched = 0;
  /// Bytes copied: written by the host into memory that the device sees, or sent or fetched by a
  /// transfer. Bytes mapped: sizes of mapped ranges. Lists that the host reads where the device
  /// wrote them are mapped, not copied.
  uint64_t bytes_copied = 0, bytes_mapped = 0;
  bool shared_memory = false;  ///< host and device share memory, as far as the prefilter knows
};

/// Statistics of all batches so far.
struct TraceStatistics {
  double prefilter_seconds = 0;  ///< wall-clock time of waiting for the device; 0 without one
  double trace_seconds = 0;      ///< wall-clock time from rays (or hit lists) to readings
  uint64_t device_steps = 0;     ///< number of batches that went to the device
  uint64_t device_rays = 0;
  TraceCounters trace;
  std::string device;  ///< name of the device; empty if there is none
  PrefilterStatistics prefilter;
};

}  // namespace sensing
}  // namespace internal
}  // namespace Stg

#endif
