// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cuda_memory.hh"

#include <dlfcn.h>
#include <unistd.h>

#include <cstring>
#include <optional>

namespace Stg::cl {

// Declarations of CUDA's driver library, see NVIDIA's reference of the driver API.
namespace {

using Result = int;  // 0: success
using Context = void*;
using Allocation = unsigned long long;

enum { kDevice = 1, kPinned = 1, kFileDescriptor = 1, kReadAndWrite = 3, kSmallestUnit = 0 };

struct Uuid {
  char bytes[16];
};
struct Location {
  int type, number;
};
struct AllocationProperties {
  int type, handle_types;
  Location location;
  void* unused;
  unsigned char flags[8];
};
static_assert(sizeof(AllocationProperties) == 32);
struct Access {
  Location location;
  int flags;
};
static_assert(sizeof(Access) == 12);

}  // namespace

struct CudaFunctions {
  Result (*initialize)(unsigned);
  Result (*count_devices)(int*);
  Result (*get_device)(int*, int);
  Result (*get_uuid)(Uuid*, int);
  Result (*retain_primary_context)(Context*, int);
  Result (*push_context)(Context);
  Result (*pop_context)(Context*);
  Result (*synchronize)();
  Result (*get_unit)(size_t*, const AllocationProperties*, int);
  Result (*create)(Allocation*, size_t, const AllocationProperties*, unsigned long long);
  Result (*export_handle)(void*, Allocation, int, unsigned long long);
  Result (*reserve)(uintptr_t*, size_t, size_t, uintptr_t, unsigned long long);
  Result (*map)(uintptr_t, size_t, size_t, Allocation, unsigned long long);
  Result (*set_access)(uintptr_t, size_t, const Access*, size_t);
  Result (*unmap)(uintptr_t, size_t);
  Result (*free_address)(uintptr_t, size_t);
  Result (*release)(Allocation);
};

namespace {

template <typename F>
bool Get(void* library, const char* name, F* function) {
  *function = reinterpret_cast<F>(dlsym(library, name));
  return *function != nullptr;
}

bool GetFunctions(void* library, CudaFunctions* to) {
  return Get(library, "cuInit", &to->initialize) &&
         Get(library, "cuDeviceGetCount", &to->count_devices) &&
         Get(library, "cuDeviceGet", &to->get_device) &&
         Get(library, "cuDeviceGetUuid", &to->get_uuid) &&
         Get(library, "cuDevicePrimaryCtxRetain", &to->retain_primary_context) &&
         Get(library, "cuCtxPushCurrent_v2", &to->push_context) &&
         Get(library, "cuCtxPopCurrent_v2", &to->pop_context) &&
         Get(library, "cuCtxSynchronize", &to->synchronize) &&
         Get(library, "cuMemGetAllocationGranularity", &to->get_unit) &&
         Get(library, "cuMemCreate", &to->create) &&
         Get(library, "cuMemExportToShareableHandle", &to->export_handle) &&
         Get(library, "cuMemAddressReserve", &to->reserve) && Get(library, "cuMemMap", &to->map) &&
         Get(library, "cuMemSetAccess", &to->set_access) &&
         Get(library, "cuMemUnmap", &to->unmap) &&
         Get(library, "cuMemAddressFree", &to->free_address) &&
         Get(library, "cuMemRelease", &to->release);
}

/// Null if CUDA is not there. The library stays loaded.
const CudaFunctions* FindCuda() {
  static const std::optional<CudaFunctions> found = []() -> std::optional<CudaFunctions> {
    void* const library = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
    CudaFunctions functions{};
    if (!library || !GetFunctions(library, &functions) || functions.initialize(0) != 0) return {};
    return functions;
  }();
  return found ? &*found : nullptr;
}

AllocationProperties PropertiesFor(int device) {
  AllocationProperties properties{};
  properties.type = kPinned;
  properties.handle_types = kFileDescriptor;
  properties.location = {kDevice, device};
  return properties;
}

}  // namespace

/// Makes the device's context that of the thread.
class CudaDevice::Current {
 public:
  explicit Current(const CudaDevice& device)
      : functions_(device.functions_), is_set_(functions_.push_context(device.context_) == 0) {}
  ~Current() {
    Context context;
    if (is_set_) functions_.pop_context(&context);
  }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
  explicit operator bool() const { return is_set_; }

