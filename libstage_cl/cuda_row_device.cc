// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cuda_row_device.hh"

#include <algorithm>
#include <regex>
#include <utility>

namespace Stg::cl {

namespace {

using rows::RowDeviceError;

/// Adapts kernels of OpenCL to CUDA. Registers 0 to 5 of the environment hold offsets of
/// work-groups and work-items, which are 0; CUDA does not set them.
std::string AdaptToCuda(const std::string& ptx) {
  const std::string adapted = std::regex_replace(ptx, std::regex("%envreg[0-5]\\b"), "0");
  if (adapted.find("%envreg") != std::string::npos)
    throw RowDeviceError("its kernels use registers that CUDA does not have");
  return adapted.substr(0, adapted.find('\0'));
}

}  // namespace

// ---- memory -------------------------------------------------------------------------------------

CudaBytes::CudaBytes(const std::shared_ptr<CudaDevice>& device, size_t bytes,
                     const std::string& name)
    : device_(device), bytes_(bytes) {
  const CudaDevice::Current current(*device_);
  if (!current || device_->functions().allocate(&address_, std::max<size_t>(bytes, 8)) != 0)
    throw RowDeviceError("CUDA has no memory for " + name + ", which takes " +
                         std::to_string(bytes) + " bytes");
}

CudaBytes::~CudaBytes() {
  if (!address_) return;
  const CudaDevice::Current current(*device_);
  device_->functions().free(address_);
}

CudaBytes& CudaBytes::operator=(CudaBytes&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(address_, other.address_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

CudaRowMemory::CudaRowMemory(const std::shared_ptr<CudaDevice>& device, size_t bytes)
    : RowMemory(bytes), bytes_(device, bytes, "an array") {
  cuda_address_ = reinterpret_cast<void*>(bytes_.address());
  cuda_device_ = device->number();
}

// ---- the device ---------------------------------------------------------------------------------

CudaKernels::CudaKernels(std::shared_ptr<CudaDevice> device, const Texts& ptx)
    : device_(std::move(device)) {
  const CudaDevice::Current current(*device_);
  for (size_t i = 0; i < kRowPrograms; i++)
    if (device_->functions().load_module(&modules_[i], AdaptToCuda(ptx[i]).c_str()) != 0) {
      Unload();
      throw RowDeviceError("CUDA does not load the kernels");
    }
}

CudaKernels::~CudaKernels() {
  const CudaDevice::Current current(*device_);
  Unload();
}

void CudaKernels::Unload() {
  for (const cuda::Module module : modules_)
    if (module) device_->functions().unload_module(module);
}

CudaRowDevice::CudaRowDevice(std::shared_ptr<CudaDevice> device, const std::string& name,
                             const CudaKernels::Texts& ptx, const RowLimits& limits)
    : device_(std::move(device)),
      name_(name),
      programs_(std::make_shared<const CudaKernels>(device_, ptx)),
      limits_(limits) {
  FindKernels();
}

CudaRowDevice::CudaRowDevice(const CudaRowDevice& other)
    : RowDevice(),
      device_(other.device_),
      name_(other.name_),
      programs_(other.programs_),
      limits_(other.limits_) {
  FindKernels();
}

std::unique_ptr<rows::RowDevice> CudaRowDevice::Another() const {
  return std::make_unique<CudaRowDevice>(*this);
}

void CudaRowDevice::Check(cuda::Result result, const std::string& what) const {
  if (result == 0) return;
  const char* name = nullptr;
  device_->functions().get_error_name(result, &name);
  throw RowDeviceError(name_ + ": CUDA reports " + (name ? name : std::to_string(result)) +
                       " for " + what);
}

void CudaRowDevice::FindKernels() {
  const CudaDevice::Current current(*device_);
  for (size_t i = 0; i < kRowKernels; i++) {
    const RowKernelInfo& info = kRowKernelInfos[i];
    int most = 0;
    Check(
        device_->functions().get_function(&kernels_[i], programs_->module(info.program), info.name),
        info.name);
    Check(device_->functions().get_attribute(&most, cuda::kMaxThreadsPerBlock, kernels_[i]),
          info.name);
    LowerLimits(info.item, static_cast<size_t>(most), &limits_);
  }
}

/// Calls f() in the device's context.
template <typename F>
void CudaRowDevice::Call(F f) {
  if (getpid() != process_) throw RowDeviceError("this process has been forked");
  const CudaDevice::Current current(*device_);
  if (!current) throw RowDeviceError(name_ + ": CUDA has lost its context");
  f();
}

template <typename... Arguments>
void CudaRowDevice::Launch(RowKernel kernel, size_t groups, size_t items, unsigned worlds,
                           Arguments... arguments) {
  void* addresses[] = {&arguments...};
  Check(device_->functions().launch(kernels_[kernel], static_cast<unsigned>(groups), 1, 1,
                                    static_cast<unsigned>(items), worlds, 1, 0, nullptr, addresses,
                                    nullptr),
        "a kernel");
}

/// Starts a kernel with work-groups of worlds.
template <typename... Arguments>
void CudaRowDevice::LaunchForWorlds(RowKernel kernel, size_t worlds, Arguments... arguments) {
  ForEachRowLaunch(worlds, groups_, [&](uint32_t first, size_t groups, unsigned of_group) {
    Launch(kernel, groups, groups_.items, of_group, first, arguments...);
  });
}

/// Starts a kernel with a work-item for each of `count` entries of each world.
template <typename... Arguments>
void CudaRowDevice::LaunchForEntries(RowKernel kernel, const rows::RowChoice& worlds,
                                     uint32_t count, Arguments... arguments) {
  const cuda::Address list = SendList(worlds.list);
  const cuda::Address flags = Send(worlds.flags, "flags", &flags_);
  rows::ForEachPartOfEntries(
      worlds_, worlds, count, [&](uint32_t first, uint32_t all, size_t items) {
        Launch(kernel, (items + limits_.entry_items - 1) / limits_.entry_items, limits_.entry_items,
               1, list, flags, worlds.kind, first, all, count, arguments...);
      });
}

template <typename T>
CudaBytes CudaRowDevice::BytesOf(std::span<const T> elements, const std::string& name) {
  CudaBytes bytes(device_, elements.size_bytes(), name);
  if (!elements.empty())
    Check(device_->functions().to_device(bytes.address(), elements.data(), elements.size_bytes()),
          name);
  return bytes;
}

/// Writes data for the next kernel to memory that is kept.
cuda::Address CudaRowDevice::Send(std::span<const std::byte> data, const std::string& name,
                                  CudaBytes* to) {
  if (to->size() < data.size() || to->size() == 0)
    *to = CudaBytes(device_, std::max<size_t>((to->size() > 0 ? 2 : 1) * data.size(), 8), name);
  if (!data.empty())
    Check(device_->functions().to_device(to->address(), data.data(), data.size()), name);
  return to->address();
}

/// Sends the list of worlds, unless it has been sent before.
cuda::Address CudaRowDevice::SendList(std::span<const uint32_t> worlds) {
  if (list_.size() > 0 && (worlds.empty() || std::ranges::equal(worlds, list_on_device_)))
    return list_.address();
  list_on_device_.assign(worlds.begin(), worlds.end());
  return Send(std::as_bytes(worlds), "the numbers of worlds", &list_);
}

void CudaRowDevice::Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) {
  Call([&] {
    Check(device_->functions().synchronize(), "earlier work");
    worlds_ = buffers.worlds;
    groups_ = ChooseRowGroups(buffers, limits_);
    outlines_ = rows::HasOutlines(image);
    of_islands_ = ChooseIslandGroups(buffers, groups_, limits_);
    Send(std::as_bytes(image), "the scene", &image_);
    if (state_.size() != buffers.state_bytes)
      state_ = CudaBytes(device_, buffers.state_bytes, "the state of all worlds");
    if (scratch_.size() != buffers.scratch_bytes)
      scratch_ = CudaBytes(device_, buffers.scratch_bytes, "steps of all worlds");
  });
}

void CudaRowDevice::Write(size_t offset, const void* from, size_t bytes) {
  Call([&] {
    Check(device_->functions().to_device(state_.address() + offset, from, bytes), "the state");
  });
}

void CudaRowDevice::Read(size_t offset, void* to, size_t bytes) {
  Call([&] {
    Check(device_->functions().to_host(to, state_.address() + offset, bytes), "the state");
  });
}

std::shared_ptr<std::byte> CudaRowDevice::MakeHostMemory(size_t bytes) {
  void* memory = nullptr;
  Call([&] {
    Check(device_->functions().allocate_on_host(&memory, std::max<size_t>(bytes, 1)),
          "memory of the host");
  });
  return {static_cast<std::byte*>(memory), [device = device_](std::byte* held) {
            const CudaDevice::Current current(*device);
            device->functions().free_on_host(held);
          }};
}

/// Starts to solve islands of all worlds, see kernels/islands.cl.
void CudaRowDevice::SolveIslands(const IslandLaunch& launch) {
  Launch(launch.kernel, of_islands_.groups, of_islands_.items, 1, image_.address(),
         state_.address(), scratch_.address(),
         static_cast<uint32_t>(of_islands_.groups * of_islands_.items), launch.kinds);
}

/// Steps all worlds, if is_list is 0, or those of the list.
void CudaRowDevice::StepWorlds(std::span<const uint32_t> worlds, uint32_t is_list, uint32_t steps,
                               uint32_t unseen) {
  if (steps == 0) return;
  const size_t count = is_list ? worlds.size() : worlds_;
  Call([&] {
    const cuda::Address list = SendList(worlds), image = image_.address(), state = state_.address(),
                        scratch = scratch_.address();
    if (!outlines_) {
      LaunchForWorlds(kStep, count, list, is_list, image, state, scratch, steps, unseen);
      return;
    }
    for (uint32_t left = steps; left-- > 0;) {
      LaunchForWorlds(kBeginOutlines, count, list, is_list, image, state, scratch, unseen + left);
      for (const IslandLaunch& launch : kIslandLaunches) SolveIslands(launch);
      LaunchForWorlds(kEndOutlines, count, list, is_list, image, state, scratch);
    }
  });
}

void CudaRowDevice::Step(uint32_t steps, uint32_t unseen) { StepWorlds({}, 0, steps, unseen); }

void CudaRowDevice::StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) {
  StepWorlds(worlds, 1, steps, unseen);
}

void CudaRowDevice::Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
                          uint64_t columns) {
  if (worlds.empty()) return;
  Call([&] {
    const cuda::Address list = SendList(worlds);
    const cuda::Address of_worlds = Send(given, "the columns of worlds", &given_);
    LaunchForWorlds(kReset, worlds.size(), image_.address(), state_.address(), list, of_worlds,
                    columns, static_cast<uint32_t>(given.size() / worlds.size()));
  });
}

