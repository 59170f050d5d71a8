// SPDX-License-Identifier: GPL-2.0-or-later

#include "threads/processors.hh"

#include <sched.h>

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

/// By the affinity mask; 0 if it can't be read, as on machines with more processors than a
/// cpu_set_t has bits.
unsigned CountAllowedProcessors() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0 ? static_cast<unsigned>(CPU_COUNT(&set)) : 0;
}

/// Processors' worth of time that one group grants; 0: it has no limit. The text of cpu.max is
/// "150000 100000", microseconds in each period, or "max 100000".
double GrantOf(const std::string& folder) {
  std::istringstream both(TextOf(folder + "/cpu.max") + " " + TextOf(folder + "/cpu.cfs_quota_us") +
                          " " + TextOf(folder + "/cpu.cfs_period_us"));
  double quota = 0, period = 0;
  if (!(both >> quota >> period) || quota <= 0 || period <= 0) return 0;
  return quota / period;
}

/// The least of the limits of a group and of those above it; 0: none has any.
double LeastGrant(const std::string& mount, std::string group) {
  double least = 0;
  for (;;) {
    const double grant = GrantOf(mount + group);
    if (grant > 0) least = least > 0 ? std::min(least, grant) : grant;
    if (group.empty()) return least;
    group.resize(group.find_last_of('/'));
  }
}

/// The folder below the root that a line of /proc/self/cgroup tells of, such as "" for "0::/a/b"
/// and "/cpu,cpuacct" for "4:cpu,cpuacct:/a"; false if it is of no controller of processors.
bool FindMount(const std::string& controllers, std::string* folder) {
  if (!controllers.empty() && ("," + controllers + ",").find(",cpu,") == std::string::npos)
    return false;
  *folder = controllers.empty() ? "" : "/" + controllers;
  return true;
}

}  // namespace

unsigned CountGrantedProcessors(const std::string& groups, const std::string& root) {
  double least = 0;
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
    const double grant = LeastGrant(root + folder, group);
    if (grant > 0) least = least > 0 ? std::min(least, grant) : grant;
  }
  return least > 0 ? static_cast<unsigned>(std::max(1.0, std::min(least, 1e6))) : 0;
}

unsigned CountUsableProcessors() {
  unsigned count = CountAllowedProcessors();
  if (count == 0) count = std::max(1u, std::thread::hardware_concurrency());
  const unsigned granted = CountGrantedProcessors(TextOf("/proc/self/cgroup"), "/sys/fs/cgroup");
  return granted > 0 ? std::min(count, granted) : count;
}

}  // namespace Stg::threads
