// SPDX-License-Identifier: GPL-2.0-or-later
//
// Library to preload into the program: OpenCL whose devices report these properties, where set in
// the environment:
//
//   STAGE_DEVICE_PROFILE, STAGE_DEVICE_EXTENSIONS   strings
//   STAGE_DEVICE_COMPILER, STAGE_DEVICE_ALIGNMENT   numbers: 0 or 1; bits
//   STAGE_DEVICE_TYPE                               a number: 8 is an accelerator

#include <cstdlib>
#include <cstring>
#include <string>

#include "real_opencl.hh"

namespace {

const char* Wanted(cl_device_info info) {
  switch (info) {
    case CL_DEVICE_PROFILE:
      return std::getenv("STAGE_DEVICE_PROFILE");
    case CL_DEVICE_EXTENSIONS:
      return std::getenv("STAGE_DEVICE_EXTENSIONS");
    case CL_DEVICE_COMPILER_AVAILABLE:
      return std::getenv("STAGE_DEVICE_COMPILER");
    case CL_DEVICE_MEM_BASE_ADDR_ALIGN:
      return std::getenv("STAGE_DEVICE_ALIGNMENT");
    case CL_DEVICE_TYPE:
      return std::getenv("STAGE_DEVICE_TYPE");
    default:
      return nullptr;
  }
}

cl_int Answer(const void* data, std::size_t bytes, std::size_t room, void* value,
              std::size_t* needed) {
  if (needed) *needed = bytes;
  if (value && room < bytes) return CL_INVALID_VALUE;
  if (value) std::memcpy(value, data, bytes);
  return CL_SUCCESS;
}

}  // namespace

STAGE_SHIM_CALL cl_int clGetDeviceInfo(cl_device_id device, cl_device_info info, std::size_t room,
                                       void* value, std::size_t* needed) {
  const char* const wanted = Wanted(info);
  if (!wanted)
    return Real<decltype(clGetDeviceInfo)>("clGetDeviceInfo")(device, info, room, value, needed);
  if (info == CL_DEVICE_PROFILE || info == CL_DEVICE_EXTENSIONS)
    return Answer(wanted, std::strlen(wanted) + 1, room, value, needed);
  if (info == CL_DEVICE_TYPE) {
    const auto type = static_cast<cl_device_type>(std::atoi(wanted));
    return Answer(&type, sizeof type, room, value, needed);
  }
  const auto number = static_cast<cl_uint>(std::atoi(wanted));
  return Answer(&number, sizeof number, room, value, needed);
}
