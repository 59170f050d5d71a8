// SPDX-License-Identifier: GPL-2.0-or-later
//
// Some drivers end the process that uses them: two drivers with different LLVM versions abort, a
// compiler crashes on an option or a damaged cache, a device hangs. So a child process tries first.

#ifndef STAGE_CL_PROBE_HH
#define STAGE_CL_PROBE_HH

#include <functional>
#include <string>

namespace Stg::cl {

/// Runs `task` in a child process and returns its result: an error message, or an empty string.
/// Also returns an error if a driver ends the child, or if a call takes longer than `seconds` (0:
/// no limit). If no process can be started, takes the risk and returns an empty string.
std::string Probe(const std::function<std::string()>& task, unsigned seconds);

}  // namespace Stg::cl

#endif
