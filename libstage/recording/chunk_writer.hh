// SPDX-License-Identifier: GPL-2.0-or-later
//
// Compresses and writes the chunks of a log in a separate thread while the simulation continues.
// The bytes do not depend on the thread.

#ifndef STAGE_RECORDING_CHUNK_WRITER_HH
#define STAGE_RECORDING_CHUNK_WRITER_HH

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "files/growing_file.hh"
#include "files/scratch_file.hh"
#include "recording/buffer.hh"
#include "recording/compression.hh"
#include "recording/mcap_format.hh"

namespace Stg::recording {

/// Records that are compressed together.
struct Chunk {
  struct Entry {
    uint64_t time, offset;
    uint16_t channel;
  };
  Buffer records;
  std::vector<Entry> messages;  // in the order of writing
  uint64_t start = ~uint64_t{0}, end = 0;

  void Clear();
};

/// Totals over all written chunks; times in ns.
struct ChunkTotals {
  uint32_t count = 0;
  uint64_t start = ~uint64_t{0}, end = 0;
};

class ChunkWriter {
 public:
  /// Throws std::runtime_error if the file cannot be written, or exists and is not a log.
  ChunkWriter(const std::string& name, Compression compression);
  ~ChunkWriter();
  ChunkWriter(const ChunkWriter&) = delete;
  ChunkWriter& operator=(const ChunkWriter&) = delete;

  /// Returns an empty chunk to fill.
  std::unique_ptr<Chunk> GetEmptyChunk();
  /// Queues a full chunk. Blocks while kMaxQueued chunks are queued.
  void Submit(std::unique_ptr<Chunk> chunk);
  /// Waits until all queued chunks are written.
  void Finish();
  /// One-line reason after a failure, else empty. Nothing is written after a failure.
  std::string problem() const;

  // The functions below may only be called while no chunk is queued.

  void Append(std::string_view part);
  uint64_t size() const { return file_.size(); }
  const ChunkTotals& totals() const { return totals_; }
  /// Calls take(part) for consecutive pieces of the records that locate the chunks.
  void ReadChunkIndexes(const std::function<void(std::string_view)>& take);
  void Close();

 private:
  static constexpr size_t kMaxQueued = 4;

  void Work();
  void Write(const Chunk& chunk);
  using IndexOffsets =
      std::vector<std::pair<uint16_t, uint64_t>>;  // (channel, file offset of its index)
  void PutMessageIndexes(const Chunk& chunk);
  void StoreChunkIndex(const Chunk& chunk, uint64_t length, uint64_t packed_size);
  void Fail(const std::string& what);

  const std::string name_;
  const Compression compression_;
  Compressor compressor_;
  files::GrowingFile file_;
  ChunkTotals totals_;
  files::ScratchFile chunk_indexes_;      // on disk, because it can reach a tenth of a large log
  IndexOffsets index_offsets_;            // for the current chunk
  Buffer buffer_, chunk_index_;           // serialization buffers
  std::vector<uint32_t> channel_ranges_;  // per channel: its start in sorted_, then its end
  std::vector<Chunk::Entry> sorted_;

  mutable std::mutex mutex_;
  std::condition_variable work_, done_;
  std::deque<std::unique_ptr<Chunk>> queue_;
  std::vector<std::unique_ptr<Chunk>> free_chunks_;
  std::string problem_;
  bool busy_ = false, stop_ = false;
  std::thread thread_;  // not joinable if the system refused to start a thread
};

}  // namespace Stg::recording

#endif
