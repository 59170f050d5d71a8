// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps rows on an OpenCL device: its buffers, and the kernels of kernels/row_step.cl. A work-group
// steps a world.

#ifndef STAGE_CL_ROW_DEVICE_HH
#define STAGE_CL_ROW_DEVICE_HH

#include <unistd.h>

#include <memory>
#include <string>

#include "libstage_cl/open_device.hh"
#include "rows/row_backend.hh"

namespace Stg::cl {

class ClRowDevice final : public rows::RowDevice {
 public:
  /// Throws rows::RowDeviceError, sensing::PrefilterError or cl::Error.
  ClRowDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch, uint32_t work_items);

  std::string Name() const override;
  void Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) override;
  void Write(size_t offset, const void* from, size_t bytes) override;
  void Read(size_t offset, void* to, size_t bytes) override;
  void Step(uint32_t steps) override;
  void Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
             uint32_t columns) override;
  void Finish() override;

 private:
  template <typename F>
  void Call(F f);
  ::cl::Buffer MakeBuffer(size_t bytes, const std::string& name) const;
  void Launch(const ::cl::Kernel& kernel, size_t worlds);

  const OpenDevice device_;  // destroyed last
  const pid_t process_ = getpid();
  ::cl::CommandQueue queue_;
  ::cl::Kernel step_, reset_;
  size_t work_items_, worlds_ = 0;
  ::cl::Buffer image_, state_, scratch_;
};

}  // namespace Stg::cl

#endif
