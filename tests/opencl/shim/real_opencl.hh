// SPDX-License-Identifier: GPL-2.0-or-later
//
// The real OpenCL library, called by the libraries that tests preload.

#ifndef STAGE_TESTS_OPENCL_SHIM_REAL_OPENCL_HH
#define STAGE_TESTS_OPENCL_SHIM_REAL_OPENCL_HH

#include <dlfcn.h>

#include <cstdlib>

#define CL_TARGET_OPENCL_VERSION 120
#define CL_USE_DEPRECATED_OPENCL_1_1_APIS
#include <CL/cl.h>

/// Returns a function of the library.
template <typename Function>
Function* Real(const char* name) {
  static void* const library = dlopen("libOpenCL.so.1", RTLD_NOW);
  void* const found = library ? dlsym(library, name) : nullptr;
  return found ? reinterpret_cast<Function*>(found) : (abort(), nullptr);
}

#define STAGE_SHIM_CALL extern "C" __attribute__((visibility("default")))

#endif
