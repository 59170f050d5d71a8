// SPDX-License-Identifier: GPL-2.0-or-later
//
// Writes MCAP files, https://mcap.dev: messages in chunks, indexes, a summary. A truncated file is
// readable up to its last complete chunk.

#ifndef STAGE_RECORDING_MCAP_WRITER_HH
#define STAGE_RECORDING_MCAP_WRITER_HH

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "recording/chunk_writer.hh"

namespace Stg::recording {

/// Times are in nanoseconds.
class McapWriter {
 public:
  using Texts = std::map<std::string, std::string>;

  /// Throws std::runtime_error if the file cannot be written, or exists and is not a log.
  McapWriter(const std::string& name, Compression compression, const std::string& profile,
             const std::string& library);

  /// Attachments and metadata must be added before the first message.
  void AddAttachment(const std::string& name, const std::string& media_type,
                     std::string_view content);
  void AddMetadata(const std::string& name, const Texts& texts);
  uint16_t AddSchema(const std::string& name, const std::string& encoding,
                     const std::string& definition);
  /// Throws std::runtime_error if there are too many channels.
  uint16_t AddChannel(uint16_t schema, const std::string& topic, const std::string& encoding,
                      const Texts& metadata);
  /// Reserves a message of `size` bytes. The caller fills them before the next call.
  uint8_t* AddMessage(uint16_t channel, uint64_t time, size_t size);
  /// Call after each step: it hands over a chunk that is old, which limits the loss in a crash.
  void EndStep();
  /// Writes the remaining chunk and the summary.
  void Finish();
  /// One-line reason after a failure, otherwise empty.
  std::string problem() const { return writer_.problem(); }

  uint64_t message_count() const;
  /// Call after Finish().
  uint64_t file_size() const { return writer_.size(); }

 private:
  struct Schema {
    std::string name, encoding, definition;
  };
  struct Channel {
    uint16_t schema;
    std::string topic, encoding;
    Texts metadata;
    uint64_t messages = 0;
  };
  class Summary;

  void SubmitChunk();
  void PutSchema(size_t index, Buffer* to) const;
  void PutChannel(size_t index, Buffer* to) const;
  void PutStatistics(Buffer* to) const;
  void WriteSummary();

  ChunkWriter writer_;
  std::unique_ptr<Chunk> chunk_;
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  Buffer attachment_indexes_, metadata_indexes_;
  uint32_t attachments_ = 0, metadata_ = 0;
};

}  // namespace Stg::recording

#endif