void CudaRowDevice::Restore(std::span<const uint32_t> worlds, const rows::RowStarts& starts,
                            std::span<const std::byte> given, uint64_t columns) {
  if (worlds.empty()) return;
  Call([&] {
    const cuda::Address list = SendList(worlds);
    const cuda::Address states = Send(starts.states, "the states of worlds", &starts_);
    const cuda::Address start_of =
        Send(std::as_bytes(starts.of_world), "the numbers of states", &start_of_);
    const cuda::Address of_worlds = Send(given, "the columns of worlds", &given_);
    LaunchForWorlds(kRestore, worlds.size(), image_.address(), state_.address(), list, states,
                    start_of, static_cast<uint32_t>(starts.bytes / sizeof(uint64_t)), of_worlds,
                    columns, static_cast<uint32_t>(given.size() / worlds.size()));
  });
}

void CudaRowDevice::Give(std::span<const row_given_t> commands) {
  if (commands.empty()) return;
  Call([&] {
    const cuda::Address given = Send(std::as_bytes(commands), "commands", &commands_);
    Launch(kGive, (commands.size() + limits_.entry_items - 1) / limits_.entry_items,
           limits_.entry_items, 1, image_.address(), state_.address(), given,
           static_cast<uint32_t>(commands.size()));
  });
}

