// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps rows by CUDA, with the kernels that NVIDIA's OpenCL compiler has made. They run in the
// context that PyTorch and other libraries use, so that the card does not change between contexts,
// which takes longer than a step of a thousand worlds; and in CUDA's default stream, whose order
// other libraries rely on.

#ifndef STAGE_CL_CUDA_ROW_DEVICE_HH
#define STAGE_CL_CUDA_ROW_DEVICE_HH

#include <unistd.h>

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "libstage_cl/cuda.hh"
#include "libstage_cl/row_groups.hh"
#include "rows/row_backend.hh"

namespace Stg::cl {

/// Memory of a CUDA device.
class CudaBytes {
 public:
  CudaBytes() = default;
  /// Throws rows::RowDeviceError, which says what the memory was meant for.
  CudaBytes(const std::shared_ptr<CudaDevice>& device, size_t bytes, const std::string& name);
  ~CudaBytes();
  CudaBytes(CudaBytes&& other) noexcept { *this = std::move(other); }
  CudaBytes& operator=(CudaBytes&& other) noexcept;

  cuda::Address address() const { return address_; }
  size_t size() const { return bytes_; }

 private:
  std::shared_ptr<CudaDevice> device_;
  cuda::Address address_ = 0;
  size_t bytes_ = 0;
};

/// Kernels that CUDA has loaded.
class CudaKernels {
 public:
  /// The programs as text in PTX, as NVIDIA's OpenCL compiler writes it.
  using Texts = std::array<std::string, kRowPrograms>;
  /// Throws rows::RowDeviceError if CUDA does not accept them.
  CudaKernels(std::shared_ptr<CudaDevice> device, const Texts& ptx);
  ~CudaKernels();
  CudaKernels(const CudaKernels&) = delete;
  CudaKernels& operator=(const CudaKernels&) = delete;

  cuda::Module module(RowProgram program) const { return modules_[program]; }

 private:
  void Unload();

  const std::shared_ptr<CudaDevice> device_;
  std::array<cuda::Module, kRowPrograms> modules_{};
};

class CudaRowMemory final : public rows::RowMemory {
 public:
  CudaRowMemory(const std::shared_ptr<CudaDevice>& device, size_t bytes);

 private:
  friend class CudaRowDevice;
  struct Part {
    row_array_t array;
    uint32_t count;
    CudaBytes entries, values;
  };
  const CudaBytes bytes_;
  std::vector<Part> parts_;
};

class CudaRowDevice final : public rows::RowDevice {
 public:
  /// Throws rows::RowDeviceError if CUDA does not accept the programs.
  CudaRowDevice(std::shared_ptr<CudaDevice> device, const std::string& name,
                const CudaKernels::Texts& ptx, const RowLimits& limits);
  /// Shares the kernels.
  CudaRowDevice(const CudaRowDevice& other);

  std::string Name() const override { return name_; }
  std::unique_ptr<rows::RowDevice> Another() const override;
  void Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) override;
  void Write(size_t offset, const void* from, size_t bytes) override;
  void Read(size_t offset, void* to, size_t bytes) override;
  std::shared_ptr<std::byte> MakeHostMemory(size_t bytes) override;
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
  bool IsInDefaultStream() const override { return true; }

 private:
  void SolveIslands(const IslandLaunch& launch);
  void StepWorlds(std::span<const uint32_t> worlds, uint32_t is_list, uint32_t steps,
                  uint32_t unseen);
  template <typename F>
  void Call(F f);
  void Check(cuda::Result result, const std::string& what) const;
  void FindKernels();
  template <typename T>
  CudaBytes BytesOf(std::span<const T> elements, const std::string& name);
  cuda::Address Send(std::span<const std::byte> data, const std::string& name, CudaBytes* to);
  cuda::Address Send(const rows::RowInput& input, const std::string& name, CudaBytes* to);
  cuda::Address SendList(std::span<const uint32_t> worlds);
  template <typename... Arguments>
  void Launch(RowKernel kernel, size_t groups, size_t items, unsigned worlds,
              Arguments... arguments);
  template <typename... Arguments>
  void LaunchForWorlds(RowKernel kernel, size_t worlds, Arguments... arguments);
  template <typename... Arguments>
  void LaunchForEntries(RowKernel kernel, const rows::RowChoice& worlds, uint32_t count,
                        Arguments... arguments);

  const std::shared_ptr<CudaDevice> device_;
  const std::string name_;
  const pid_t process_ = getpid();
  const std::shared_ptr<const CudaKernels> programs_;
  std::array<cuda::Function, kRowKernels> kernels_{};
  RowLimits limits_;
  RowGroups groups_{1, 1};
  IslandGroups of_islands_{1, 1};
  size_t worlds_ = 0;
  bool outlines_ = false;  // contacts are those of outlines
  CudaBytes image_, state_, scratch_, list_, given_, starts_, start_of_, commands_, poses_, flags_,
      entries_;
  std::vector<uint32_t> list_on_device_;
};

}  // namespace Stg::cl

#endif
