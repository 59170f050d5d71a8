// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/row_device.hh"

#include <algorithm>
#include <string>
#include <utility>

namespace Stg::cl {

namespace {

using rows::RowDeviceError;

// Work-items for a world. A CPU runs the work-items of a group one after the other.
constexpr size_t kWorkItemsOfCpu = 1, kWorkItemsOfGpu = 32;

}  // namespace

ClRowDevice::ClRowDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch,
                         uint32_t work_items)
    : device_(device, std::move(watch), Kernels::kRows),
      queue_(device_.context, device_.found.device),
      step_(device_.program, "step_rows"),
      reset_(device_.program, "reset_rows"),
      work_items_(work_items > 0         ? work_items
                  : device.kind == "cpu" ? kWorkItemsOfCpu
                                         : kWorkItemsOfGpu) {
  for (const ::cl::Kernel* const kernel : {&step_, &reset_})
    work_items_ = std::min<size_t>(
        work_items_, kernel->getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device_.found.device));
}

std::string ClRowDevice::Name() const {
  const FoundDevice& found = device_.found;
  return found.kind + " " + found.name + " (" + found.platform + ")";
}

/// Calls f() and translates errors.
template <typename F>
void ClRowDevice::Call(F f) {
  if (getpid() != process_) throw RowDeviceError("this process has been forked");
  calls::SetDriver(device_.found.platform);  // the thread may use other drivers too
  try {
    f();
  } catch (const ::cl::Error& error) {
    throw RowDeviceError(Name() + ": " + error.what() + ", error " + std::to_string(error.err()));
  }
}

::cl::Buffer ClRowDevice::MakeBuffer(size_t bytes, const std::string& name) const {
  const uint64_t most = device_.found.device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  if (bytes > most)
    throw RowDeviceError(Name() + ": " + name + " takes " + std::to_string(bytes) +
                         " bytes, a buffer has at most " + std::to_string(most));
  return ::cl::Buffer(device_.context, CL_MEM_READ_WRITE, std::max<size_t>(bytes, 1));
}

void ClRowDevice::Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) {
  Call([&] {
    queue_.finish();
    worlds_ = buffers.worlds;
    image_ = MakeBuffer(image.size_bytes(), "the scene");
    state_ = MakeBuffer(buffers.state_bytes, "the state of all worlds");
    scratch_ = MakeBuffer(buffers.scratch_bytes, "memory for steps of all worlds");
    queue_.enqueueWriteBuffer(image_, CL_TRUE, 0, image.size_bytes(), image.data());
  });
}

void ClRowDevice::Write(size_t offset, const void* from, size_t bytes) {
  Call([&] { queue_.enqueueWriteBuffer(state_, CL_TRUE, offset, bytes, from); });
}

void ClRowDevice::Read(size_t offset, void* to, size_t bytes) {
  Call([&] { queue_.enqueueReadBuffer(state_, CL_TRUE, offset, bytes, to); });
}

/// Starts a kernel with a work-group for each world.
void ClRowDevice::Launch(const ::cl::Kernel& kernel, size_t worlds) {
  queue_.enqueueNDRangeKernel(kernel, ::cl::NullRange, ::cl::NDRange(worlds * work_items_),
                              ::cl::NDRange(work_items_));
  queue_.flush();
}

void ClRowDevice::Step(uint32_t steps) {
  if (worlds_ == 0 || steps == 0) return;
  Call([&] {
    step_.setArg(0, image_);
    step_.setArg(1, state_);
    step_.setArg(2, scratch_);
    step_.setArg(3, static_cast<cl_uint>(steps));
    Launch(step_, worlds_);
  });
}

void ClRowDevice::Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
                        uint32_t columns) {
  if (worlds.empty()) return;
  Call([&] {
    // Writing waits, so the caller may change its data; the buffers live until the kernel has
    // ended.
    const ::cl::Buffer numbers = MakeBuffer(worlds.size_bytes(), "the numbers of worlds");
    const ::cl::Buffer columns_given = MakeBuffer(given.size(), "the columns of worlds");
    queue_.enqueueWriteBuffer(numbers, CL_TRUE, 0, worlds.size_bytes(), worlds.data());
    if (!given.empty())
      queue_.enqueueWriteBuffer(columns_given, CL_TRUE, 0, given.size(), given.data());
    reset_.setArg(0, image_);
    reset_.setArg(1, state_);
    reset_.setArg(2, numbers);
    reset_.setArg(3, columns_given);
    reset_.setArg(4, static_cast<cl_uint>(columns));
    reset_.setArg(5, static_cast<cl_uint>(given.size() / worlds.size()));
    Launch(reset_, worlds.size());
  });
}

void ClRowDevice::Finish() {
  Call([&] { queue_.finish(); });
}

}  // namespace Stg::cl
