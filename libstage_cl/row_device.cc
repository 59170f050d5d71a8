// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/row_device.hh"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "libstage_cl/cuda_row_device.hh"
#include "libstage_cl/environment.hh"

namespace Stg::cl {

using rows::RowDeviceError;

ClRowDevice::ClRowDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch,
                         uint32_t work_items)
    : device_(std::make_shared<const OpenDevice>(device, std::move(watch), Kernels::kRows)),
      islands_(std::make_shared<const IslandPrograms>(IslandPrograms{
          device_->Compile(Kernels::kSmallIslands), device_->Compile(Kernels::kLargeIslands)})),
      queue_(device_->context, device_->found.device),
      cuda_(FromEnvironment("STAGE_CL_CUDA") == "off" ? nullptr
                                                      : CudaDevice::Find(device_->found.device)) {
  limits_.wanted_items = work_items;
  limits_.processors = device_->found.device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  FindKernels();
}

ClRowDevice::ClRowDevice(const ClRowDevice& other)
    : RowDevice(),
      device_(other.device_),
      islands_(other.islands_),
      queue_(other.queue_),
      limits_(other.limits_),
      cuda_(other.cuda_) {
  FindKernels();
}

const ::cl::Program& ClRowDevice::ProgramOf(RowProgram program) const {
  return program == kRowProgram            ? device_->program
         : program == kSmallIslandsProgram ? islands_->small
                                           : islands_->large;
}

/// Makes the kernels, each of which holds its arguments.
void ClRowDevice::FindKernels() {
  for (size_t i = 0; i < kRowKernels; i++) {
    const RowKernelInfo& info = kRowKernelInfos[i];
    kernels_[i] = ::cl::Kernel(ProgramOf(info.program), info.name);
    LowerLimits(info.item,
                kernels_[i].getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device_->found.device),
                &limits_);
  }
}

/// Calls f() and translates errors.
template <typename F>
auto ClRowDevice::Call(F f) const {
  if (getpid() != process_) throw RowDeviceError("this process has been forked");
  calls::SetDriver(device_->found.platform);  // the thread may use other drivers too
  try {
    return f();
  } catch (const ::cl::Error& error) {
    throw RowDeviceError(Name() + ": " + error.what() + ", error " + std::to_string(error.err()));
  }
}

std::unique_ptr<rows::RowDevice> ClRowDevice::Another() const {
  return Call([&] { return std::make_unique<ClRowDevice>(*this); });
}

std::unique_ptr<rows::RowDevice> ClRowDevice::ForCuda() const {
  const std::string wanted = FromEnvironment("STAGE_CL_CUDA");
  if (!cuda_ || wanted == "share") return nullptr;
  try {
    CudaKernels::Texts texts;
    for (size_t i = 0; i < kRowPrograms; i++) {
      const std::vector<std::vector<unsigned char>> binaries =
          ProgramOf(static_cast<RowProgram>(i)).getInfo<CL_PROGRAM_BINARIES>();
      if (binaries.empty()) return nullptr;
      texts[i].assign(binaries[0].begin(), binaries[0].end());
    }
    return std::make_unique<CudaRowDevice>(cuda_, Name(), texts, limits_);
  } catch (const RowDeviceError&) {
    return nullptr;
  }
}

std::string ClRowDevice::Name() const {
  const FoundDevice& found = device_->found;
  return found.kind + " " + found.name + " (" + found.platform + ")";
}

::cl::Buffer ClRowDevice::MakeBuffer(size_t bytes, const std::string& name) const {
  const uint64_t most = device_->found.device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  if (bytes > most)
    throw RowDeviceError(Name() + ": " + name + " takes " + std::to_string(bytes) +
                         " bytes, a buffer has at most " + std::to_string(most));
  return ::cl::Buffer(device_->context, CL_MEM_READ_WRITE, std::max<size_t>(bytes, 1));
}

