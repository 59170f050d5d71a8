// SPDX-License-Identifier: GPL-2.0-or-later
//
// Statistics of a run: counts and times.

#ifndef STAGE_WORLD_STATISTICS_HH
#define STAGE_WORLD_STATISTICS_HH

#include <stdint.h>

#include <string>

#include "sensing/counters.hh"

namespace Stg {

/// Wall-clock seconds, summed over all steps.
struct PhaseSeconds {
  double gather = 0;     ///< due models update; sensors fill the batch
  double prefilter = 0;  ///< the device finds potential hits; 0 without a device
  double trace = 0;      ///< rays are traced and turned into readings
  double move = 0;       ///< positions integrate, test collisions and are rasterized
  double callbacks = 0;  ///< controllers and world callbacks
  double energy = 0;     ///< power packs, and metrics
  double fields = 0;     ///< ground sensors deposit, fields spread and evaporate
};

struct RunStatistics {
  double load_seconds = 0;
  uint64_t steps = 0;
  uint64_t device_steps = 0;  ///< steps whose batch went to the device
  uint64_t device_rays = 0;
  PhaseSeconds seconds;
  internal::sensing::TraceCounters trace;
  std::string device;  ///< empty: none
  internal::sensing::PrefilterStatistics prefilter;
  unsigned threads = 1;
};

}  // namespace Stg

#endif
