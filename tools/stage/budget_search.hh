// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds by measurements how many of something fit into a time.

#ifndef STAGE_TOOLS_STAGE_BUDGET_SEARCH_HH
#define STAGE_TOOLS_STAGE_BUDGET_SEARCH_HH

#include <cstdint>
#include <functional>
#include <string>

namespace Stg::program {

/// The greatest number that fits.
struct Fit {
  uint32_t count = 0;
  bool is_lower_bound = false;  ///< the search ran out of time before a number did not fit
  double seconds = 0;           ///< for that many
};

/// The median of up to five calls, each of which returns seconds; fewer if they take long.
double MedianSeconds(const std::function<double()>& measure);

/// Searches for the greatest number for which `seconds_of` returns at most `seconds`. A measurement
/// takes at most about twice these. The whole search therefore takes about six times as long, or
/// slightly over eight seconds. `noun` is what is counted, for the display of progress, if any.
Fit SearchFit(double seconds, const std::function<double(uint32_t)>& seconds_of,
              const std::string& noun, bool shows_progress);

}  // namespace Stg::program

#endif
