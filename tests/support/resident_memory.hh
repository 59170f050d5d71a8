// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TESTS_SUPPORT_RESIDENT_MEMORY_HH
#define STAGE_TESTS_SUPPORT_RESIDENT_MEMORY_HH

#include <unistd.h>

#include <fstream>

/// Resident memory of this process, bytes; 0: unknown.
inline long ResidentMemory() {
  long total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

#endif
