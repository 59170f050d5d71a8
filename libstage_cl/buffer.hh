// SPDX-License-Identifier: GPL-2.0-or-later
//
// Buffers that the host writes and reads. Where host and device share memory, the host maps them
// and nothing is copied. To a device with separate memory, contents are transferred through pinned
// memory, without the host waiting.

#ifndef STAGE_CL_BUFFER_HH
#define STAGE_CL_BUFFER_HH

#include <cstddef>
#include <vector>

#include "libstage_cl/opencl.hh"
#include "sensing/prefilter.hh"

namespace Stg::cl {

/// Host memory that the device can access directly (DMA).
class PinnedMemory {
 public:
  PinnedMemory(const ::cl::Context& context, const ::cl::CommandQueue& queue,
               sensing::PrefilterStatistics* counts)
      : context_(context), queue_(queue), counts_(*counts) {}
  ~PinnedMemory();
  PinnedMemory(const PinnedMemory&) = delete;
  PinnedMemory& operator=(const PinnedMemory&) = delete;

  /// Allocates `bytes` bytes, which are valid until Reset().
  void* Take(std::size_t bytes);
  /// Frees all allocations. No transfer may be in progress.
  void Reset();

 private:
  struct Block {
    ::cl::Buffer buffer;
    char* data;
    std::size_t size;
  };
  void AddBlock(std::size_t bytes);
  /// Frees all blocks but the last `kept` ones.
  void Release(std::size_t kept);

  ::cl::Context context_;
  ::cl::CommandQueue queue_;
  sensing::PrefilterStatistics& counts_;
  std::vector<Block> blocks_;  // allocations come from the last one
  std::size_t used_ = 0;       // bytes of the last block
  std::size_t taken_ = 0;      // bytes since Reset()
};

/// State that all buffers of a prefilter share.
struct Memory {
  /// `counts` receives the numbers of bytes mapped and copied.
  Memory(const ::cl::Context& context_, const ::cl::CommandQueue& queue_, bool shared_,
         sensing::PrefilterStatistics* counts_)
      : context(context_),
        queue(queue_),
        shared(shared_),
        counts(*counts_),
        to_device(context_, queue_, counts_),
        from_device(context_, queue_, counts_) {}

  ::cl::Context context;
  ::cl::CommandQueue queue;
  bool shared;  ///< host and device share memory
  sensing::PrefilterStatistics& counts;
  PinnedMemory to_device, from_device;
};

class Buffer {
 public:
  explicit Buffer(Memory* memory) : common_(*memory) {}
  ~Buffer();
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  /// Ensures a capacity of `bytes`. Returns true if it reallocated, which loses the content.
  bool Reserve(std::size_t bytes);
  /// Writes to the start of the buffer, after Reserve().
  void Write(const void* data, std::size_t bytes);
  /// Returns memory that the host must fill completely and then pass to the device by Unmap().
  void* MapForWriting(std::size_t bytes);
  /// Starts reading the first `bytes` bytes. The bytes from `begin` to `end` - 1 are valid when
  /// `done` has happened, until Unmap() or until pinned memory is reset. Leaves `done` alone if
  /// begin == end. Shared memory is mapped as a whole.
  const void* StartReading(std::size_t bytes, std::size_t begin, std::size_t end,
                           ::cl::Event* done);
  void Unmap();

  const ::cl::Buffer& memory() const { return memory_; }

 private:
  void* Map(cl_map_flags flags, std::size_t bytes, ::cl::Event* done);

  Memory& common_;
  ::cl::Buffer memory_;
  std::size_t capacity_ = 0;
  void* mapped_ = nullptr;
  char* reading_ = nullptr;  // pinned memory that parts are read into
  std::size_t to_send_ = 0;  // bytes of pinned memory that Unmap() sends
};

}  // namespace Stg::cl

#endif
