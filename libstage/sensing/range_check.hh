// SPDX-License-Identifier: GPL-2.0-or-later
//
// A test of devices that find ranges: compilers may fuse products and sums although the kernels
// forbid it.

#ifndef STAGE_SENSING_RANGE_CHECK_HH
#define STAGE_SENSING_RANGE_CHECK_HH

#include "sensing/prefilter.hh"

namespace Stg::internal::sensing {

/// Traces rays of both models in a small random grid on the device and on the host. Returns true if
/// the ranges have the same bits. Throws PrefilterError.
bool FindsRangesOfHost(Prefilter* prefilter);

}  // namespace Stg::internal::sensing

#endif
