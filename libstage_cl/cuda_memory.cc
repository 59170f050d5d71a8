// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cuda_memory.hh"

#include <dlfcn.h>
#include <unistd.h>

namespace Stg::cl {

namespace {

cuda::AllocationProperties PropertiesFor(int device) {
  cuda::AllocationProperties properties{};
  properties.type = cuda::kPinned;
  properties.handle_types = cuda::kFileDescriptor;
  properties.location = {cuda::kDevice, device};
  return properties;
}

}  // namespace

std::unique_ptr<CudaMemory> CudaMemory::Make(const std::shared_ptr<CudaDevice>& device,
                                             size_t bytes) {
  std::unique_ptr<CudaMemory> memory(new CudaMemory(device));
  if (!memory->Allocate(bytes)) return nullptr;
  return memory;
}

bool CudaMemory::Allocate(size_t bytes) {
  const CudaDevice::Current current(*device_);
  const cuda::Functions& call = device_->functions();
  const cuda::AllocationProperties properties = PropertiesFor(device_->number());
  size_t unit = 0;
  if (!current || call.get_unit(&unit, &properties, cuda::kSmallestUnit) != 0 || unit == 0)
    return false;
  bytes_ = (bytes > 0 ? bytes + unit - 1 : unit) / unit * unit;
  cuda::Allocation allocation = 0;
  is_allocated_ = call.create(&allocation, bytes_, &properties, 0) == 0;
  allocation_ = allocation;
  if (!is_allocated_ || call.reserve(&address_, bytes_, 0, 0, 0) != 0) return false;
  is_mapped_ = call.map(address_, bytes_, 0, allocation, 0) == 0;
  const cuda::Access access{properties.location, cuda::kReadAndWrite};
  return is_mapped_ && call.set_access(address_, bytes_, &access, 1) == 0;
}

CudaMemory::~CudaMemory() {
  const CudaDevice::Current current(*device_);
  const cuda::Functions& call = device_->functions();
  if (is_mapped_) call.unmap(address_, bytes_);
  if (address_ != 0) call.free_address(address_, bytes_);
  if (is_allocated_) call.release(allocation_);
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
      device_->functions().export_handle(&descriptor, allocation_, cuda::kFileDescriptor, 0) != 0)
    return {};
  const cl_ulong properties[] = {kOpaqueFd, static_cast<cl_ulong>(descriptor), 0};
  cl_int error = CL_SUCCESS;
  const cl_mem made = create(context(), properties, CL_MEM_READ_WRITE, bytes_, nullptr, &error);
  if (error == CL_SUCCESS) return ::cl::Buffer(made, false);  // it owns the descriptor now
  close(descriptor);
  return {};
}

}  // namespace Stg::cl
