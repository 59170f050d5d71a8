// SPDX-License-Identifier: GPL-2.0-or-later
//
// How many processors the process may use.

#ifndef STAGE_THREADS_PROCESSORS_HH
#define STAGE_THREADS_PROCESSORS_HH

#include <string>

namespace Stg::threads {

/// At least 1. That is what the scheduler's affinity mask allows (`taskset`), and no more than the
/// time that control groups grant (`docker --cpus`, Slurm, systemd's CPUQuota). Asks the system at
/// each call.
unsigned CountUsableProcessors();

/// Processors' worth of time that the control groups of a process grant, rounded down, at least 1;
/// 0: as much as it likes.
///
/// `groups`: the text of /proc/self/cgroup; `root`: where the control groups are mounted. Reads
/// cpu.max (version 2) or cpu.cfs_quota_us and cpu.cfs_period_us (version 1) of the process's group
/// and of all above it; the least counts.
unsigned CountGrantedProcessors(const std::string& groups, const std::string& root);

}  // namespace Stg::threads

#endif
