// SPDX-License-Identifier: GPL-2.0-or-later
//
// The kernels, compiled for a device. What particular drivers need is in program.cc and nowhere
// else.

#ifndef STAGE_CL_PROGRAM_HH
#define STAGE_CL_PROGRAM_HH

#include <string>

#include "libstage_cl/opencl.hh"

namespace Stg::cl {

/// Compiles the kernels; throws sensing::PrefilterError with the first lines of the compiler's log
/// if that fails. STAGE_CL_OPTIONS in the environment adds options for the compiler.
::cl::Program BuildProgram(const ::cl::Context& context, const ::cl::Device& device);

}  // namespace Stg::cl

#endif
