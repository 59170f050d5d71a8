// SPDX-License-Identifier: GPL-2.0-or-later
//
// A pool of objects that are allocated and freed by index.

#ifndef STAGE_GRID_POOL_HH
#define STAGE_GRID_POOL_HH

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#include "grid/paged_array.hh"
#include "messages/assert.hh"

namespace Stg::internal::grid {

/// Cache of free indices for one of several threads that use a pool concurrently.
class PoolShare {
  template <typename T>
  friend class Pool;
  std::vector<uint32_t> free_;

 public:
  /// Reserves memory, so that a later refill does not allocate.
  void Prepare() { free_.reserve(kAtOnce); }
  static constexpr std::size_t kAtOnce = 64;  // indices per refill
};

/// Trivially copyable objects in one array. A single thread may call Take() and Give() at any time;
/// between BeginSharing() and EndSharing() several threads may, each with its own PoolShare.
/// Reserved memory is not touched before its first use.
template <typename T>
class Pool {
 public:
  Pool() = default;
  /// Must not run concurrently with Take() or Give().
  Pool(const Pool& from) : made_(from.made_), free_(from.free_) {
    things_.CopyFrom(from.things_, made_);
  }
  Pool& operator=(Pool&& from) noexcept {
    things_ = std::move(from.things_);
    made_ = from.made_;
    free_ = std::move(from.free_);
    return *this;
  }

  T& operator[](uint32_t number) {
    STAGE_ASSERT(number < End());
    return things_[number];
  }
  const T& operator[](uint32_t number) const {
    STAGE_ASSERT(number < End());
    return things_[number];
  }
  const T* data() const { return things_.data(); }

  /// Index of a free object with unspecified content. `share` is the calling thread's own while
  /// several threads use the pool, otherwise null.
  uint32_t Take(PoolShare* share = nullptr) {
    std::vector<uint32_t>& free = share ? share->free_ : free_;
    if (free.empty()) {
      if (share)
        Refill(share);
      else
        MakeOne();
    }
    const uint32_t number = free.back();
    STAGE_ASSERT(number < End() && number < things_.capacity());
    free.pop_back();
    return number;
  }
  void Give(uint32_t number, PoolShare* share = nullptr) noexcept {
    STAGE_ASSERT(number < End());
    try {
      (share ? share->free_ : free_).push_back(number);
    } catch (const std::bad_alloc&) {
      // Leaks the index: the caller is in the middle of a change and cannot handle an error.
    }
  }
  /// Reserves memory, so that one thread can take `count` objects without allocation.
  void PrepareToTake(std::size_t count) {
    if (count == 0) return;
    free_.reserve(1);
    if (free_.size() + things_.capacity() - made_ < count) Reserve(made_ + count);
  }

  /// Prepares for `shares` threads that take at most `most` objects in all, not counting those that
  /// a thread gives back and takes again.
  void BeginSharing(std::size_t most, std::size_t shares) {
    Reserve(made_ + most + shares * kAtOnce);
    left_ = free_.size();
    next_ = made_;
  }
  void EndSharing() {
    STAGE_ASSERT(next_ >= made_ && next_ <= things_.capacity());
    STAGE_ASSERT(left_ <= free_.size());
    free_.resize(left_);
    made_ = next_;
  }
  /// Call after EndSharing(): returns the free indices of a share to the pool.
  void TakeBack(PoolShare* share) noexcept {
    try {
      free_.insert(free_.end(), share->free_.begin(), share->free_.end());
    } catch (const std::bad_alloc&) {  // as in Give()
    }
    share->free_.clear();
  }

  /// Freezes the pool. Later copies share its memory pages until they write to them.
  void MakeShareable() { things_.MakeShareable(made_); }

  /// Number of objects that exist, free ones included, and the indices of the free ones. Not while
  /// the pool is shared.
  std::size_t made() const { return made_; }
  const std::vector<uint32_t>& free() const { return free_; }

  /// Memory in use, in bytes.
  std::size_t bytes() const { return made_ * sizeof(T) + free_.capacity() * sizeof(uint32_t); }

 private:
  static constexpr std::size_t kAtOnce = PoolShare::kAtOnce;

  /// Upper bound of the indices in use. While the pool is shared, next_ is above made_.
  std::size_t End() const { return std::max(made_, next_.load(std::memory_order_relaxed)); }
  void Reserve(std::size_t capacity) {
    const std::size_t now = things_.capacity();
    if (capacity > now) things_.Reserve(std::max(capacity, now + now / 2), made_);
  }
  void MakeOne() {
    Reserve(made_ + 1);
    free_.push_back(static_cast<uint32_t>(made_++));
  }
  /// Refills from the free list while it can fill a whole share; otherwise creates new objects.
  void Refill(PoolShare* share) {
    STAGE_ASSERT(share->free_.empty());
    std::size_t end = left_.load(std::memory_order_relaxed);
    while (end >= kAtOnce)
      if (left_.compare_exchange_weak(end, end - kAtOnce, std::memory_order_relaxed)) {
        const auto last = free_.begin() + static_cast<std::ptrdiff_t>(end);
        share->free_.assign(last - kAtOnce, last);
        return;
      }
    std::size_t number = next_.fetch_add(kAtOnce, std::memory_order_relaxed);
    for (std::size_t i = 0; i < kAtOnce; i++)
      share->free_.push_back(static_cast<uint32_t>(number++));
  }

  PagedArray<T> things_;
  std::size_t made_ = 0;
  std::vector<uint32_t> free_;
  // Between BeginSharing() and EndSharing(): number of free indices that no share has taken yet,
  // and the next index to create.
  std::atomic<std::size_t> left_{0}, next_{0};
};

}  // namespace Stg::internal::grid

#endif
