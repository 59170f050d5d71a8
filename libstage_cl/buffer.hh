// SPDX-License-Identifier: GPL-2.0-or-later
//
// Buffers that host and device share by mapping: without a copy where they share memory, through
// pinned memory where they don't.

#ifndef STAGE_CL_BUFFER_HH
#define STAGE_CL_BUFFER_HH

#include <cstddef>
#include <cstring>

#include "libstage_cl/opencl.hh"

namespace Stg::cl {

class Buffer {
 public:
  Buffer(const ::cl::Context& context, const ::cl::CommandQueue& queue)
      : context_(context), queue_(queue) {}
  ~Buffer();
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  /// Makes room for so many bytes; what was in it is lost if it has to grow. True if it had to.
  bool Reserve(std::size_t bytes);
  /// Writes to its beginning, after making room.
  void Write(const void* data, std::size_t bytes);
  /// For the host to write into; Unmap() hands it back to the device.
  void* MapForWriting(std::size_t bytes);
  /// For the host to read what the device wrote; stays mapped until Unmap().
  const void* MapForReading(std::size_t bytes);
  void Unmap();

  const ::cl::Buffer& memory() const { return memory_; }

 private:
  ::cl::Context context_;
  ::cl::CommandQueue queue_;
  ::cl::Buffer memory_;
  std::size_t capacity_ = 0;
  void* mapped_ = nullptr;
};

}  // namespace Stg::cl

#endif
