// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/buffer.hh"

#include <algorithm>
#include <cstring>
#include <utility>

#include "messages/assert.hh"

namespace Stg::cl {

namespace {

// Size of a cache line. Processors with shared memory keep it coherent by whole lines; if a range
// ended within one, drivers would copy the rest of the line aside.
constexpr std::size_t kLine = 64;

std::size_t WholeLines(std::size_t bytes) { return (bytes + kLine - 1) / kLine * kLine; }

}  // namespace

PinnedMemory::~PinnedMemory() {
  try {
    Release(0);
  } catch (const ::cl::Error&) {
    // The device is lost, and its memory with it.
  }
}

void* PinnedMemory::Take(std::size_t bytes) {
  constexpr std::size_t kAlignment = 256;
  bytes = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  // A new block has room for all that was taken so far, so that later it suffices alone.
  if (blocks_.empty() || used_ + bytes > blocks_.back().size) AddBlock(taken_ + bytes);
  STAGE_ASSERT(used_ + bytes <= blocks_.back().size);
  char* space = blocks_.back().data + used_;
  used_ += bytes;
  taken_ += bytes;
  return space;
}

void PinnedMemory::AddBlock(std::size_t bytes) {
  constexpr std::size_t kMinBytes = 1 << 16;
  const std::size_t size = WholeLines(std::max(bytes + bytes / 2, kMinBytes));
  const ::cl::Buffer buffer(context_, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, size);
  void* data = queue_.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_READ | CL_MAP_WRITE, 0, size);
  counts_.bytes_mapped += size;
  blocks_.push_back({buffer, static_cast<char*>(data), size});
  used_ = 0;
}

void PinnedMemory::Reset() {
  Release(std::min<std::size_t>(blocks_.size(), 1));
  used_ = taken_ = 0;
}

void PinnedMemory::Release(std::size_t kept) {
  const auto end = blocks_.end() - static_cast<std::ptrdiff_t>(kept);
  for (auto block = blocks_.begin(); block != end; ++block)
    queue_.enqueueUnmapMemObject(block->buffer, block->data);
  blocks_.erase(blocks_.begin(), end);
}

Buffer::~Buffer() {
  try {
    Unmap();
  } catch (const ::cl::Error&) {
    // The device is lost, and the buffer with it.
  }
}

bool Buffer::Reserve(std::size_t bytes) {
  bytes = std::max(bytes, kLine);  // OpenCL rejects empty buffers
  if (bytes <= capacity_) return false;
  Unmap();
  const std::size_t padded = WholeLines(bytes + bytes / 2);
  const cl_mem_flags where = common_.shared ? CL_MEM_ALLOC_HOST_PTR : 0;
  memory_ = ::cl::Buffer(common_.context, CL_MEM_READ_WRITE | where, padded);
  capacity_ = padded;
  return true;
}

void Buffer::Write(const void* data, std::size_t bytes) {
  if (bytes == 0) {
    Reserve(0);
    return;
  }
  std::memcpy(MapForWriting(bytes), data, bytes);
  Unmap();
}

void* Buffer::MapForWriting(std::size_t bytes) {
  Reserve(bytes);
  Unmap();
  bytes = std::max<std::size_t>(bytes, 1);
  STAGE_ASSERT(mapped_ == nullptr && bytes <= capacity_);
  common_.counts.bytes_copied += bytes;
  // OpenCL 1.1 cannot express that the old contents do not matter.
  if (common_.shared) return Map(CL_MAP_WRITE, bytes, nullptr);
  to_send_ = bytes;
  return mapped_ = common_.to_device.Take(bytes);
}

/// Maps the start of the buffer. Waits, unless `done` is given to signal completion.
void* Buffer::Map(cl_map_flags flags, std::size_t bytes, ::cl::Event* done) {
  bytes = WholeLines(std::max<std::size_t>(bytes, 1));
  mapped_ = common_.queue.enqueueMapBuffer(memory_, done ? CL_FALSE : CL_TRUE, flags, 0, bytes,
                                           nullptr, done);
  common_.counts.bytes_mapped += bytes;
  return mapped_;
}

const void* Buffer::StartReading(std::size_t bytes, std::size_t begin, std::size_t end,
                                 ::cl::Event* done) {
  STAGE_ASSERT(begin <= end && end <= bytes && bytes <= std::max(capacity_, kLine));
  if (common_.shared) {
    Unmap();
    return Map(CL_MAP_READ, bytes, done);
  }
  if (begin == 0) reading_ = static_cast<char*>(common_.from_device.Take(bytes));
  STAGE_ASSERT(reading_);  // parts arrive in order, the first one first
  if (begin == end) return reading_;
  common_.queue.enqueueReadBuffer(memory_, CL_FALSE, begin, end - begin, reading_ + begin, nullptr,
                                  done);
  common_.counts.bytes_copied += end - begin;
  return reading_;
}

void Buffer::Unmap() {
  if (mapped_ == nullptr) return;
  void* const data = std::exchange(mapped_, nullptr);  // only once, even if this fails
  const std::size_t bytes = std::exchange(to_send_, 0);
  if (bytes > 0)
    common_.queue.enqueueWriteBuffer(memory_, CL_FALSE, 0, bytes, data);
  else
    common_.queue.enqueueUnmapMemObject(memory_, data);
  common_.counts.bytes_copied += bytes;
}

}  // namespace Stg::cl
