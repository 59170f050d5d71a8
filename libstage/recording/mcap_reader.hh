// SPDX-License-Identifier: GPL-2.0-or-later
//
// Reads MCAP files, including truncated ones. Opening a file reads the heads of its records and the
// channel names, which follow the chunks in a complete file. Chunks are decompressed and checked on
// demand. Memory holds only names, attachments and chunk locations, within the limits of
// mcap_format.hh.

#ifndef STAGE_RECORDING_MCAP_READER_HH
#define STAGE_RECORDING_MCAP_READER_HH

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "recording/buffer.hh"
#include "recording/mcap_format.hh"

namespace Stg::recording {

/// Reads fields from the front of a record. Missing fields read as 0 or empty and make is_good()
/// false.
class FieldReader {
 public:
  explicit FieldReader(std::string_view fields) : left_(fields) {}

  template <typename T>
  T Get() {
    T value = 0;
    const std::string_view bytes = Take(sizeof value);
    if (good_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view GetText() { return Take(Get<uint32_t>()); }
  std::string_view GetLongText() { return Take(Get<uint64_t>()); }
  std::string_view left() const { return left_; }
  bool is_good() const { return good_; }

 private:
  std::string_view Take(uint64_t size) {
    good_ = good_ && size <= left_.size();
    if (!good_) return {};
    const std::string_view bytes = left_.substr(0, static_cast<size_t>(size));
    left_.remove_prefix(bytes.size());
    return bytes;
  }

  std::string_view left_;
  bool good_ = true;
};

struct Message {
  uint16_t channel;
  uint64_t time;  // ns
  std::string_view data;
};

/// Calls f(Op, std::string_view fields) for each record. False if the last one is incomplete.
template <typename F>
bool ForEachRecord(std::string_view records, F f) {
  while (!records.empty()) {
    FieldReader head(records);
    const auto op = static_cast<Op>(head.Get<uint8_t>());
    const std::string_view fields = head.GetLongText();
    if (!head.is_good()) return false;
    f(op, fields);
    records = head.left();
  }
  return true;
}

/// Parses a message record. Sets null data if the record is invalid.
Message MessageOf(std::string_view fields);

class McapReader {
 public:
  struct Channel {
    std::string topic, type;
  };
  struct Chunk {
    uint64_t start, end;      // ns
    uint64_t offset, length;  // of its fields in the file
  };

  /// Throws std::runtime_error with one line that names the file, if it is not MCAP or is damaged
  /// outside of its chunks. A truncated file is valid up to its last complete record.
  explicit McapReader(const std::string& file);
  ~McapReader();
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;

  bool ends_early() const { return ends_early_; }
  const std::map<uint16_t, Channel>& channels() const { return channels_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }
  /// Attachments as (name, content), in file order.
  const std::vector<std::pair<std::string, std::string>>& attachments() const {
    return attachments_;
  }
  /// Returns an empty map if there is no metadata of that name.
  const std::map<std::string, std::string>& metadata(const std::string& name) const;
  /// Reads and decompresses the records of a chunk. Throws std::runtime_error with one line that
  /// names the file, if the chunk is damaged.
  void Read(const Chunk& chunk, Buffer* records) const;

 private:
  [[noreturn]] void Fail(const std::string& what) const;
  [[noreturn]] void FailAt(uint64_t offset, const std::string& problem) const;
  void ReadBytes(uint64_t offset, uint64_t size, Buffer* to) const;
  std::string_view ReadAhead(uint64_t offset, uint64_t size);
  void Scan();
  void Take(Op op, uint64_t offset, uint64_t length);
  void ReadChunkRecord(uint64_t offset, uint64_t length);
  void ReadAttachment(std::string_view fields);
  void ReadMetadata(std::string_view fields);
  void ReadNames(Op op, std::string_view fields);
  void ReadNamesFromChunks();
  void Decompress(std::string_view fields, uint64_t offset, Buffer* records) const;

  const std::string name_;
  int file_ = -1;
  uint64_t size_ = 0;
  bool ends_early_ = true;
  uint64_t attachment_bytes_ = 0, name_bytes_ = 0;  // read so far
  Buffer window_;                                   // a cached piece of the file, for record heads
  uint64_t window_offset_ = 0;
  std::map<uint16_t, std::string> types_;
  std::map<uint16_t, Channel> channels_;
  std::vector<Chunk> chunks_;
  std::vector<std::pair<std::string, std::string>> attachments_;
  std::map<std::string, std::map<std::string, std::string>> metadata_;
};

}  // namespace Stg::recording

#endif