void CudaRowDevice::Finish() { WaitForCuda(); }

void CudaRowDevice::WaitForCuda() {
  Call([&] { Check(device_->functions().synchronize(), "earlier work"); });
}

// ---- arrays -------------------------------------------------------------------------------------

std::shared_ptr<rows::RowMemory> CudaRowDevice::MakeMemory(size_t bytes) {
  return std::make_shared<CudaRowMemory>(device_, bytes);
}

void CudaRowDevice::SetParts(rows::RowMemory* memory, const std::vector<rows::RowPart>& parts) {
  Call([&] {
    auto& known = static_cast<CudaRowMemory*>(memory)->parts_;
    known.clear();
    for (const rows::RowPart& part : parts)
      known.push_back({part.array, static_cast<uint32_t>(part.entries.size()),
                       BytesOf(std::span(part.entries), "the entries of an array"),
                       BytesOf(std::span(part.values), "the values of an array")});
  });
}

void CudaRowDevice::Gather(rows::RowMemory* memory, const rows::RowChoice& worlds, size_t offset) {
  Call([&] {
    const auto& to = static_cast<const CudaRowMemory&>(*memory);
    for (const CudaRowMemory::Part& part : to.parts_)
      LaunchForEntries(kGather, worlds, part.count, image_.address(), state_.address(),
                       part.entries.address(), part.values.address(), part.array.kind,
                       part.array.column, part.array.elements, part.array.of_readings,
                       to.bytes_.address(), uint64_t{offset});
  });
}

