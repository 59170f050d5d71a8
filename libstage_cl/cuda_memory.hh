// SPDX-License-Identifier: GPL-2.0-or-later
//
// Memory that OpenCL and CUDA share: CUDA makes it, and OpenCL imports it by a file descriptor
// (cl_khr_external_memory_opaque_fd).

#ifndef STAGE_CL_CUDA_MEMORY_HH
#define STAGE_CL_CUDA_MEMORY_HH

#include <cstddef>
#include <memory>

#include "libstage_cl/cuda.hh"
#include "libstage_cl/opencl.hh"

namespace Stg::cl {

/// Its size is a multiple of a unit of CUDA, at least what was asked for.
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
  cuda::Allocation allocation_ = 0;
  cuda::Address address_ = 0;
  size_t bytes_ = 0;
  bool is_allocated_ = false, is_mapped_ = false;
};

}  // namespace Stg::cl

#endif
