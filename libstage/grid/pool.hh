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
class PoolCache {
  template <typename T>
  friend class Pool;
  std::vector<uint32_t> free_;

 public:
  /// Reserves memory, so that a later refill does not allocate.
  void Prepare() { free_.reserve(kRefill); }
  static constexpr std::size_t kRefill = 64;  // indices per refill
};

/// Trivially copyable objects in one array. A single thread may call Take() and Give() at any time;
/// between BeginConcurrentUse() and EndConcurrentUse() several threads may, each with its own
/// PoolCache. Reserved memory is not touched before its first use.
template <typename T>
class Pool {
 public:
  Pool() = default;
  /// Must not run concurrently with Take() or Give().
  Pool(const Pool& from) : created_(from.created_), free_(from.free_) {
    objects_.CopyFrom(from.objects_, created_);
  }
  Pool& operator=(Pool&& from) noexcept {
    objects_ = std::move(from.objects_);
    created_ = from.created_;
    free_ = std::move(from.free_);
    return *this;
  }

  T& operator[](uint32_t number) {
    STAGE_ASSERT(number < End());
    return objects_[number];
  }
  const T& operator[](uint32_t number) const {
    STAGE_ASSERT(number < End());
    return objects_[number];
  }
  const T* data() const { return objects_.data(); }

  /// Index of a free object with unspecified content. `cache` is the calling thread's own while
  /// several threads use the pool, otherwise null.
  uint32_t Take(PoolCache* cache = nullptr) {
    std::vector<uint32_t>& free = cache ? cache->free_ : free_;
    if (free.empty()) {
      if (cache)
        Refill(cache);
      else
        MakeOne();
    }
    const uint32_t number = free.back();
    STAGE_ASSERT(number < End() && number < objects_.capacity());
    free.pop_back();
    return number;
  }
  void Give(uint32_t number, PoolCache* cache = nullptr) noexcept {
    STAGE_ASSERT(number < End());
    try {
      (cache ? cache->free_ : free_).push_back(number);
    } catch (const std::bad_alloc&) {
      // Leaks the index: the caller is in the middle of a change and cannot handle an error.
    }
  }
  /// Reserves memory, so that one thread can take `count` objects without allocation.
  void ReserveFree(std::size_t count) {
    if (count == 0) return;
    free_.reserve(1);
    if (free_.size() + objects_.capacity() - created_ < count) Reserve(created_ + count);
  }

  /// Prepares for `caches` threads that take at most `max_objects` objects in all, not counting
  /// those that a thread gives back and takes again.
  void BeginConcurrentUse(std::size_t max_objects, std::size_t caches) {
    Reserve(created_ + max_objects + caches * kRefill);
    left_ = free_.size();
    next_ = created_;
  }
  void EndConcurrentUse() {
    STAGE_ASSERT(next_ >= created_ && next_ <= objects_.capacity());
    STAGE_ASSERT(left_ <= free_.size());
    free_.resize(left_);
    created_ = next_;
  }
  /// Call after EndConcurrentUse(): returns the free indices of a cache to the pool.
  void ReturnCache(PoolCache* cache) noexcept {
    try {
      free_.insert(free_.end(), cache->free_.begin(), cache->free_.end());
    } catch (const std::bad_alloc&) {  // as in Give()
    }
    cache->free_.clear();
  }

  /// Freezes the pool. Later copies share its memory pages until they write to them.
  void Freeze() { objects_.Freeze(created_); }

  /// Number of objects that exist, free ones included, and the indices of the free ones. Not during
  /// concurrent use.
  std::size_t made() const { return created_; }
  const std::vector<uint32_t>& free() const { return free_; }

  /// Memory in use, in bytes.
  std::size_t bytes() const { return created_ * sizeof(T) + free_.capacity() * sizeof(uint32_t); }

 private:
  static constexpr std::size_t kRefill = PoolCache::kRefill;

  /// Upper bound of the indices in use. During concurrent use, next_ may exceed created_.
  std::size_t End() const { return std::max(created_, next_.load(std::memory_order_relaxed)); }
  void Reserve(std::size_t capacity) {
    const std::size_t now = objects_.capacity();
    if (capacity > now) objects_.Reserve(std::max(capacity, now + now / 2), created_);
  }
  void MakeOne() {
    Reserve(created_ + 1);
    free_.push_back(static_cast<uint32_t>(created_++));
  }
  /// Refills from the free list while it can fill a whole cache; otherwise creates new objects.
  void Refill(PoolCache* cache) {
    STAGE_ASSERT(cache->free_.empty());
    std::size_t end = left_.load(std::memory_order_relaxed);
    while (end >= kRefill)
      if (left_.compare_exchange_weak(end, end - kRefill, std::memory_order_relaxed)) {
        const auto last = free_.begin() + static_cast<std::ptrdiff_t>(end);
        cache->free_.assign(last - kRefill, last);
        return;
      }
    std::size_t number = next_.fetch_add(kRefill, std::memory_order_relaxed);
    for (std::size_t i = 0; i < kRefill; i++)
      cache->free_.push_back(static_cast<uint32_t>(number++));
  }

  PagedArray<T> objects_;
  std::size_t created_ = 0;
  std::vector<uint32_t> free_;
  // Between BeginConcurrentUse() and EndConcurrentUse(): number of free indices that no cache has
  // taken yet, and the next index to create.
  std::atomic<std::size_t> left_{0}, next_{0};
};

}  // namespace Stg::internal::grid

#endif
