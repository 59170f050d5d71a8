// SPDX-License-Identifier: GPL-2.0-or-later
//
// Number of processors that the process may use.

#ifndef STAGE_THREADS_PROCESSORS_HH
#define STAGE_THREADS_PROCESSORS_HH

#include <string>

namespace Stg::threads {

/// Number of processors in the affinity mask (`taskset`), at least 1, reduced to the CPU time that
/// control groups grant (`docker --cpus`, Slurm, systemd's CPUQuota). Asks the system at each call.
unsigned CountUsableProcessors();

/// CPU limit of the process's control groups in processors, rounded down but at least 1. Returns 0
/// if there is no limit.
///
/// `groups` is the text of /proc/self/cgroup, `root` the mount point of the control groups. Reads
/// cpu.max (version 2) or cpu.cfs_quota_us and cpu.cfs_period_us (version 1) of the process's group
/// and its ancestors; the smallest limit counts.
unsigned CountGrantedProcessors(const std::string& groups, const std::string& root);

}  // namespace Stg::threads

#endif
