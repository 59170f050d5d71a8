// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cuda.hh"

#include <dlfcn.h>

#include <cstring>
#include <optional>
#include <string>

namespace Stg::cl {

namespace {

static_assert(sizeof(cuda::Access) == 12);
static_assert(sizeof(void*) < 8 || sizeof(cuda::AllocationProperties) == 32);

/// Finds functions by their names. Stops at the first that is missing.
class Finder {
 public:
  explicit Finder(void* library) : library_(library) {}
  template <typename F>
  void operator()(const char* name, F* function) {
    *function = all_ ? reinterpret_cast<F>(dlsym(library_, name)) : nullptr;
    all_ = *function != nullptr;
  }
  bool all() const { return all_; }

 private:
  void* const library_;
  bool all_ = true;
};

bool GetFunctions(void* library, cuda::Functions* to) {
  Finder get(library);
  get("cuInit", &to->initialize);
  get("cuDeviceGetCount", &to->count_devices);
  get("cuDeviceGet", &to->get_device);
  get("cuDeviceGetUuid", &to->get_uuid);
  get("cuDevicePrimaryCtxRetain", &to->retain_primary_context);
  get("cuCtxPushCurrent_v2", &to->push_context);
  get("cuCtxPopCurrent_v2", &to->pop_context);
  get("cuCtxSynchronize", &to->synchronize);
  get("cuGetErrorName", &to->get_error_name);
  get("cuMemGetAllocationGranularity", &to->get_unit);
  get("cuMemCreate", &to->create);
  get("cuMemExportToShareableHandle", &to->export_handle);
  get("cuMemAddressReserve", &to->reserve);
  get("cuMemMap", &to->map);
  get("cuMemSetAccess", &to->set_access);
  get("cuMemUnmap", &to->unmap);
  get("cuMemAddressFree", &to->free_address);
  get("cuMemRelease", &to->release);
  get("cuMemAlloc_v2", &to->allocate);
  get("cuMemFree_v2", &to->free);
  get("cuMemcpyHtoD_v2", &to->to_device);
  get("cuMemcpyDtoH_v2", &to->to_host);
  get("cuMemAllocHost_v2", &to->allocate_on_host);
  get("cuMemFreeHost", &to->free_on_host);
  get("cuModuleLoadData", &to->load_module);
  get("cuModuleUnload", &to->unload_module);
  get("cuModuleGetFunction", &to->get_function);
  get("cuFuncGetAttribute", &to->get_attribute);
  get("cuLaunchKernel", &to->launch);
  return get.all();
}

/// Null if CUDA is not there. The library stays loaded.
const cuda::Functions* FindCuda() {
  static const std::optional<cuda::Functions> found = []() -> std::optional<cuda::Functions> {
    void* const library = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
    cuda::Functions functions{};
    if (!library || !GetFunctions(library, &functions) || functions.initialize(0) != 0) return {};
    return functions;
  }();
  return found ? &*found : nullptr;
}

/// The identification of a device that CUDA may have; false if it has none.
bool GetUuid(const ::cl::Device& device, cuda::Uuid* uuid) {
  constexpr cl_device_info kUuid = 0x106A;  // CL_DEVICE_UUID_KHR
  return device.getInfo<CL_DEVICE_EXTENSIONS>().find("cl_khr_device_uuid") != std::string::npos &&
         clGetDeviceInfo(device(), kUuid, sizeof *uuid, uuid, nullptr) == CL_SUCCESS;
}

}  // namespace

std::shared_ptr<CudaDevice> CudaDevice::Find(const ::cl::Device& device) {
  cuda::Uuid wanted;
  if (!GetUuid(device, &wanted)) return nullptr;
  const cuda::Functions* const cuda = FindCuda();
  int count = 0;
  if (!cuda || cuda->count_devices(&count) != 0) return nullptr;
  for (int number = 0; number < count; number++) {
    int handle = 0;
    cuda::Uuid uuid;
    if (cuda->get_device(&handle, number) != 0 || cuda->get_uuid(&uuid, handle) != 0 ||
        std::memcmp(&uuid, &wanted, sizeof uuid) != 0)
      continue;
    cuda::Context context = nullptr;
    if (cuda->retain_primary_context(&context, handle) != 0) return nullptr;
    return std::make_shared<CudaDevice>(*cuda, number, context);
  }
  return nullptr;
}

bool CudaDevice::Wait() const {
  const Current current(*this);
  return current && functions_.synchronize() == 0;
}

}  // namespace Stg::cl
