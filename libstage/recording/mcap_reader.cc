// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/mcap_reader.hh"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "messages/report.hh"
#include "recording/compression.hh"

namespace Stg::recording {

namespace {

constexpr uint64_t kWindow = 1 << 16;  // bytes

}  // namespace

Message MessageOf(std::string_view fields) {
  FieldReader from(fields);
  Message message = {};
  message.channel = from.Get<uint16_t>();
  from.Get<uint32_t>();
  message.time = from.Get<uint64_t>();
  from.Get<uint64_t>();
  if (from.is_good()) message.data = from.left();
  return message;
}

McapReader::McapReader(const std::string& file) : name_(file) {
  file_ = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat about = {};
  if (file_ < 0 || fstat(file_, &about) != 0) Fail(std::strerror(errno));
  try {
    if (!S_ISREG(about.st_mode)) Fail("found a special file, expected an MCAP file");
    size_ = static_cast<uint64_t>(about.st_size);
    Scan();
  } catch (...) {
    close(file_);
    throw;
  }
}

McapReader::~McapReader() { close(file_); }

void McapReader::Fail(const std::string& what) const {
  throw std::runtime_error(messages::Shortened(name_, messages::kMaxDetailBytes) + ": " + what);
}

void McapReader::FailAt(uint64_t offset, const std::string& problem) const {
  Fail("the chunk at byte " + std::to_string(offset) + " is damaged: " + problem);
}

const std::map<std::string, std::string>& McapReader::metadata(const std::string& name) const {
  static const std::map<std::string, std::string> none;
  const auto found = metadata_.find(name);
  return found == metadata_.end() ? none : found->second;
}

void McapReader::ReadBytes(uint64_t offset, uint64_t size, Buffer* to) const {
  to->Clear();
  to->Reserve(static_cast<size_t>(size));
  uint8_t* space = to->Extend(static_cast<size_t>(size));
  while (size > 0) {
    const ssize_t count =
        pread(file_, space, static_cast<size_t>(size), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) Fail(std::strerror(errno));
    if (count == 0) Fail("the file has become shorter while it was read");
    space += count;
    offset += static_cast<uint64_t>(count);
    size -= static_cast<uint64_t>(count);
  }
}

/// Returns up to `size` bytes, valid until the next call. Reads ahead, as many records are short.
std::string_view McapReader::ReadAhead(uint64_t offset, uint64_t size) {
  size = std::min(size, size_ - offset);
  const uint64_t behind = window_offset_ + window_.size();
  if (offset < window_offset_ || offset + size > behind) {
    ReadBytes(offset, std::min(size_ - offset, kWindow), &window_);
    window_offset_ = offset;
  }
  return window_.view().substr(static_cast<size_t>(offset - window_offset_),
                               static_cast<size_t>(size));
}

void McapReader::Scan() {
  if (ReadAhead(0, kMagic.size()) != kMagic) Fail("found no MCAP signature, expected an MCAP file");
  for (uint64_t at = kMagic.size(); size_ - at >= kRecordHead;) {
    FieldReader fields(ReadAhead(at, kRecordHead));
    const auto op = static_cast<Op>(fields.Get<uint8_t>());
    const auto length = fields.Get<uint64_t>();
    at += kRecordHead;
    if (op == Op::kFooter || length > size_ - at) break;
    Take(op, at, length);
    at += length;
  }
  // The summary at the end of a file repeats the names, unless the writer omitted it.
  if (ends_early_ || channels_.empty()) ReadNamesFromChunks();
}

void McapReader::Take(Op op, uint64_t offset, uint64_t length) {
  if (op == Op::kDataEnd) ends_early_ = false;
  if (op == Op::kChunk && ends_early_) return ReadChunkRecord(offset, length);
  const bool is_attachment = op == Op::kAttachment,
             is_name = op == Op::kMetadata || op == Op::kSchema || op == Op::kChannel;
  if (!is_attachment && !is_name) return;
  uint64_t& total = is_attachment ? attachment_bytes_ : name_bytes_;
  total += length;
  if (total > (is_attachment ? kMaxAttachmentBytes : kMaxNameBytes))
    Fail(std::string("found more than ") +
         std::to_string((is_attachment ? kMaxAttachmentBytes : kMaxNameBytes) >> 20) + " MB of " +
         (is_attachment ? "attachments" : "metadata, schemas and channels"));
  Buffer fields;
  ReadBytes(offset, length, &fields);
  if (is_attachment)
    ReadAttachment(fields.view());
  else if (op == Op::kMetadata)
    ReadMetadata(fields.view());
  else
    ReadNames(op, fields.view());
}

void McapReader::ReadAttachment(std::string_view fields) {
  FieldReader from(fields);
  from.Get<uint64_t>();
  from.Get<uint64_t>();
  const std::string name(from.GetText());
  from.GetText();
  const std::string content(from.GetLongText());
  const size_t checked = fields.size() - from.left().size();
  const auto crc = from.Get<uint32_t>();
  if (!from.is_good() || (crc != 0 && crc != Crc(fields.substr(0, checked))))
    Fail("the attachment " + messages::Quoted(name) + " is damaged");
  attachments_.emplace_back(name, content);
}

void McapReader::ReadMetadata(std::string_view fields) {
  FieldReader from(fields);
  std::map<std::string, std::string>& texts = metadata_[std::string(from.GetText())];
  FieldReader map(from.GetText());
  while (map.is_good() && !map.left().empty()) {
    const std::string key(map.GetText());
    texts[key] = std::string(map.GetText());
  }
  if (!from.is_good() || !map.is_good()) Fail("a record of metadata is damaged");
}

void McapReader::ReadNames(Op op, std::string_view fields) {
  FieldReader from(fields);
  const auto id = from.Get<uint16_t>();
  if (op == Op::kSchema) {
    types_[id] = std::string(from.GetText());
  } else {
    const auto schema = from.Get<uint16_t>();
    channels_[id] = {std::string(from.GetText()), types_[schema]};
  }
  if (!from.is_good()) Fail("a schema or a channel is damaged");
}

void McapReader::ReadChunkRecord(uint64_t offset, uint64_t length) {
  FieldReader from(ReadAhead(offset, std::min<uint64_t>(length, 16)));
  const auto start = from.Get<uint64_t>(), end = from.Get<uint64_t>();
  if (!from.is_good()) FailAt(offset, "its header is incomplete");
  chunks_.push_back({start, end, offset, length});
}

void McapReader::ReadNamesFromChunks() {
  Buffer records;
  for (const Chunk& chunk : chunks_) {
    Read(chunk, &records);
    ForEachRecord(records.view(), [&](Op op, std::string_view record) {
      if (op == Op::kSchema || op == Op::kChannel) ReadNames(op, record);
    });
  }
}

void McapReader::Decompress(std::string_view fields, uint64_t offset, Buffer* records) const {
  FieldReader from(fields);
  from.Get<uint64_t>();
  from.Get<uint64_t>();
  const auto size = from.Get<uint64_t>();
  const auto crc = from.Get<uint32_t>();
  const std::string_view compression = from.GetText();
  const std::string_view packed = from.GetLongText();
  std::string problem;
  if (!from.is_good())
    problem = "its header is incomplete";
  else if (size > kMaxChunkBytes)
    problem = "found " + std::to_string(size) + " bytes in it, expected " +
              std::to_string(kMaxChunkBytes >> 20) + " MB at most";
  else
    problem = recording::Decompress(packed, compression, static_cast<size_t>(size), records);
  if (problem.empty() && crc != 0 && crc != Crc(records->view())) problem = "its checksum is wrong";
  if (!problem.empty()) FailAt(offset, problem);
}

void McapReader::Read(const Chunk& chunk, Buffer* records) const {
  // A compressed chunk exceeds its uncompressed size by little more than its header.
  if (chunk.length > kMaxChunkBytes + kMaxChunkBytes / 8)
    FailAt(chunk.offset, "found " + std::to_string(chunk.length) + " bytes, expected " +
                             std::to_string(kMaxChunkBytes >> 20) + " MB at most");
  Buffer fields;
  ReadBytes(chunk.offset, chunk.length, &fields);
  records->Clear();
  Decompress(fields.view(), chunk.offset, records);
  bool good = true;
  const bool whole = ForEachRecord(records->view(), [&](Op op, std::string_view record) {
    if (op == Op::kMessage) good = good && MessageOf(record).data.data() != nullptr;
  });
  if (!whole || !good) FailAt(chunk.offset, "its records are not whole");
}

}  // namespace Stg::recording