void CudaRowDevice::GiveCommands(rows::RowMemory* memory, const rows::RowChoice& worlds) {
  Call([&] {
    const auto& from = static_cast<const CudaRowMemory&>(*memory);
    for (const CudaRowMemory::Part& part : from.parts_)
      LaunchForEntries(kCommand, worlds, part.count, image_.address(), state_.address(),
                       part.entries.address(), part.array.elements, from.bytes_.address());
  });
}

void CudaRowDevice::Clear(rows::RowMemory* memory, const rows::RowChoice& worlds,
                          uint32_t words_per_world) {
  Call([&] {
    LaunchForEntries(kClear, worlds, words_per_world,
                     static_cast<const CudaRowMemory&>(*memory).bytes_.address());
  });
}

/// Sends data of a client, unless it is in CUDA's memory already.
cuda::Address CudaRowDevice::Send(const rows::RowInput& input, const std::string& name,
                                  CudaBytes* to) {
  if (input.is_in_cuda) return reinterpret_cast<cuda::Address>(input.data);
  return Send(std::span(static_cast<const std::byte*>(input.data), input.bytes), name, to);
}

void CudaRowDevice::Place(const std::vector<row_entry_t>& entries, uint32_t robots,
                          const rows::RowInput& poses, const rows::RowInput& chosen) {
  Call([&] {
    LaunchForWorlds(kPlace, worlds_, image_.address(), state_.address(), scratch_.address(),
                    Send(std::as_bytes(std::span(entries)), "the entries of poses", &entries_),
                    static_cast<uint32_t>(entries.size()), robots, Send(poses, "poses", &poses_),
                    Send(chosen, "flags", &flags_));
  });
}

void CudaRowDevice::ResetFlagged(const rows::RowInput& flags) {
  Call([&] {
    LaunchForWorlds(kResetFlagged, worlds_, image_.address(), state_.address(),
                    Send(flags, "flags", &flags_));
  });
}

void CudaRowDevice::WriteMemory(rows::RowMemory* memory, const void* from) {
  Call([&] {
    const CudaBytes& to = static_cast<const CudaRowMemory&>(*memory).bytes_;
    Check(device_->functions().to_device(to.address(), from, memory->bytes()), "an array");
  });
}

void CudaRowDevice::ReadMemory(rows::RowMemory* memory, void* to, size_t bytes) {
  Call([&] {
    const CudaBytes& from = static_cast<const CudaRowMemory&>(*memory).bytes_;
    Check(device_->functions().to_host(to, from.address(), bytes), "an array");
  });
}

}  // namespace Stg::cl
