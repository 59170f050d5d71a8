// SPDX-License-Identifier: GPL-2.0-or-later
//
// An array of objects that are taken and given back, and known by their numbers.

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

namespace Stg::internal::grid {

/// A stock of free numbers of a pool, for one of several threads that use it at once.
class PoolShare {
  template <typename T>
  friend class Pool;
  std::vector<uint32_t> free_;

 public:
  /// To be called before: the thread can then get its stock without asking for memory.
  void Prepare() { free_.reserve(kAtOnce); }
  static constexpr std::size_t kAtOnce = 64;  // numbers that a share gets
};

/// Plain objects in one array. One thread may take and give them back at any time; between
/// BeginSharing() and EndSharing() several may at once, each with a share of its own. Memory that
/// is reserved is not touched before it is used.
template <typename T>
class Pool {
 public:
  Pool() = default;
  /// While nobody takes or gives any.
  Pool(const Pool& from) : made_(from.made_), free_(from.free_) {
    things_.CopyFrom(from.things_, made_);
  }
  Pool& operator=(Pool&& from) noexcept {
    things_ = std::move(from.things_);
    made_ = from.made_;
    free_ = std::move(from.free_);
    return *this;
  }

  T& operator[](uint32_t number) { return things_[number]; }
  const T& operator[](uint32_t number) const { return things_[number]; }
  const T* data() const { return things_.data(); }

  /// The number of a free object, whose content is left from earlier. `share`: the thread's own,
  /// while several threads are at work.
  uint32_t Take(PoolShare* share = nullptr) {
    std::vector<uint32_t>& free = share ? share->free_ : free_;
    if (free.empty()) {
      if (share)
        Refill(share);
      else
        MakeOne();
    }
    const uint32_t number = free.back();
    free.pop_back();
    return number;
  }
  void Give(uint32_t number, PoolShare* share = nullptr) noexcept {
    try {
      (share ? share->free_ : free_).push_back(number);
    } catch (const std::bad_alloc&) {
      // The number is lost. The caller is in the middle of a change and could not handle an error.
    }
  }
  /// After this, one thread can take that many without asking for memory.
  void PrepareToTake(std::size_t count) {
    if (count == 0) return;
    free_.reserve(1);
    if (free_.size() + things_.capacity() - made_ < count) Reserve(made_ + count);
  }

  /// `shares` threads will take no more than `most` objects in all, not counting those that they
  /// give back and take again.
  void BeginSharing(std::size_t most, std::size_t shares) {
    Reserve(made_ + most + shares * kAtOnce);
    left_ = free_.size();
    next_ = made_;
  }
  void EndSharing() {
    free_.resize(left_);
    made_ = next_;
  }
  /// After EndSharing(): returns to the pool what a share has left.
  void TakeBack(PoolShare* share) noexcept {
    try {
      free_.insert(free_.end(), share->free_.begin(), share->free_.end());
    } catch (const std::bad_alloc&) {  // as in Give()
    }
    share->free_.clear();
  }

  /// From now on copies share its pages, and it is not changed any more.
  void MakeShareable() { things_.MakeShareable(made_); }

  /// Of memory that has been used.
  std::size_t bytes() const { return made_ * sizeof(T) + free_.capacity() * sizeof(uint32_t); }

 private:
  static constexpr std::size_t kAtOnce = PoolShare::kAtOnce;

  void Reserve(std::size_t capacity) {
    const std::size_t now = things_.capacity();
    if (capacity > now) things_.Reserve(std::max(capacity, now + now / 2), made_);
  }
  void MakeOne() {
    Reserve(made_ + 1);
    free_.push_back(static_cast<uint32_t>(made_++));
  }
  /// Takes from the free numbers as long as there are enough for a whole stock, then makes new
  /// ones.
  void Refill(PoolShare* share) {
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
  // Between BeginSharing() and EndSharing(): how many free numbers no share has taken yet, and the
  // next number to be made.
  std::atomic<std::size_t> left_{0}, next_{0};
};

}  // namespace Stg::internal::grid

#endif
