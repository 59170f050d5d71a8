// SPDX-License-Identifier: GPL-2.0-or-later

#include "threads/processors.hh"

#ifdef __linux__
#include <sched.h>
#endif

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>

namespace Stg::threads {

namespace {

std::string TextOf(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Number of processors in the affinity mask. Returns 0 if the mask cannot be read, as on machines
/// with more processors than a cpu_set_t has bits, and on systems without such masks.
unsigned CountAllowedProcessors() {
#ifdef __linux__
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return static_cast<unsigned>(CPU_COUNT(&set));
#endif
  return 0;
}

/// CPU limit of one control group, in processors; 0 means no limit. cpu.max holds quota and period
/// in microseconds ("150000 100000"), or "max 100000".
double ReadLimit(const std::string& folder) {
  std::istringstream both(TextOf(folder + "/cpu.max") + " " + TextOf(folder + "/cpu.cfs_quota_us") +
                          " " + TextOf(folder + "/cpu.cfs_period_us"));
  double quota = 0, period = 0;
  if (!(both >> quota >> period) || quota <= 0 || period <= 0) return 0;
  return quota / period;
}

/// The smallest limit of a control group and its ancestors; 0 means no limit.
double MinLimit(const std::string& mount, std::string group) {
  double limit = 0;
  for (;;) {
    const double grant = ReadLimit(mount + group);
    if (grant > 0) limit = limit > 0 ? std::min(limit, grant) : grant;
    if (group.empty()) return limit;
    group.resize(group.find_last_of('/'));
  }
}

/// Sets *folder, below the mount point, for the controllers of a line of /proc/self/cgroup: "" for
/// "0::/a/b", "/cpu,cpuacct" for "4:cpu,cpuacct:/a". Returns false if the CPU is not among them.
bool FindMount(const std::string& controllers, std::string* folder) {
  if (!controllers.empty() && ("," + controllers + ",").find(",cpu,") == std::string::npos)
    return false;
  *folder = controllers.empty() ? "" : "/" + controllers;
  return true;
}

}  // namespace

unsigned CountGrantedProcessors(const std::string& groups, const std::string& root) {
  double limit = 0;
  std::istringstream lines(groups);
  for (std::string line; std::getline(lines, line);) {
    const size_t first = line.find(':');
    const size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    std::string folder;
    if (second == std::string::npos || second + 1 >= line.size() || line[second + 1] != '/' ||
        !FindMount(line.substr(first + 1, second - first - 1), &folder))
      continue;
    std::string group = line.substr(second + 1);
    if (group == "/") group.clear();
    const double grant = MinLimit(root + folder, group);
    if (grant > 0) limit = limit > 0 ? std::min(limit, grant) : grant;
  }
  return limit > 0 ? static_cast<unsigned>(std::max(1.0, std::min(limit, 1e6))) : 0;
}

unsigned CountUsableProcessors() {
  unsigned count = CountAllowedProcessors();
  if (count == 0) count = std::max(1u, std::thread::hardware_concurrency());
  const unsigned granted = CountGrantedProcessors(TextOf("/proc/self/cgroup"), "/sys/fs/cgroup");
  return granted > 0 ? std::min(count, granted) : count;
}

}  // namespace Stg::threads
