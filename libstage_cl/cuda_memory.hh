// SPDX-License-Identifier: GPL-2.0-or-later
//
// Memory that OpenCL and CUDA share: CUDA makes it, and OpenCL imports it by a file descriptor
// (cl_khr_external_memory_opaque_fd). CUDA's driver library is looked for at run time, because few
// machines have one.

#ifndef STAGE_CL_CUDA_MEMORY_HH
#define STAGE_CL_CUDA_MEMORY_HH

#include <cstddef>
#include <cstdint>
#include <memory>

#include "libstage_cl/opencl.hh"

namespace Stg::cl {

struct CudaFunctions;

/// A device of OpenCL that CUDA has as well.
class CudaDevice {
 public:
  /// Returns null if CUDA is not there, or does not have the device.
  static std::shared_ptr<CudaDevice> Find(const ::cl::Device& device);

  CudaDevice(const CudaFunctions& functions, int number, void* context)
      : functions_(functions), number_(number), context_(context) {}
  int number() const { return number_; }
  /// Waits until everything in the device's primary context, which other libraries use, is done.
  bool Wait();

 private:
  friend class CudaMemory;
  class Current;

  const CudaFunctions& functions_;
  const int number_;
  void* const context_;
};

/// Memory of a device. Its bytes are a multiple of a unit of CUDA, at least those asked for.
class CudaMemory {
 public:
  /// Returns null if there is no such memory.
  static std::unique_ptr<CudaMemory> Make(const std::shared_ptr<CudaDevice>& device, size_t bytes);
  ~CudaMemory();
  CudaMemory(const CudaMemory&) = delete;
  CudaMemory& operator=(const CudaMemory&) = delete;

  void* address() const { return reinterpret_cast<void*>(address_); }
  int device() const { return device_->number(); }
  /// Imports the memory into a context of OpenCL. Returns an empty buffer if that is impossible.
  ::cl::Buffer MakeBuffer(const ::cl::Context& context) const;

 private:
  explicit CudaMemory(const std::shared_ptr<CudaDevice>& device) : device_(device) {}
  bool Allocate(size_t bytes);

  const std::shared_ptr<CudaDevice> device_;
  uint64_t allocation_ = 0;
  uintptr_t address_ = 0;
  size_t bytes_ = 0;
  bool is_allocated_ = false, is_mapped_ = false;
};

}  // namespace Stg::cl

#endif
