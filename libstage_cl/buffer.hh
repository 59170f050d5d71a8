// SPDX-License-Identifier: GPL-2.0-or-later
//
// Buffers that the host writes and reads. Where host and device share memory, the host maps them
// and nothing is copied. A device with memory of its own gets and gives their contents through
// pinned memory, without the host waiting.

#ifndef STAGE_CL_BUFFER_HH
#define STAGE_CL_BUFFER_HH

#include <cstddef>
#include <vector>

#include "libstage_cl/opencl.hh"
#include "sensing/prefilter.hh"

namespace Stg::cl {

/// Memory of the host that the device can fetch from by itself.
class PinnedMemory {
 public:
  PinnedMemory(const ::cl::Context& context, const ::cl::CommandQueue& queue,
               sensing::PrefilterStatistics* counts)
      : context_(context), queue_(queue), counts_(*counts) {}
  ~PinnedMemory();
  PinnedMemory(const PinnedMemory&) = delete;
  PinnedMemory& operator=(const PinnedMemory&) = delete;

  /// Room for so many bytes, until Reset().
  void* Take(std::size_t bytes);
  /// All room is free again; no transfer must be under way.
  void Reset();

 private:
  struct Block {
    ::cl::Buffer buffer;
    char* data;
    std::size_t size;
  };
  void AddBlock(std::size_t bytes);
  /// All blocks but the last `kept` ones.
  void Release(std::size_t kept);

  ::cl::Context context_;
  ::cl::CommandQueue queue_;
  sensing::PrefilterStatistics& counts_;
  std::vector<Block> blocks_;  // room is taken from the last one
  std::size_t used_ = 0;       // of that one
  std::size_t taken_ = 0;      // of all, since Reset()
};

/// What all buffers of a prefilter share.
struct Memory {
  /// `counts`: bytes that are mapped or copied are added there.
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
  bool shared;  ///< by host and device
  sensing::PrefilterStatistics& counts;
  PinnedMemory to_device, from_device;
};

class Buffer {
 public:
  explicit Buffer(Memory* memory) : common_(*memory) {}
  ~Buffer();
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  /// Makes room for so many bytes; what was in it is lost if it has to grow. True if it had to.
  bool Reserve(std::size_t bytes);
  /// Writes to its beginning, after making room.
  void Write(const void* data, std::size_t bytes);
  /// For the host to write all of; Unmap() hands it to the device. What was in it before is lost.
  void* MapForWriting(std::size_t bytes);
  /// What the device writes, `bytes` in all, for the host to read until Unmap() or until pinned
  /// memory is reset: those from `begin` to `end` - 1 are there as soon as `done` has happened,
  /// which stays as it is if these are none. All at once where memory is shared.
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
  char* reading_ = nullptr;  // pinned memory that parts of it are read into
  std::size_t to_send_ = 0;  // bytes of pinned memory, to be sent by Unmap()
};

}  // namespace Stg::cl

#endif