/// A buffer with these elements.
template <typename T>
::cl::Buffer ClRowDevice::BufferOf(std::span<const T> elements, const std::string& name) {
  const ::cl::Buffer buffer = MakeBuffer(elements.size_bytes(), name);
  if (!elements.empty())
    queue_.enqueueWriteBuffer(buffer, CL_TRUE, 0, elements.size_bytes(), elements.data());
  return buffer;
}

/// Writes data for the next kernel. Waits, so the caller may change its data.
const ::cl::Buffer& ClRowDevice::Send(std::span<const std::byte> data, Transfer* to) {
  if (to->bytes < data.size() || to->bytes == 0) {
    to->bytes = std::max<size_t>((to->bytes > 0 ? 2 : 1) * data.size(), 1);
    to->buffer = MakeBuffer(to->bytes, to->name);
  }
  if (!data.empty()) queue_.enqueueWriteBuffer(to->buffer, CL_TRUE, 0, data.size(), data.data());
  return to->buffer;
}

void ClRowDevice::Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) {
  Call([&] {
    queue_.finish();
    worlds_ = buffers.worlds;
    // A CPU runs the work-items of a group one after the other.
    const bool is_alone =
        device_->found.kind == "cpu" && limits_.wanted_items == 0 && buffers.work_items == 0;
    groups_ = is_alone ? RowGroups{1, 1} : ChooseRowGroups(buffers, limits_);
    outlines_ = rows::HasOutlines(image);
    of_islands_ = ChooseIslandGroups(buffers, groups_, limits_);
    Send(std::as_bytes(image), &image_);
    if (state_bytes_ != buffers.state_bytes)
      state_ = MakeBuffer(state_bytes_ = buffers.state_bytes, "the state of all worlds");
    if (scratch_bytes_ != buffers.scratch_bytes)
      scratch_ =
          MakeBuffer(scratch_bytes_ = buffers.scratch_bytes, "memory for steps of all worlds");
  });
}

void ClRowDevice::Write(size_t offset, const void* from, size_t bytes) {
  Call([&] { queue_.enqueueWriteBuffer(state_, CL_TRUE, offset, bytes, from); });
}

void ClRowDevice::Read(size_t offset, void* to, size_t bytes) {
  Call([&] { queue_.enqueueReadBuffer(state_, CL_TRUE, offset, bytes, to); });
}

/// Starts groups of the size items * worlds.
template <typename... Arguments>
void ClRowDevice::Launch(RowKernel which, size_t groups, size_t items, size_t worlds,
                         const Arguments&... arguments) {
  ::cl::Kernel& kernel = kernels_[which];
  cl_uint index = 0;
  (kernel.setArg(index++, arguments), ...);
  queue_.enqueueNDRangeKernel(kernel, ::cl::NullRange, ::cl::NDRange(groups * items, worlds),
                              ::cl::NDRange(items, worlds));
  queue_.flush();
}

/// Starts a kernel with work-groups of worlds.
template <typename... Arguments>
void ClRowDevice::LaunchForWorlds(RowKernel kernel, size_t worlds, const Arguments&... arguments) {
  ForEachRowLaunch(worlds, groups_, [&](uint32_t first, size_t groups, unsigned of_group) {
    Launch(kernel, groups, groups_.items, of_group, cl_uint{first}, arguments...);
  });
}

/// Starts a kernel with a work-item for each of `count` entries of each world.
template <typename... Arguments>
void ClRowDevice::LaunchForEntries(RowKernel kernel, const rows::RowChoice& worlds, uint32_t count,
                                   const Arguments&... arguments) {
  const ::cl::Buffer& list = SendList(worlds.list);
  const ::cl::Buffer& flags = Send(worlds.flags, &flags_);
  rows::ForEachPartOfEntries(
      worlds_, worlds, count, [&](uint32_t first, uint32_t all, size_t items) {
        Launch(kernel, (items + limits_.entry_items - 1) / limits_.entry_items, limits_.entry_items,
               1, list, flags, cl_uint{worlds.kind}, cl_uint{first}, cl_uint{all}, cl_uint{count},
               arguments...);
      });
}

