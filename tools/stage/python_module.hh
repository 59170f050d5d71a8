// SPDX-License-Identifier: GPL-2.0-or-later
//
// Commands of the program that are implemented in Python, as modules of the package stagesim.

#ifndef STAGE_TOOLS_STAGE_PYTHON_MODULE_HH
#define STAGE_TOOLS_STAGE_PYTHON_MODULE_HH

#include <string>
#include <vector>

namespace Stg::program {

/// Replaces this process by `python3 -m MODULE ARGUMENT...`. The interpreter is $STAGE_PYTHON, the
/// build tree's (build/venv) or python3. The package is the one that contains this program, the one
/// beside it in a build tree, or an installed one. Without the package, the process ends with a
/// one-line message and status 1. Throws std::runtime_error if there is no interpreter.
[[noreturn]] void BecomePythonModule(const std::string& module,
                                     const std::vector<std::string>& arguments);

}  // namespace Stg::program

#endif
