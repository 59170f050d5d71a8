// SPDX-License-Identifier: GPL-2.0-or-later
//
// PoCL, the driver for processors, works through files: it keeps what it has compiled in a folder,
// and fails in many ways where it can't.

#ifndef STAGE_CL_POCL_CACHE_HH
#define STAGE_CL_POCL_CACHE_HH

#include <string>

namespace Stg::cl {

/// Without a home, PoCL would take a folder in /tmp that anybody may have made, and run the code
/// that lies there. It is told to take one of this user's own. Before drivers are loaded.
void KeepPoclCachePrivate();

/// Why the driver of this name fails, if it is PoCL and can't write there: text to append to the
/// failure. Nothing otherwise.
std::string WhyPoclCantWrite(const std::string& driver);
/// The same for a driver that crashes, which files that are damaged may cause as well.
std::string WhyPoclCrashes(const std::string& driver);

}  // namespace Stg::cl

#endif
