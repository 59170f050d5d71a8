// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/mcap_writer.hh"

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace Stg::recording {

namespace {

// Minimum chunk size, except for old chunks. Larger chunks need less index space, but chunks that
// fit into the processor's caches take half the time to compress and write.
constexpr size_t kChunkSize = 1 << 20;
constexpr uint64_t kMaxChunkAge = 10'000'000'000;  // ns

/// A record under construction; the destructor sets its length.
class Record {
 public:
  Record(Op op, Buffer* to) : to_(*to), start_(to->size()) {
    to_.Put(static_cast<uint8_t>(op));
    to_.Put(uint64_t{0});
  }
  ~Record() { to_.Set(start_ + 1, uint64_t{to_.size() - start_ - kRecordHead}); }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

 private:
  Buffer& to_;
  const size_t start_;
};

/// The byte length in front of a list or a map; the destructor sets it.
class LengthPrefix {
 public:
  explicit LengthPrefix(Buffer* to) : to_(*to), start_(to->size()) { to_.Put(uint32_t{0}); }
  ~LengthPrefix() { to_.Set(start_, static_cast<uint32_t>(to_.size() - start_ - 4)); }
  LengthPrefix(const LengthPrefix&) = delete;
  LengthPrefix& operator=(const LengthPrefix&) = delete;

 private:
  Buffer& to_;
  const size_t start_;
};

void PutTexts(const McapWriter::Texts& texts, Buffer* to) {
  const LengthPrefix map(to);
  for (const auto& [key, value] : texts) {
    to->PutText(key);
    to->PutText(value);
  }
}

}  // namespace

McapWriter::McapWriter(const std::string& name, Compression compression, const std::string& profile,
                       const std::string& library)
    : writer_(name, compression), chunk_(writer_.GetEmptyChunk()) {
  Buffer head;
  head.PutBytes(kMagic.data(), kMagic.size());
  {
    const Record record(Op::kHeader, &head);
    head.PutText(profile);
    head.PutText(library);
  }
  writer_.Append(head.view());
}

void McapWriter::AddAttachment(const std::string& name, const std::string& media_type,
                               std::string_view content) {
  Buffer bytes;
  {
    const Record record(Op::kAttachment, &bytes);
    bytes.Put(uint64_t{0});  // log and creation time, constant: equal runs write equal logs
    bytes.Put(uint64_t{0});
    bytes.PutText(name);
    bytes.PutText(media_type);
    bytes.Put(uint64_t{content.size()});
    bytes.PutBytes(content.data(), content.size());
    bytes.Put(Crc(bytes.view().substr(kRecordHead)));
  }
  {
    const Record record(Op::kAttachmentIndex, &attachment_indexes_);
    Buffer& index = attachment_indexes_;
    for (const uint64_t number : {writer_.size(), uint64_t{bytes.size()}, uint64_t{0}, uint64_t{0}})
      index.Put(number);
    index.Put(uint64_t{content.size()});
    index.PutText(name);
    index.PutText(media_type);
  }
  writer_.Append(bytes.view());
  attachments_++;
}

void McapWriter::AddMetadata(const std::string& name, const Texts& texts) {
  Buffer bytes;
  {
    const Record record(Op::kMetadata, &bytes);
    bytes.PutText(name);
    PutTexts(texts, &bytes);
  }
  {
    const Record record(Op::kMetadataIndex, &metadata_indexes_);
    metadata_indexes_.Put(writer_.size());
    metadata_indexes_.Put(uint64_t{bytes.size()});
    metadata_indexes_.PutText(name);
  }
  writer_.Append(bytes.view());
  metadata_++;
}

uint16_t McapWriter::AddSchema(const std::string& name, const std::string& encoding,
                               const std::string& definition) {
  if (chunk_->records.size() >= kChunkSize) SubmitChunk();
  schemas_.push_back({name, encoding, definition});
  PutSchema(schemas_.size() - 1, &chunk_->records);
  return static_cast<uint16_t>(schemas_.size());  // 0 means no schema
}

uint16_t McapWriter::AddChannel(uint16_t schema, const std::string& topic,
                                const std::string& encoding, const Texts& metadata) {
  if (channels_.size() >= kMaxChannels)
    throw std::runtime_error("--log: found more than " + std::to_string(kMaxChannels) +
                             " topics, which an MCAP file can't hold; --log-models chooses robots");
  if (chunk_->records.size() >= kChunkSize) SubmitChunk();
  channels_.push_back({schema, topic, encoding, metadata});
  PutChannel(channels_.size() - 1, &chunk_->records);
  return static_cast<uint16_t>(channels_.size() - 1);
}

uint8_t* McapWriter::AddMessage(uint16_t channel, uint64_t time, size_t size) {
  if (size > kMaxMessageBytes)
    throw std::runtime_error("--log: found " + std::to_string(size) + " bytes for a message of " +
                             channels_[channel].topic + ", expected " +
                             std::to_string(kMaxMessageBytes) + " at most");
  if (chunk_->records.size() >= kChunkSize) SubmitChunk();
  Chunk& chunk = *chunk_;
  chunk.messages.push_back({time, chunk.records.size(), channel});
  chunk.start = std::min(chunk.start, time);
  chunk.end = std::max(chunk.end, time);
  const auto sequence = static_cast<uint32_t>(channels_[channel].messages++);
  uint8_t* head = chunk.records.Extend(kMessageHead + size);
  const uint64_t length = kMessageHead - kRecordHead + size;
  *head = static_cast<uint8_t>(Op::kMessage);
  std::memcpy(head + 1, &length, 8);
  std::memcpy(head + 9, &channel, 2);
  std::memcpy(head + 11, &sequence, 4);
  std::memcpy(head + 15, &time, 8);
  std::memcpy(head + 23, &time, 8);
  return head + kMessageHead;
}

void McapWriter::EndStep() {
  if (!chunk_->messages.empty() && chunk_->end - chunk_->start >= kMaxChunkAge) SubmitChunk();
}

void McapWriter::SubmitChunk() {
  if (chunk_->messages.empty()) chunk_->start = 0;
  writer_.Submit(std::move(chunk_));
  chunk_ = writer_.GetEmptyChunk();
}

void McapWriter::Finish() {
  if (chunk_->records.size() > 0) SubmitChunk();
  writer_.Finish();
  Buffer end;
  {
    const Record record(Op::kDataEnd, &end);
    end.Put(uint32_t{0});  // no checksum of the data section: chunks and the summary have their own
  }
  writer_.Append(end.view());
  WriteSummary();
  writer_.Append(kMagic);
  writer_.Close();
}

uint64_t McapWriter::message_count() const {
  uint64_t count = 0;
  for (const Channel& channel : channels_) count += channel.messages;
  return count;
}

// ---- summary ------------------------------------------------------------------------------------

void McapWriter::PutSchema(size_t index, Buffer* to) const {
  const Record record(Op::kSchema, to);
  to->Put(static_cast<uint16_t>(index + 1));
  to->PutText(schemas_[index].name);
  to->PutText(schemas_[index].encoding);
  to->PutText(schemas_[index].definition);
}

void McapWriter::PutChannel(size_t index, Buffer* to) const {
  const Channel& channel = channels_[index];
  const Record record(Op::kChannel, to);
  to->Put(static_cast<uint16_t>(index));
  to->Put(channel.schema);
  to->PutText(channel.topic);
  to->PutText(channel.encoding);
  PutTexts(channel.metadata, to);
}

void McapWriter::PutStatistics(Buffer* to) const {
  const ChunkTotals& chunks = writer_.totals();
  const Record record(Op::kStatistics, to);
  to->Put(message_count());
  to->Put(static_cast<uint16_t>(schemas_.size()));
  to->Put(static_cast<uint32_t>(channels_.size()));
  to->Put(attachments_);
  to->Put(metadata_);
  to->Put(chunks.count);
  to->Put(chunks.count == 0 ? 0 : chunks.start);
  to->Put(chunks.end);
  const LengthPrefix counts(to);
  for (size_t i = 0; i < channels_.size(); i++) {
    to->Put(static_cast<uint16_t>(i));
    to->Put(channels_[i].messages);
  }
}

/// Writes the summary: groups of records of one kind, then the offset of each group.
class McapWriter::Summary {
 public:
  explicit Summary(ChunkWriter* to) : to_(*to), start_(to->size()) {}

  void Add(std::string_view part) {
    crc_ = Crc(part, crc_);
    to_.Append(part);
  }
  void AddGroup(Op op, const std::function<void(Buffer*)>& put) {
    Buffer group;
    put(&group);
    const uint64_t begin = to_.size();
    Add(group.view());
    RecordGroup(op, begin);
  }
  void AddChunkIndexes() {
    const uint64_t begin = to_.size();
    to_.ReadChunkIndexes([this](std::string_view part) { Add(part); });
    RecordGroup(Op::kChunkIndex, begin);
  }
  /// Writes the offsets and the footer, which holds the summary's checksum.
  void End() {
    const uint64_t offsets = to_.size();
    Add(group_offsets_.view());
    constexpr uint64_t kFooterLength = 8 + 8 + 4;
    Buffer footer;
    footer.Put(static_cast<uint8_t>(Op::kFooter));
    footer.Put(kFooterLength);
    footer.Put(start_);
    footer.Put(offsets);
    Add(footer.view());
    footer.Clear();
    footer.Put(crc_);
    to_.Append(footer.view());
  }

 private:
  void RecordGroup(Op op, uint64_t begin) {
    if (to_.size() == begin) return;
    const Record record(Op::kSummaryOffset, &group_offsets_);
    group_offsets_.Put(static_cast<uint8_t>(op));
    group_offsets_.Put(begin);
    group_offsets_.Put(to_.size() - begin);
  }

  ChunkWriter& to_;
  const uint64_t start_;
  uint32_t crc_ = 0;
  Buffer group_offsets_;
};

void McapWriter::WriteSummary() {
  Summary summary(&writer_);
  summary.AddGroup(Op::kSchema, [this](Buffer* to) {
    for (size_t i = 0; i < schemas_.size(); i++) PutSchema(i, to);
  });
  summary.AddGroup(Op::kChannel, [this](Buffer* to) {
    for (size_t i = 0; i < channels_.size(); i++) PutChannel(i, to);
  });
  summary.AddGroup(Op::kStatistics, [this](Buffer* to) { PutStatistics(to); });
  summary.AddChunkIndexes();
  summary.AddGroup(Op::kAttachmentIndex, [this](Buffer* to) {
    to->PutBytes(attachment_indexes_.data(), attachment_indexes_.size());
  });
  summary.AddGroup(Op::kMetadataIndex, [this](Buffer* to) {
    to->PutBytes(metadata_indexes_.data(), metadata_indexes_.size());
  });
  summary.End();
}

}  // namespace Stg::recording
