// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arrays that many copies of a grid share page by page. A copy uses memory only for pages that it
// or the original changes.

#ifndef STAGE_GRID_PAGED_ARRAY_HH
#define STAGE_GRID_PAGED_ARRAY_HH

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "messages/assert.hh"

namespace Stg::internal::grid {

/// Copy-on-write memory: several mappings start with the same content. Where the system does not
/// support that, the bytes are copied.
class SharedPages {
 public:
  /// Copies `size` bytes into new shared pages. Returns null if they are few, or cannot be had.
  static std::shared_ptr<const SharedPages> Make(const void* bytes, std::size_t size);
  ~SharedPages();
  SharedPages(const SharedPages&) = delete;
  SharedPages& operator=(const SharedPages&) = delete;

  /// A writable mapping of *size bytes that begins with the content and has spare capacity behind
  /// it. The caller owns it until Unmap(). Returns null if the system cannot provide it.
  void* Map(std::size_t* size) const;
  static void Unmap(void* memory, std::size_t size);

 private:
  SharedPages(int file, std::size_t size) : file_(file), size_(size) {}

  [[maybe_unused]] const int file_;  // only Linux uses these
  [[maybe_unused]] const std::size_t size_;
};

/// A vector of trivially copyable elements. After Freeze() it may only be copied.
template <typename T>
class PagedArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  PagedArray() = default;
  explicit PagedArray(std::size_t size) { resize(size); }
  PagedArray(const PagedArray& from) { CopyFrom(from, from.size_); }
  PagedArray(PagedArray&& from) noexcept { Swap(from); }
  ~PagedArray() { Free(); }
  PagedArray& operator=(PagedArray from) noexcept {
    Swap(from);
    return *this;
  }

  T& operator[](std::size_t i) {
    STAGE_ASSERT(i < capacity_);
    return data_[i];
  }
  const T& operator[](std::size_t i) const {
    STAGE_ASSERT(i < capacity_);
    return data_[i];
  }
  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t capacity() const { return capacity_; }

  /// New elements are zero.
  void resize(std::size_t size) {
    STAGE_ASSERT(!shared_);
    if (size > capacity_) Reserve(std::max(size, 2 * capacity_), size_);
    if (size > size_) std::memset(static_cast<void*>(data_ + size_), 0, (size - size_) * sizeof(T));
    size_ = size;
  }
  /// Reallocates and keeps the first `kept` elements, whatever size() is. Reserved memory is not
  /// touched before its first use.
  void Reserve(std::size_t capacity, std::size_t kept) {
    STAGE_ASSERT(!shared_ && kept <= capacity_);
    if (capacity <= capacity_) return;
    T* const larger = static_cast<T*>(::operator new(capacity * sizeof(T)));
    if (kept > 0) std::memcpy(static_cast<void*>(larger), data_, kept * sizeof(T));
    Own(larger, capacity, 0);
  }

  /// Copies the size and the first `kept` elements of `from`. This array must be empty.
  void CopyFrom(const PagedArray& from, std::size_t kept) {
    STAGE_ASSERT(data_ == nullptr && kept <= from.capacity_);
    std::size_t bytes = 0;
    if (void* const memory = from.shared_ ? from.shared_->Map(&bytes) : nullptr) {
      Own(static_cast<T*>(memory), bytes / sizeof(T), bytes);
      STAGE_ASSERT(kept <= capacity_);
    } else if (kept > 0) {
      Reserve(kept, 0);
      std::memcpy(static_cast<void*>(data_), from.data_, kept * sizeof(T));
    }
    size_ = from.size_;
  }
  /// Freezes the array. Later copies share the pages of its first `kept` elements.
  void Freeze(std::size_t kept) {
    STAGE_ASSERT(!shared_ && kept <= capacity_);
    if (kept > 0) shared_ = SharedPages::Make(data_, kept * sizeof(T));
  }

 private:
  void Own(T* data, std::size_t capacity, std::size_t mapped) {
    Free();
    data_ = data;
    capacity_ = capacity;
    mapped_ = mapped;
  }
  void Free() {
    if (mapped_ > 0)
      SharedPages::Unmap(data_, mapped_);
    else
      ::operator delete(data_);
  }
  void Swap(PagedArray& other) noexcept {
    std::swap(mapped_, other.mapped_);
    std::swap(shared_, other.shared_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  std::shared_ptr<const SharedPages> shared_;
  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
  std::size_t mapped_ = 0;  // size in bytes of the mapping of shared pages, or 0
};

}  // namespace Stg::internal::grid

#endif
