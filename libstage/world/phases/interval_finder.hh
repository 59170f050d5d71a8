// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds intervals of list items that can be processed on several threads, between items that must
// be processed serially.
//
// Searching and sharing must never cost more than they gain. Each item is examined once, although
// callers ask for the items of a short interval one by one. An interval that is too short to pay
// for waking threads is left to the caller. The minimum length is measured: the first interval of a
// step must keep one thread busy longer than waking others takes (an optimistic estimate); each
// further one must last much longer.

#ifndef STAGE_WORLD_PHASES_INTERVAL_FINDER_HH
#define STAGE_WORLD_PHASES_INTERVAL_FINDER_HH

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "messages/assert.hh"

namespace Stg {

/// Call Find() for each item of a list in turn to ask whether an interval starts there.
class IntervalFinder {
 public:
  /// Sets the minimum length of an interval. With 1, every item is one, even if that is slow.
  void SetMinLength(size_t min_length) {
    min_length_ = first_min_length_ = usual_min_length_ = min_length;
    later_min_length_ = min_length <= 1 ? min_length : std::max(min_length, kInitialMinLength);
  }

  /// `find_length()` returns how many of the `count` remaining items form an interval from here on.
  /// Returns that length, or 0 if the items are to be processed serially.
  template <typename F>
  size_t Find(size_t count, F find_length) {
    if (to_skip_ > 0) {
      to_skip_--;
      return 0;
    }
    const size_t min_length = found_any_ ? later_min_length_ : first_min_length_;
    if (count < min_length) return 0;
    const size_t length = find_length();
    examined_ += std::min(length + 1, count);
    if (length > 0 && length >= min_length) {
      found_any_ = true;
      return length;
    }
    Skip(length);
    return 0;
  }

  /// Marks this item and those after it, `length` in all, as serial.
  void Skip(size_t length) { to_skip_ = length > 0 ? length - 1 : 0; }

  /// Runs an interval of `length` items on `threads` threads and measures it. The time per item
  /// decides the minimum lengths; results do not depend on them.
  template <typename F>
  void Do(size_t length, unsigned threads, F run) {
    using Clock = std::chrono::steady_clock;
    STAGE_ASSERT(length > 0 && threads > 1);
    const Clock::time_point start = Clock::now();
    run();
    seconds_ += std::chrono::duration<double>(Clock::now() - start).count();
    done_ += static_cast<double>(length);
    threads_ = threads;
  }

  /// Call between steps.
  void EndStep() {
    // Periodically, short intervals are shared for some steps to measure them again.
    constexpr uint64_t kLooksEvery = 256, kLook = 4;
    to_skip_ = 0;
    found_any_ = false;
    if (min_length_ <= 1) return;
    if (done_ > 0) {
      // Interrupted intervals take far longer, so the estimate grows at most twofold per step.
      seconds_each_ = std::min(std::max(seconds_, 1e-9) / done_, 2 * seconds_each_);
      // The first assumes that threads gained nothing, the second that they shared evenly.
      later_min_length_ = MinLength(kWakeUpCost / seconds_each_);
      usual_min_length_ = MinLength(kWakeUpCost / (seconds_each_ * threads_));
      seconds_ = done_ = 0;
    }
    first_min_length_ = ++steps_ % kLooksEvery < kLook ? min_length_ : usual_min_length_;
  }

  /// Minimum length of an interval for which waking the workers again pays.
  size_t later_min_length() const { return later_min_length_; }
  /// For tests: number of items examined.
  uint64_t examined() const { return examined_; }

 private:
  static constexpr size_t kInitialMinLength = 256;
  // Seconds. Waking takes 10 to 40 microseconds per thread.
  static constexpr double kWakeUpCost = 200e-6;
  size_t MinLength(double worth) const {
    constexpr double kMaxMinLength = 4096;
    return std::max(min_length_, static_cast<size_t>(std::min(worth, kMaxMinLength)));
  }

  size_t min_length_ = 16;
  size_t first_min_length_ = 16;                 // minimum for the first interval of this step
  size_t usual_min_length_ = 16;                 // minimum in most steps
  size_t later_min_length_ = kInitialMinLength;  // minimum for later intervals of a step
  size_t to_skip_ = 0;
  bool found_any_ = false;         // an interval in this step
  double seconds_ = 0, done_ = 0;  // duration and number of items of the intervals
  double seconds_each_ = kWakeUpCost / kInitialMinLength;
  unsigned threads_ = 1;
  uint64_t steps_ = 0;
  uint64_t examined_ = 0;
};

}  // namespace Stg

#endif
