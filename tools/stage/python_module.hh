// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parts of the program that are written in Python: modules of the package stagesim.

#ifndef STAGE_TOOLS_STAGE_PYTHON_MODULE_HH
#define STAGE_TOOLS_STAGE_PYTHON_MODULE_HH

#include <string>
#include <vector>

namespace Stg::program {

/// Replaces this process by `python3 -m MODULE ARGUMENT...`. The interpreter is $STAGE_PYTHON, or
/// that of the build tree (build/venv), or else python3. The package is the one that this program
/// is a part of, or lies beside in a build tree, or else one that is installed. If the package is
/// not there, the process ends with a line that says so and status 1. Throws std::runtime_error if
/// there is no interpreter.
[[noreturn]] void BecomePythonModule(const std::string& module,
                                     const std::vector<std::string>& arguments);

}  // namespace Stg::program

#endif
