// SPDX-License-Identifier: GPL-2.0-or-later
//
// Reads and writes little-endian CDR, the serialization of ROS 2 messages. Numbers are aligned to
// multiples of their size, counted from the end of the four-byte encapsulation header.

#ifndef STAGE_RECORDING_CDR_HH
#define STAGE_RECORDING_CDR_HH

#include <cstdint>
#include <cstring>
#include <string_view>

#include "recording/buffer.hh"

namespace Stg::recording {

inline constexpr size_t kCdrHeaderBytes = 4;

class CdrWriter {
 public:
  /// Starts a message at the end of the buffer.
  explicit CdrWriter(Buffer* to) : to_(*to), start_(to->size() + kCdrHeaderBytes) {
    to_.Put(uint32_t{0x100});  // 00 01 00 00
  }

  template <typename T>
  void Put(T value) {
    Align(sizeof value);
    to_.Put(value);
  }
  void PutText(std::string_view text) {
    Put(static_cast<uint32_t>(text.size() + 1));
    to_.PutBytes(text.data(), text.size());
    to_.Put(uint8_t{0});
  }
  void PutDoubles(size_t count, double value) {
    for (size_t i = 0; i < count; i++) Put(value);
  }
  /// Adds a sequence of `count` elements, and returns the space for them.
  uint8_t* PutSequence(size_t count, size_t element_size) {
    Put(static_cast<uint32_t>(count));
    return count > 0 ? PutSpace(element_size, count) : to_.Extend(0);
  }
  /// Adds aligned elements without their number, and returns the space for them.
  uint8_t* PutSpace(size_t element_size, size_t count = 1) {
    Align(element_size);
    return to_.Extend(count * element_size);
  }
  void Align(size_t size) {
    while ((to_.size() - start_) % size != 0) to_.Put(uint8_t{0});
  }
  size_t size() const { return to_.size(); }

 private:
  Buffer& to_;
  const size_t start_;
};

/// Reads a message. Reading past its end returns 0 and makes is_good() false.
class CdrReader {
 public:
  explicit CdrReader(std::string_view message)
      : message_(message),
        at_(kCdrHeaderBytes),
        good_(message.size() >= kCdrHeaderBytes && message[1] == 1) {}

  template <typename T>
  T Get() {
    T value = 0;
    const std::string_view bytes = Take(sizeof value, sizeof value);
    if (good_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view GetText() {
    const auto size = Get<uint32_t>();
    const std::string_view text = Take(1, size);
    return text.substr(0, text.empty() ? 0 : text.size() - 1);
  }
  /// Returns a sequence's elements as bytes, which may be unaligned in memory.
  template <typename T>
  std::string_view GetSequence() {
    const auto count = Get<uint32_t>();
    return count == 0 ? std::string_view() : Take(sizeof(T), sizeof(T) * size_t{count});
  }
  bool is_good() const { return good_; }

 private:
  std::string_view Take(size_t alignment, size_t size) {
    const size_t over = (at_ - kCdrHeaderBytes) % alignment;
    const size_t from = at_ + (over == 0 ? 0 : alignment - over);
    good_ = good_ && from <= message_.size() && size <= message_.size() - from;
    if (!good_) return {};
    at_ = from + size;
    return message_.substr(from, size);
  }

  std::string_view message_;
  size_t at_;
  bool good_;
};

}  // namespace Stg::recording

#endif
