// SPDX-License-Identifier: GPL-2.0-or-later
//
// Bytes in the making: numbers little endian, as MCAP and CDR want them.

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

/// A vector of bytes that doesn't clear what it makes room for: a log fills megabytes a step.
class Buffer {
 public:
  size_t size() const { return size_; }
  uint8_t* data() { return bytes_.get(); }
  const uint8_t* data() const { return bytes_.get(); }
  std::string_view view() const { return {reinterpret_cast<const char*>(bytes_.get()), size_}; }
  void Clear() { size_ = 0; }
  /// Cuts off what is behind.
  void Shrink(size_t size) { size_ = size; }

  /// Makes room for so many bytes behind what is there, and for no more.
  void Reserve(size_t count) {
    if (size_ + count > capacity_) SetCapacity(size_ + count);
  }
  /// Room for so many bytes at the end, to be filled. Valid until the next one is asked for.
  uint8_t* Extend(size_t count) {
    if (size_ + count > capacity_) Grow(size_ + count);
    uint8_t* room = bytes_.get() + size_;
    size_ += count;
    return room;
  }
  template <typename T>
  void Put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    std::memcpy(Extend(sizeof value), &value, sizeof value);
  }
  void PutBytes(const void* from, size_t count) {
    if (count > 0) std::memcpy(Extend(count), from, count);
  }
  /// As MCAP has texts: their length first.
  void PutText(std::string_view text) {
    Put(static_cast<uint32_t>(text.size()));
    PutBytes(text.data(), text.size());
  }
  /// Over what is there.
  template <typename T>
  void Set(size_t place, T value) {
    std::memcpy(bytes_.get() + place, &value, sizeof value);
  }

 private:
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  void Grow(size_t least) { SetCapacity(least + least / 2); }
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
