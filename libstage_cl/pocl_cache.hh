// SPDX-License-Identifier: GPL-2.0-or-later
//
// PoCL, the driver for CPUs, caches compiled kernels in a folder. If it cannot write there, it
// fails in many ways.

#ifndef STAGE_CL_POCL_CACHE_HH
#define STAGE_CL_POCL_CACHE_HH

#include <string>

namespace Stg::cl {

/// Gives PoCL a private cache folder. Without a home directory it would use a folder in /tmp, which
/// anyone may have created, and run the code in it. Call it before drivers are loaded.
void KeepPoclCachePrivate();

/// If the named driver is PoCL and cannot write to its cache, returns text to append to an error
/// message; otherwise an empty string.
std::string WhyPoclCantWrite(const std::string& driver);
/// Like WhyPoclCantWrite(), for a crash, which damaged cache files may cause as well.
std::string WhyPoclCrashes(const std::string& driver);

}  // namespace Stg::cl

#endif
