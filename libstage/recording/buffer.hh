// SPDX-License-Identifier: GPL-2.0-or-later
//
// A byte buffer for serialization. Numbers are little endian, as in MCAP and CDR.

#ifndef STAGE_RECORDING_BUFFER_HH
#define STAGE_RECORDING_BUFFER_HH

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string_view>
#include <type_traits>

namespace Stg::recording {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

/// A byte vector that leaves new bytes uninitialized, because a log grows by megabytes per step.
class Buffer {
 public:
  size_t size() const { return size_; }
  uint8_t* data() { return bytes_.get(); }
  const uint8_t* data() const { return bytes_.get(); }
  std::string_view view() const { return {reinterpret_cast<const char*>(bytes_.get()), size_}; }
  void Clear() { size_ = 0; }
  /// Truncates the buffer.
  void Shrink(size_t size) { size_ = size; }

  /// Reserves capacity for exactly this many more bytes.
  void Reserve(size_t count) {
    if (size_ + count > capacity_) SetCapacity(size_ + count);
  }
  /// Appends uninitialized bytes and returns their address. Valid until the buffer next grows.
  uint8_t* Extend(size_t count) {
    if (size_ + count > capacity_) Grow(size_ + count);
    uint8_t* space = bytes_.get() + size_;
    size_ += count;
    return space;
  }
  template <typename T>
  void Put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    std::memcpy(Extend(sizeof value), &value, sizeof value);
  }
  void PutBytes(const void* from, size_t count) {
    if (count > 0) std::memcpy(Extend(count), from, count);
  }
  /// Appends text in MCAP's format: its length, then its bytes.
  void PutText(std::string_view text) {
    Put(static_cast<uint32_t>(text.size()));
    PutBytes(text.data(), text.size());
  }
  /// Overwrites bytes at an offset.
  template <typename T>
  void Set(size_t place, T value) {
    std::memcpy(bytes_.get() + place, &value, sizeof value);
  }

 private:
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  void Grow(size_t min_size) { SetCapacity(min_size + min_size / 2); }
  void SetCapacity(size_t capacity) {
    auto* grown = static_cast<uint8_t*>(std::realloc(bytes_.get(), capacity));
    if (!grown) throw std::bad_alloc();
    [[maybe_unused]] uint8_t* const moved = bytes_.release();
    bytes_.reset(grown);
    capacity_ = capacity;
  }

  std::unique_ptr<uint8_t, Free> bytes_;
  size_t size_ = 0, capacity_ = 0;
};

}  // namespace Stg::recording

#endif
