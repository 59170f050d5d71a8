// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/chunk_writer.hh"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "messages/report.hh"

namespace Stg::recording {

namespace {

bool IsLog(std::string_view beginning) { return beginning.starts_with(kMagic); }

std::string WhyNotWritten(const std::string& name, int error) {
  return "--log: " + messages::Quoted(name) + " can't be written: " +
         (error == EEXIST ? "it exists and is not an MCAP file" : std::strerror(error));
}

}  // namespace

uint32_t Crc(std::string_view bytes, uint32_t before) {
  return static_cast<uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void Chunk::Clear() {
  records.Clear();
  messages.clear();
  start = ~uint64_t{0};
  end = 0;
}

ChunkWriter::ChunkWriter(const std::string& name, Compression compression)
    : name_(name),
      compression_(compression),
      compressor_(compression),
      chunk_indexes_(std::filesystem::path(files::AbsolutePath(name)).parent_path().string()) {
  if (const int error = file_.Open(name, IsLog); error != 0)
    throw std::runtime_error(WhyNotWritten(name, error));
  try {
    thread_ = std::thread(&ChunkWriter::Work, this);
  } catch (const std::system_error&) {
    // Without a thread, Submit() does the work itself.
  }
}

ChunkWriter::~ChunkWriter() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  work_.notify_one();
  thread_.join();
}

std::unique_ptr<Chunk> ChunkWriter::GetEmptyChunk() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (free_chunks_.empty()) return std::make_unique<Chunk>();
  std::unique_ptr<Chunk> chunk = std::move(free_chunks_.back());
  free_chunks_.pop_back();
  chunk->Clear();
  return chunk;
}

void ChunkWriter::Submit(std::unique_ptr<Chunk> chunk) {
  if (!thread_.joinable()) {
    Write(*chunk);
    free_chunks_.push_back(std::move(chunk));
    return;
  }
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return queue_.size() < kMaxQueued; });
  queue_.push_back(std::move(chunk));
  work_.notify_one();
}

void ChunkWriter::Finish() {
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return queue_.empty() && !busy_; });
}

std::string ChunkWriter::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void ChunkWriter::Fail(const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (problem_.empty()) problem_ = what;
}

void ChunkWriter::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    work_.wait(lock, [this] { return stop_ || !queue_.empty(); });
    if (queue_.empty()) return;
    std::unique_ptr<Chunk> chunk = std::move(queue_.front());
    queue_.pop_front();
    busy_ = true;
    const bool good = problem_.empty();
    lock.unlock();
    done_.notify_one();
    try {
      if (good) Write(*chunk);
    } catch (const std::exception& error) {  // out of memory
      Fail("--log: " + messages::Quoted(name_) + ": " + error.what());
    }
    lock.lock();
    free_chunks_.push_back(std::move(chunk));
    busy_ = false;
    done_.notify_one();
  }
}

void ChunkWriter::Append(std::string_view part) {
  if (!problem().empty()) return;
  if (const int error = file_.Append(part); error != 0) Fail(WhyNotWritten(name_, error));
}

void ChunkWriter::Close() {
  if (const int error = file_.Close(); error != 0) Fail(WhyNotWritten(name_, error));
}

/// Writes a chunk together with its indexes, so that a file on a full disk ends with complete ones.
void ChunkWriter::Write(const Chunk& chunk) {
  const std::string_view plain = chunk.records.view();
  const std::string_view name = NameOf(compression_);
  buffer_.Clear();
  buffer_.Put(static_cast<uint8_t>(Op::kChunk));
  buffer_.Put(uint64_t{0});
  buffer_.Put(chunk.start);
  buffer_.Put(chunk.end);
  buffer_.Put(uint64_t{plain.size()});
  buffer_.Put(Crc(plain));
  buffer_.PutText(name);
  const size_t length_place = buffer_.size();
  buffer_.Put(uint64_t{0});
  const size_t packed_start = buffer_.size();
  compressor_.Compress(plain, &buffer_);
  const uint64_t packed_size = buffer_.size() - packed_start;
  buffer_.Set(length_place, packed_size);
  buffer_.Set(1, uint64_t{buffer_.size() - kRecordHead});

  const uint64_t length = buffer_.size();
  PutMessageIndexes(chunk);
  StoreChunkIndex(chunk, length, packed_size);
  Append(buffer_.view());
  totals_.count++;
  totals_.start = std::min(totals_.start, chunk.start);
  totals_.end = std::max(totals_.end, chunk.end);
}

/// Appends one index per channel with messages in the chunk, using a counting sort.
void ChunkWriter::PutMessageIndexes(const Chunk& chunk) {
  index_offsets_.clear();
  channel_ranges_.assign(kMaxChannels + 1, 0);
  for (const Chunk::Entry& entry : chunk.messages) channel_ranges_[entry.channel]++;
  uint32_t begin = 0;
  std::vector<uint32_t>& ends = channel_ranges_;
  for (uint32_t& count : ends) begin += std::exchange(count, begin);
  sorted_.resize(chunk.messages.size());
  for (const Chunk::Entry& entry : chunk.messages) sorted_[ends[entry.channel]++] = entry;

  constexpr uint32_t kEntrySize = 16;
  for (size_t i = 0; i < sorted_.size();) {
    const uint16_t channel = sorted_[i].channel;
    const uint32_t count = ends[channel] - static_cast<uint32_t>(i);
    index_offsets_.emplace_back(channel, file_.size() + buffer_.size());
    buffer_.Put(static_cast<uint8_t>(Op::kMessageIndex));
    buffer_.Put(uint64_t{2 + 4 + kEntrySize * count});
    buffer_.Put(channel);
    buffer_.Put(kEntrySize * count);
    for (; i < ends[channel]; i++) {
      buffer_.Put(sorted_[i].time);
      buffer_.Put(sorted_[i].offset);
    }
  }
}

/// Stores the chunk's index record for the summary. Call before the chunk and its message indexes
/// are written.
void ChunkWriter::StoreChunkIndex(const Chunk& chunk, uint64_t length, uint64_t packed_size) {
  constexpr uint32_t kPlaceSize = 10;
  Buffer& to = chunk_index_;
  to.Clear();
  to.Put(static_cast<uint8_t>(Op::kChunkIndex));
  to.Put(uint64_t{0});
  for (const uint64_t number : {chunk.start, chunk.end, file_.size(), length}) to.Put(number);
  to.Put(kPlaceSize * static_cast<uint32_t>(index_offsets_.size()));
  for (const auto& [channel, offset] : index_offsets_) {
    to.Put(channel);
    to.Put(offset);
  }
  to.Put(uint64_t{buffer_.size() - length});
  to.PutText(NameOf(compression_));
  to.Put(packed_size);
  to.Put(uint64_t{chunk.records.size()});
  to.Set(1, uint64_t{to.size() - kRecordHead});
  chunk_indexes_.Add(to.view());
}

void ChunkWriter::ReadChunkIndexes(const std::function<void(std::string_view)>& take) {
  if (const int error = chunk_indexes_.ReadBack(take); error != 0)
    Fail(WhyNotWritten(name_, error));
}

}  // namespace Stg::recording