/// Starts to solve islands of all worlds, see kernels/islands.cl.
void ClRowDevice::SolveIslands(const IslandLaunch& launch) {
  Launch(launch.kernel, of_islands_.groups, of_islands_.items, 1, image_.buffer, state_, scratch_,
         static_cast<cl_uint>(of_islands_.groups * of_islands_.items), cl_uint{launch.kinds});
}

/// Steps all worlds, if is_list is 0, or those of the list.
void ClRowDevice::StepWorlds(std::span<const uint32_t> worlds, cl_uint is_list, uint32_t steps,
                             uint32_t unseen) {
  if (steps == 0) return;
  const size_t count = is_list ? worlds.size() : worlds_;
  Call([&] {
    const ::cl::Buffer& list = SendList(worlds);
    if (!outlines_) {
      LaunchForWorlds(kStep, count, list, is_list, image_.buffer, state_, scratch_, cl_uint{steps},
                      cl_uint{unseen});
      return;
    }
    for (uint32_t left = steps; left-- > 0;) {
      LaunchForWorlds(kBeginOutlines, count, list, is_list, image_.buffer, state_, scratch_,
                      cl_uint{unseen + left});
      for (const IslandLaunch& launch : kIslandLaunches) SolveIslands(launch);
      LaunchForWorlds(kEndOutlines, count, list, is_list, image_.buffer, state_, scratch_);
    }
  });
}

void ClRowDevice::Step(uint32_t steps, uint32_t unseen) { StepWorlds({}, 0, steps, unseen); }

void ClRowDevice::StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) {
  StepWorlds(worlds, 1, steps, unseen);
}

void ClRowDevice::Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
                        uint64_t columns) {
  if (worlds.empty()) return;
  Call([&] {
    LaunchForWorlds(kReset, worlds.size(), image_.buffer, state_, SendList(worlds),
                    Send(given, &given_), cl_ulong{columns},
                    static_cast<cl_uint>(given.size() / worlds.size()));
  });
}

void ClRowDevice::Restore(std::span<const uint32_t> worlds, const rows::RowStarts& starts,
                          std::span<const std::byte> given, uint64_t columns) {
  if (worlds.empty()) return;
  Call([&] {
    LaunchForWorlds(kRestore, worlds.size(), image_.buffer, state_, SendList(worlds),
                    Send(starts.states, &starts_), Send(std::as_bytes(starts.of_world), &start_of_),
                    static_cast<cl_uint>(starts.bytes / sizeof(cl_ulong)), Send(given, &given_),
                    cl_ulong{columns}, static_cast<cl_uint>(given.size() / worlds.size()));
  });
}

void ClRowDevice::Give(std::span<const row_given_t> commands) {
  if (commands.empty()) return;
  Call([&] {
    Launch(kGive, (commands.size() + limits_.entry_items - 1) / limits_.entry_items,
           limits_.entry_items, 1, image_.buffer, state_, Send(std::as_bytes(commands), &commands_),
           static_cast<cl_uint>(commands.size()));
  });
}

void ClRowDevice::Finish() {
  Call([&] { queue_.finish(); });
}

// ---- arrays -------------------------------------------------------------------------------------

ClRowMemory::ClRowMemory(size_t bytes, std::unique_ptr<CudaMemory> shared,
                         const ::cl::Buffer& buffer)
    : RowMemory(bytes), shared_(std::move(shared)), buffer_(buffer) {
  if (!shared_) return;
  cuda_address_ = shared_->address();
  cuda_device_ = shared_->device();
}

std::shared_ptr<rows::RowMemory> ClRowDevice::MakeMemory(size_t bytes) {
  return Call([&] {
    std::unique_ptr<CudaMemory> shared = cuda_ ? CudaMemory::Make(cuda_, bytes) : nullptr;
    ::cl::Buffer buffer;
    if (shared) buffer = shared->MakeBuffer(device_->context);
    if (!buffer()) {
      shared.reset();
      buffer = MakeBuffer(bytes, "an array");
    }
    return std::make_shared<ClRowMemory>(bytes, std::move(shared), buffer);
  });
}

