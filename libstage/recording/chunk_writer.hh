// SPDX-License-Identifier: GPL-2.0-or-later
//
// The file of a log: chunks are packed and written by a thread of their own, while the simulation
// goes on. Who does it has no influence on the bytes.

#ifndef STAGE_RECORDING_CHUNK_WRITER_HH
#define STAGE_RECORDING_CHUNK_WRITER_HH

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "files/growing_file.hh"
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

/// Where a chunk lies, for the summary.
struct ChunkPlace {
  uint64_t start, end;      // of its messages' times
  uint64_t offset, length;  // of its record
  uint64_t index_length;    // of the message indexes behind it
  uint64_t packed_size, plain_size;
  std::vector<std::pair<uint16_t, uint64_t>> indexes;  // of a channel: where it lies
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
  Compression compression() const { return compression_; }
  const std::vector<ChunkPlace>& places() const { return places_; }
  void Close();

 private:
  static constexpr size_t kMostWaiting = 4;

  void Work();
  void Write(const Chunk& chunk);
  void PutIndexes(const Chunk& chunk, ChunkPlace* place);
  void Fail(const std::string& what);

  const std::string name_;
  const Compression compression_;
  Compressor compressor_;
  files::GrowingFile file_;
  std::vector<ChunkPlace> places_;
  Buffer part_;                      // of the file, in the making
  std::vector<uint32_t> places_of_;  // of each channel, in the list below; then where its end is
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
