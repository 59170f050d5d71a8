// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds runs of things that can be done on several threads at once, among others, which have to be
// done one after the other.
//
// Whatever the mixture, looking for runs and sharing them must never cost more than it gains:
//   each thing is looked at once, although those of a short run are asked for one by one;
//   a run that is too short to be worth waking threads for is left to the caller;
//   what is worth it is measured: the first run of a step has to keep one thread busy for longer
//   than waking others takes, at a guess that favours sharing; each further one for longer by far.

#ifndef STAGE_WORLD_PHASES_RUN_FINDER_HH
#define STAGE_WORLD_PHASES_RUN_FINDER_HH

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace Stg {

/// Asked for each thing of a list in turn whether a run begins there.
class RunFinder {
 public:
  /// Fewer things than that make no run. 1: every one does, even if that is a waste of time.
  void SetFewest(size_t fewest) {
    fewest_ = first_fewest_ = worth_from_ = fewest;
    later_fewest_ = fewest <= 1 ? fewest : std::max(fewest, kAtFirst);
  }

  /// `find_length()` looks how many things from here on make a run, of `count` that there are.
  /// Returns that, or 0 if they are to be done one after the other.
  template <typename F>
  size_t Find(size_t count, F find_length) {
    if (to_skip_ > 0) {
      to_skip_--;
      return 0;
    }
    const size_t fewest = found_any_ ? later_fewest_ : first_fewest_;
    if (count < fewest) return 0;
    const size_t length = find_length();
    looks_ += std::min(length + 1, count);
    if (length > 0 && length >= fewest) {
      found_any_ = true;
      return length;
    }
    Skip(length);
    return 0;
  }

  /// This thing and those behind it, `length` in all, are to be done one after the other.
  void Skip(size_t length) { to_skip_ = length > 0 ? length - 1 : 0; }

  /// Does a run of so many things on so many threads. How long runs take says how many things are
  /// worth waking threads for; results do not depend on who does what.
  template <typename F>
  void Do(size_t length, unsigned threads, F run) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    run();
    seconds_ += std::chrono::duration<double>(Clock::now() - start).count();
    done_ += static_cast<double>(length);
    threads_ = threads;
  }

  /// Between steps.
  void EndStep() {
    // Now and then short runs are shared for some steps, to see what they take.
    constexpr uint64_t kLooksEvery = 256, kLook = 4;
    to_skip_ = 0;
    found_any_ = false;
    if (fewest_ <= 1) return;
    if (done_ > 0) {
      // Some are interrupted and take far longer: that is believed little by little.
      seconds_each_ = std::min(std::max(seconds_, 1e-9) / done_, 2 * seconds_each_);
      // As if threads had been of no use, and as if they had shared evenly.
      later_fewest_ = Fewest(kWorthWaking / seconds_each_);
      worth_from_ = Fewest(kWorthWaking / (seconds_each_ * threads_));
      seconds_ = done_ = 0;
    }
    first_fewest_ = ++steps_ % kLooksEvery < kLook ? fewest_ : worth_from_;
  }

  /// So many things, at least, are worth waking threads for once more.
  size_t later_fewest() const { return later_fewest_; }
  /// Counts how many things were looked at, for tests.
  uint64_t looks() const { return looks_; }

 private:
  static constexpr size_t kAtFirst = 256;
  // Seconds. Waking takes some 10 to 40 microseconds a thread.
  static constexpr double kWorthWaking = 200e-6;
  size_t Fewest(double worth) const {
    constexpr double kMost = 4096;
    return std::max(fewest_, static_cast<size_t>(std::min(worth, kMost)));
  }

  size_t fewest_ = 16;
  size_t first_fewest_ = 16;        // of the first run of this step
  size_t worth_from_ = 16;          // the same, of most steps
  size_t later_fewest_ = kAtFirst;  // of the runs behind it
  size_t to_skip_ = 0;
  bool found_any_ = false;         // in this step
  double seconds_ = 0, done_ = 0;  // what its runs took, and how many things they were
  double seconds_each_ = kWorthWaking / kAtFirst;
  unsigned threads_ = 1;
  uint64_t steps_ = 0;
  uint64_t looks_ = 0;
};

}  // namespace Stg

#endif
