// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps rows on an OpenCL device: its buffers, and the kernels of kernels/row_step.cl. A work-group
// steps a world.

#ifndef STAGE_CL_ROW_DEVICE_HH
#define STAGE_CL_ROW_DEVICE_HH

#include <unistd.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "libstage_cl/cuda_memory.hh"
#include "libstage_cl/open_device.hh"
#include "libstage_cl/row_groups.hh"
#include "rows/row_backend.hh"

namespace Stg::cl {

/// Memory for an array. CUDA's memory is freed last.
class ClRowMemory final : public rows::RowMemory {
 public:
  /// `shared` may be null.
  ClRowMemory(size_t bytes, std::unique_ptr<CudaMemory> shared, const ::cl::Buffer& buffer);

 private:
  friend class ClRowDevice;
  struct Part {
    row_array_t array;
    cl_uint count;
    ::cl::Buffer entries, values;
  };
  const std::unique_ptr<CudaMemory> shared_;
  const ::cl::Buffer buffer_;
  std::vector<Part> parts_;
};

class ClRowDevice final : public rows::RowDevice {
 public:
  /// Throws rows::RowDeviceError, sensing::PrefilterError or cl::Error.
  ClRowDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch, uint32_t work_items);

  /// Shares the open device and the queue.
  ClRowDevice(const ClRowDevice& other);

  /// A device of CUDA that runs the same kernels; null if CUDA does not have this device or does
  /// not accept them. STAGE_CL_CUDA=share leaves the steps to OpenCL, "off" the arrays as well.
  std::unique_ptr<rows::RowDevice> ForCuda() const;

  std::string Name() const override;
  std::unique_ptr<rows::RowDevice> Another() const override;
  void Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) override;
  void Write(size_t offset, const void* from, size_t bytes) override;
  void Read(size_t offset, void* to, size_t bytes) override;
  void Step(uint32_t steps, uint32_t unseen) override;
  void StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) override;
  void Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
             uint64_t columns) override;
  void Restore(std::span<const uint32_t> worlds, const rows::RowStarts& starts,
               std::span<const std::byte> given, uint64_t columns) override;
  void Give(std::span<const row_given_t> commands) override;
  void Finish() override;
  std::shared_ptr<rows::RowMemory> MakeMemory(size_t bytes) override;
  void SetParts(rows::RowMemory* memory, const std::vector<rows::RowPart>& parts) override;
  void Gather(rows::RowMemory* memory, const rows::RowChoice& worlds, size_t offset) override;
  void GiveCommands(rows::RowMemory* memory, const rows::RowChoice& worlds) override;
  void Clear(rows::RowMemory* memory, const rows::RowChoice& worlds,
             uint32_t words_per_world) override;
  void Place(const std::vector<row_entry_t>& entries, uint32_t robots, const rows::RowInput& poses,
             const rows::RowInput& chosen) override;
  void ResetFlagged(const rows::RowInput& flags) override;
  void WriteMemory(rows::RowMemory* memory, const void* from) override;
  void ReadMemory(rows::RowMemory* memory, void* to, size_t bytes) override;
  void WaitForCuda() override;

 private:
  void SolveIslands(const IslandLaunch& launch);
  void StepWorlds(std::span<const uint32_t> worlds, cl_uint is_list, uint32_t steps,
                  uint32_t unseen);
  template <typename F>
  auto Call(F f) const;
  ::cl::Buffer MakeBuffer(size_t bytes, const std::string& name) const;
  template <typename T>
  ::cl::Buffer BufferOf(std::span<const T> elements, const std::string& name);
  /// A buffer for data of one call, which keeps its memory.
  struct Transfer {
    std::string name;
    ::cl::Buffer buffer{};
    size_t bytes = 0;
  };
  const ::cl::Buffer& Send(std::span<const std::byte> data, Transfer* to);
  const ::cl::Buffer& Send(const rows::RowInput& input, Transfer* to);
  template <typename... Arguments>
  void Launch(RowKernel which, size_t groups, size_t items, size_t worlds,
              const Arguments&... arguments);
  template <typename... Arguments>
  void LaunchForWorlds(RowKernel kernel, size_t worlds, const Arguments&... arguments);
  template <typename... Arguments>
  void LaunchForEntries(RowKernel kernel, const rows::RowChoice& worlds, uint32_t count,
                        const Arguments&... arguments);
  const ::cl::Buffer& SendList(std::span<const uint32_t> worlds);

  /// The programs of islands.cl, which all devices on the same hardware share.
  struct IslandPrograms {
    ::cl::Program small, large;
  };
  const ::cl::Program& ProgramOf(RowProgram program) const;
  void FindKernels();

  const std::shared_ptr<const OpenDevice> device_;  // destroyed last
  const std::shared_ptr<const IslandPrograms> islands_;
  const pid_t process_ = getpid();
  ::cl::CommandQueue queue_;
  std::array<::cl::Kernel, kRowKernels> kernels_;
  RowLimits limits_;
  size_t worlds_ = 0;
  RowGroups groups_{1, 1};
  IslandGroups of_islands_{1, 1};
  bool outlines_ = false;  // contacts are those of outlines
  ::cl::Buffer state_, scratch_;
  size_t state_bytes_ = 0, scratch_bytes_ = 0;
  Transfer image_{"the scene"};
  Transfer list_{"the numbers of worlds"}, given_{"the columns of worlds"},
      starts_{"the states of worlds"}, start_of_{"the numbers of states"}, commands_{"commands"},
      poses_{"poses"}, flags_{"flags"}, entries_{"the entries of poses"};
  std::vector<uint32_t> list_on_device_;
  const std::shared_ptr<CudaDevice> cuda_;  // null: CUDA does not have this device
};

}  // namespace Stg::cl

#endif