 private:
  const CudaFunctions& functions_;
  const bool is_set_;
};

std::shared_ptr<CudaDevice> CudaDevice::Find(const ::cl::Device& device) {
  constexpr cl_device_info kUuid = 0x106A;  // CL_DEVICE_UUID_KHR
  Uuid wanted;
  if (device.getInfo<CL_DEVICE_EXTENSIONS>().find("cl_khr_external_memory_opaque_fd") ==
          std::string::npos ||
      clGetDeviceInfo(device(), kUuid, sizeof wanted, &wanted, nullptr) != CL_SUCCESS)
    return nullptr;
  const CudaFunctions* const cuda = FindCuda();
  int count = 0;
  if (!cuda || cuda->count_devices(&count) != 0) return nullptr;
  for (int number = 0; number < count; number++) {
    int handle = 0;
    Uuid uuid;
    if (cuda->get_device(&handle, number) != 0 || cuda->get_uuid(&uuid, handle) != 0 ||
        std::memcmp(&uuid, &wanted, sizeof uuid) != 0)
      continue;
    Context context = nullptr;
    if (cuda->retain_primary_context(&context, handle) != 0) return nullptr;
    return std::make_shared<CudaDevice>(*cuda, number, context);
  }
  return nullptr;
}

bool CudaDevice::Wait() {
  const Current current(*this);
  return current && functions_.synchronize() == 0;
}

std::unique_ptr<CudaMemory> CudaMemory::Make(const std::shared_ptr<CudaDevice>& device,
                                             size_t bytes) {
  std::unique_ptr<CudaMemory> memory(new CudaMemory(device));
  if (!memory->Allocate(bytes)) return nullptr;
  return memory;
}

bool CudaMemory::Allocate(size_t bytes) {
  const CudaDevice::Current current(*device_);
  const CudaFunctions& cuda = device_->functions_;
  const AllocationProperties properties = PropertiesFor(device_->number());
  size_t unit = 0;
  if (!current || cuda.get_unit(&unit, &properties, kSmallestUnit) != 0 || unit == 0) return false;
  bytes_ = (bytes > 0 ? bytes + unit - 1 : unit) / unit * unit;
  Allocation allocation = 0;
  is_allocated_ = cuda.create(&allocation, bytes_, &properties, 0) == 0;
  allocation_ = allocation;
  if (!is_allocated_ || cuda.reserve(&address_, bytes_, 0, 0, 0) != 0) return false;
  is_mapped_ = cuda.map(address_, bytes_, 0, allocation, 0) == 0;
  const Access access{properties.location, kReadAndWrite};
  return is_mapped_ && cuda.set_access(address_, bytes_, &access, 1) == 0;
}

CudaMemory::~CudaMemory() {
  const CudaDevice::Current current(*device_);
  const CudaFunctions& cuda = device_->functions_;
  if (is_mapped_) cuda.unmap(address_, bytes_);
  if (address_ != 0) cuda.free_address(address_, bytes_);
  if (is_allocated_) cuda.release(allocation_);
}

::cl::Buffer CudaMemory::MakeBuffer(const ::cl::Context& context) const {
  using Create =
      cl_mem(CL_API_CALL*)(cl_context, const cl_ulong*, cl_mem_flags, size_t, void*, cl_int*);
  constexpr cl_ulong kOpaqueFd = 0x2060;  // CL_EXTERNAL_MEMORY_HANDLE_OPAQUE_FD_KHR
  void* const loader = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_NOLOAD);
  const auto create =
      loader ? reinterpret_cast<Create>(dlsym(loader, "clCreateBufferWithProperties")) : nullptr;
  if (loader) dlclose(loader);
  int descriptor = -1;
  const CudaDevice::Current current(*device_);
  if (!create || !current ||
      device_->functions_.export_handle(&descriptor, allocation_, kFileDescriptor, 0) != 0)
    return {};
  const cl_ulong properties[] = {kOpaqueFd, static_cast<cl_ulong>(descriptor), 0};
  cl_int error = CL_SUCCESS;
  const cl_mem made = create(context(), properties, CL_MEM_READ_WRITE, bytes_, nullptr, &error);
  if (error == CL_SUCCESS) return ::cl::Buffer(made, false);  // it owns the descriptor now
  close(descriptor);
  return {};
}

}  // namespace Stg::cl
