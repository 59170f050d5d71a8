// SPDX-License-Identifier: GPL-2.0-or-later
//
// Some drivers end the process that uses them: two with different LLVMs in them abort, a compiler
// crashes over an option or over a damaged cache, a device hangs. So a child process tries first.

#ifndef STAGE_CL_PROBE_HH
#define STAGE_CL_PROBE_HH

#include <functional>
#include <string>

namespace Stg::cl {

/// Runs `task` in a child process. It returns what is wrong, nothing if all is well; so does this,
/// also if a driver ends the child, or if a call of it takes longer than `seconds` (0: no limit).
/// Where no process can be had it takes the risk, and says that all is well.
std::string Probe(const std::function<std::string()>& task, unsigned seconds);

}  // namespace Stg::cl

#endif
