// SPDX-License-Identifier: GPL-2.0-or-later
//
// Things that come and go, by number.

#ifndef STAGE_GRID_POOL_HH
#define STAGE_GRID_POOL_HH

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

namespace Stg::internal::grid {

/// The numbers of free things of a pool that one of several threads has at hand.
class PoolShare {
  template <typename T>
  friend class Pool;
  std::vector<uint32_t> free_;

 public:
  /// Those that it gets are then taken without asking for memory.
  void Prepare() { free_.reserve(kAtOnce); }
  static constexpr std::size_t kAtOnce = 64;  // numbers that a share gets
};

/// Plain things in one array. One thread takes and gives back as it likes; or, between
/// BeginSharing() and EndSharing(), several at once, each with a share of its own. Memory that was
/// reserved and not taken is not touched either.
template <typename T>
class Pool {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  T& operator[](uint32_t number) { return things_[number]; }
  const T& operator[](uint32_t number) const { return things_[number]; }
  const T* data() const { return things_.get(); }

  /// The number of a thing, of any content. `share`: while several threads are at work.
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
      // The number is lost. Whoever gives something back is half done and can't stop there.
    }
  }
  /// One thread will then take so many without asking for memory.
  void PrepareToTake(std::size_t count) {
    if (count == 0) return;
    free_.reserve(1);
    if (free_.size() + capacity_ - made_ < count) Reserve(made_ + count);
  }

  /// No more than `most` will be taken by `shares` threads, besides what they give back.
  void BeginSharing(std::size_t most, std::size_t shares) {
    Reserve(made_ + most + shares * kAtOnce);
    left_ = free_.size();
    next_ = made_;
  }
  void EndSharing() {
    free_.resize(left_);
    made_ = next_;
  }
  /// What is left of a share, after EndSharing().
  void TakeBack(PoolShare* share) noexcept {
    try {
      free_.insert(free_.end(), share->free_.begin(), share->free_.end());
    } catch (const std::bad_alloc&) {  // as in Give()
    }
    share->free_.clear();
  }

  /// Memory that was made use of.
  std::size_t bytes() const { return made_ * sizeof(T) + free_.capacity() * sizeof(uint32_t); }

 private:
  static constexpr std::size_t kAtOnce = PoolShare::kAtOnce;

  void Reserve(std::size_t capacity) {
    if (capacity <= capacity_) return;
    const std::size_t more = std::max(capacity, capacity_ + capacity_ / 2);
    std::unique_ptr<T[]> larger = std::make_unique_for_overwrite<T[]>(more);
    // Not std::copy_n: GCC 14 warns of what it would do with more things than fit.
    if (made_ > 0) std::memcpy(larger.get(), things_.get(), made_ * sizeof(T));
    things_ = std::move(larger);
    capacity_ = more;
  }
  void MakeOne() {
    Reserve(made_ + 1);
    free_.push_back(static_cast<uint32_t>(made_++));
  }
  /// Free ones first; what is left of them if there are too few stays where it is.
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

  std::unique_ptr<T[]> things_;
  std::size_t made_ = 0, capacity_ = 0;
  std::vector<uint32_t> free_;
  // While there are shares: how many of the free ones none has got, and the next to be made.
  std::atomic<std::size_t> left_{0}, next_{0};
};

}  // namespace Stg::internal::grid

#endif