void ClRowDevice::SetParts(rows::RowMemory* memory, const std::vector<rows::RowPart>& parts) {
  Call([&] {
    auto& known = static_cast<ClRowMemory*>(memory)->parts_;
    known.clear();
    for (const rows::RowPart& part : parts)
      known.push_back({part.array, static_cast<cl_uint>(part.entries.size()),
                       BufferOf(std::span(part.entries), "the entries of an array"),
                       BufferOf(std::span(part.values), "the values of an array")});
  });
}

/// Sends the list of worlds, unless it has been sent before.
const ::cl::Buffer& ClRowDevice::SendList(std::span<const uint32_t> worlds) {
  if (list_.bytes > 0 && (worlds.empty() || std::ranges::equal(worlds, list_on_device_)))
    return list_.buffer;
  list_on_device_.assign(worlds.begin(), worlds.end());
  return Send(std::as_bytes(worlds), &list_);
}

void ClRowDevice::Gather(rows::RowMemory* memory, const rows::RowChoice& worlds, size_t offset) {
  Call([&] {
    const auto& to = static_cast<const ClRowMemory&>(*memory);
    for (const ClRowMemory::Part& part : to.parts_)
      LaunchForEntries(kGather, worlds, part.count, image_.buffer, state_, part.entries,
                       part.values, part.array.kind, part.array.column, part.array.elements,
                       part.array.of_readings, to.buffer_, cl_ulong{offset});
  });
}

void ClRowDevice::GiveCommands(rows::RowMemory* memory, const rows::RowChoice& worlds) {
  Call([&] {
    const auto& from = static_cast<const ClRowMemory&>(*memory);
    for (const ClRowMemory::Part& part : from.parts_)
      LaunchForEntries(kCommand, worlds, part.count, image_.buffer, state_, part.entries,
                       part.array.elements, from.buffer_);
  });
}

void ClRowDevice::Clear(rows::RowMemory* memory, const rows::RowChoice& worlds,
                        uint32_t words_per_world) {
  Call([&] {
    LaunchForEntries(kClear, worlds, words_per_world, static_cast<ClRowMemory*>(memory)->buffer_);
  });
}

const ::cl::Buffer& ClRowDevice::Send(const rows::RowInput& input, Transfer* to) {
  if (input.is_in_cuda) throw RowDeviceError(Name() + " can't read the memory of CUDA");
  return Send(std::span(static_cast<const std::byte*>(input.data), input.bytes), to);
}

void ClRowDevice::Place(const std::vector<row_entry_t>& entries, uint32_t robots,
                        const rows::RowInput& poses, const rows::RowInput& chosen) {
  Call([&] {
    LaunchForWorlds(kPlace, worlds_, image_.buffer, state_, scratch_,
                    Send(std::as_bytes(std::span(entries)), &entries_),
                    static_cast<cl_uint>(entries.size()), cl_uint{robots}, Send(poses, &poses_),
                    Send(chosen, &flags_));
  });
}

void ClRowDevice::ResetFlagged(const rows::RowInput& flags) {
  Call([&] {
    LaunchForWorlds(kResetFlagged, worlds_, image_.buffer, state_, Send(flags, &flags_));
  });
}

void ClRowDevice::WriteMemory(rows::RowMemory* memory, const void* from) {
  Call([&] {
    queue_.enqueueWriteBuffer(static_cast<ClRowMemory*>(memory)->buffer_, CL_TRUE, 0,
                              memory->bytes(), from);
  });
}

void ClRowDevice::ReadMemory(rows::RowMemory* memory, void* to, size_t bytes) {
  Call([&] {
    queue_.enqueueReadBuffer(static_cast<ClRowMemory*>(memory)->buffer_, CL_TRUE, 0, bytes, to);
  });
}

void ClRowDevice::WaitForCuda() {
  if (cuda_ && !cuda_->Wait()) throw RowDeviceError(Name() + ": CUDA reports an error");
}

}  // namespace Stg::cl
