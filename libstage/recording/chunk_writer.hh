// SPDX-License-Identifier: GPL-2.0-or-later
//
// The file of a log: chunks are packed and written by a thread of their own, while the simulation
// goes on. Who does it has no influence on the bytes.

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

/// Records that are packed together.
struct Chunk {
  struct Entry {
    uint64_t time, offset;
    uint16_t channel;
  };
  Buffer records;
  std::vector<Entry> messages;  // in their order
  uint64_t start = ~uint64_t{0}, end = 0;

  void Clear();
};

/// Of all chunks that are written.
struct ChunkTotals {
  uint32_t count = 0;
  uint64_t start = ~uint64_t{0}, end = 0;
};

class ChunkWriter {
 public:
  /// Throws std::runtime_error if the file can't be written, or holds something else than a log.
  ChunkWriter(const std::string& name, Compression compression);
  ~ChunkWriter();
  ChunkWriter(const ChunkWriter&) = delete;
  ChunkWriter& operator=(const ChunkWriter&) = delete;

  /// One to be filled.
  std::unique_ptr<Chunk> Spare();
  /// Waits as long as kMostWaiting others are still to be written.
  void Hand(std::unique_ptr<Chunk> chunk);
  /// Until all that was handed over is written.
  void Finish();
  /// One line, once something went wrong: then nothing more is written.
  std::string problem() const;

  // While no chunk is waiting.

  void Append(std::string_view part);
  uint64_t size() const { return file_.size(); }
  const ChunkTotals& totals() const { return totals_; }
  /// Calls take(part) for the records that say where chunks lie, one after the other.
  void ReadChunkIndexes(const std::function<void(std::string_view)>& take);
  void Close();

 private:
  static constexpr size_t kMostWaiting = 4;

  void Work();
  void Write(const Chunk& chunk);
  using Places = std::vector<std::pair<uint16_t, uint64_t>>;  // of a channel: where its index lies
  void PutMessageIndexes(const Chunk& chunk);
  void KeepChunkIndex(const Chunk& chunk, uint64_t length, uint64_t packed_size);
  void Fail(const std::string& what);

  const std::string name_;
  const Compression compression_;
  Compressor compressor_;
  files::GrowingFile file_;
  ChunkTotals totals_;
  files::ScratchFile chunk_indexes_;  // in a crowd, a tenth of the log: too much for memory
  Places index_places_;               // of the chunk in the making
  Buffer part_, chunk_index_;         // of the file, in the making
  std::vector<uint32_t> places_of_;   // of each channel, in the list below; then where its end is
  std::vector<Chunk::Entry> sorted_;

  mutable std::mutex mutex_;
  std::condition_variable work_, done_;
  std::deque<std::unique_ptr<Chunk>> waiting_;
  std::vector<std::unique_ptr<Chunk>> spare_;
  std::string problem_;
  bool busy_ = false, stop_ = false;
  std::thread thread_;  // not joinable: the system has granted none
};

}  // namespace Stg::recording

#endif
