// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/buffer.hh"

#include <algorithm>

namespace Stg::cl {

Buffer::~Buffer() {
  try {
    Unmap();
  } catch (const ::cl::Error&) {
    // The device is lost; so is the buffer.
  }
}

bool Buffer::Reserve(std::size_t bytes) {
  bytes = std::max<std::size_t>(bytes, 64);  // an empty buffer is an error in OpenCL
  if (bytes <= capacity_) return false;
  Unmap();
  const std::size_t roomy = bytes + bytes / 2;
  memory_ = ::cl::Buffer(context_, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, roomy);
  capacity_ = roomy;
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
  // 1.1 has no way to say that the old contents don't matter.
  mapped_ =
      queue_.enqueueMapBuffer(memory_, CL_TRUE, CL_MAP_WRITE, 0, std::max<std::size_t>(bytes, 1));
  return mapped_;
}

const void* Buffer::MapForReading(std::size_t bytes) {
  Unmap();
  mapped_ =
      queue_.enqueueMapBuffer(memory_, CL_TRUE, CL_MAP_READ, 0, std::max<std::size_t>(bytes, 1));
  return mapped_;
}

void Buffer::Unmap() {
  if (!mapped_) return;
  queue_.enqueueUnmapMemObject(memory_, mapped_);
  mapped_ = nullptr;
}

}  // namespace Stg::cl
