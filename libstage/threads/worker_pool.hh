// SPDX-License-Identifier: GPL-2.0-or-later
//
// Threads that share the work of one step.

#ifndef STAGE_THREADS_WORKER_POOL_HH
#define STAGE_THREADS_WORKER_POOL_HH

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace Stg::threads {

/// How often this process and those that it descends from were forked.
unsigned CountForks();

class WorkerPool {
 public:
  /// `threads` in all, the caller's included; 1 or less: no thread is started. Fewer than that, if
  /// the system grants no more.
  explicit WorkerPool(unsigned threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// False in a process that was forked since the pool was made: the threads are not in it. Such a
  /// pool does all work on the caller's thread. It can't be destroyed, only left alone.
  bool IsHere() const { return workers_.empty() || forks_ == CountForks(); }

  unsigned threads() const { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Whether threads may hold on to their processors between jobs, up to a millisecond: waking them
  /// takes as long as many a job. At first they may. They had better not while something else, a
  /// device that is the processor itself, needs these. Takes next to no time; threads that are
  /// already waiting obey too.
  void HoldProcessors(bool hold);

  /// Calls job(begin, end, thread) for ranges that make up [0, count), on all threads, the caller's
  /// among them; `thread` is below threads(). Returns when all is done. Each thread begins with its
  /// own share, so that what it worked on in one job is in its cache in the next, and then helps
  /// the others: results must not depend on who does what.
  /// If the job throws, what is behind that place need not be done any more; all that is before it
  /// is. When everybody has finished, the exception of the first range that threw is thrown again:
  /// what one thread would have got to see.
  using Job = std::function<void(size_t begin, size_t end, unsigned thread)>;
  void Run(size_t count, size_t grain, const Job& job) { RunBeside(nullptr, count, grain, job); }
  /// The same; if other threads have work to begin with, calls `first` before the caller joins
  /// them. Null: nothing. What it throws comes after what the job throws.
  void RunBeside(const std::function<void()>& first, size_t count, size_t grain, const Job& job);
  /// The first of [0, count) for which is_so(index) is true, or `count`. Looks at some behind the
  /// first too, but never at many more than there are before it: a few are looked at by the caller,
  /// the others on all threads.
  static constexpr size_t kFewLooks = 1000;
  template <typename F>
  size_t FindFirst(size_t count, F is_so) {
    const size_t few = std::min(count, kFewLooks);
    for (size_t i = 0; i < few; i++)
      if (is_so(i)) return i;
    for (size_t begin = few; begin < count;) {
      const size_t end = std::min(count, 4 * begin), found = FindFirstOf(begin, end, is_so);
      if (found < end) return found;
      begin = end;
    }
    return count;
  }
  /// How many jobs were shared with other threads so far, for tests.
  uint64_t shared_jobs() const { return generation_; }
  /// A grain of `most` at most, so that each thread gets several shares of that many things: for
  /// some may take longer than others.
  size_t Grain(size_t count, size_t most) const;

 private:
  template <typename F>
  size_t FindFirstOf(size_t first, size_t end, F is_so) {
    constexpr size_t kGrain = 64;
    std::atomic<size_t> found{end};
    Run(end - first, kGrain, [&](size_t from, size_t to, unsigned) {
      for (size_t i = first + from; i < first + to; i++) {
        size_t known = found.load(std::memory_order_relaxed);
        if (i >= known) return;
        if (!is_so(i)) continue;
        while (i < known && !found.compare_exchange_weak(known, i)) {
        }
        return;
      }
    });
    return found;
  }
  /// What is left of the share that a thread begins with. A cache line of its own, as the threads
  /// write to theirs all the time.
  struct alignas(64) Share {
    std::atomic<size_t> next{0};
    size_t end = 0;
  };

  void Work(unsigned thread);
  bool Enter();
  void Leave();
  void TakeRanges(unsigned thread);
  void TakeFrom(Share* share, unsigned thread);
  void Finish(const std::exception_ptr& of_first);
  void NoteFailure(size_t begin);
  /// A waiter first counts itself as asleep, then checks its condition once more, under the mutex.
  /// A waker first makes the condition true, then checks whether anybody is asleep. So no wake-up
  /// is missed, and none is made for nobody.
  struct WaitQueue {
    std::condition_variable wake_up;
    std::atomic<unsigned> asleep{0};
  };
  template <typename F>
  void WaitUntil(F is_true, WaitQueue* queue);
  void WakeAll(WaitQueue* queue);

  const unsigned forks_;  // that there had been when it was made
  // One for each thread. Otherwise whoever waits has to make way at once.
  const bool has_processors_;
  std::vector<std::thread> workers_;
  std::mutex mutex_;
  WaitQueue workers_queue_, caller_queue_;
  // Who waits for the next job looks at these all the time: nothing else is on their cache line.
  alignas(64) std::atomic<uint64_t> generation_{0};  // of jobs
  std::atomic<bool> stop_{false};
  std::atomic<int> patience_{0};  // microseconds before going to sleep
  // Who comes too late for a job is not waited for: on a busy machine some thread always does.
  static constexpr unsigned kOpen = 1, kOneInside = 2;
  alignas(64) std::atomic<unsigned> gate_{0};  // to the present job: open or not, and who is inside

  alignas(64) const Job* job_ = nullptr;
  size_t grain_ = 1;
  static constexpr size_t kNowhere = ~size_t{0};
  std::atomic<size_t> failed_at_{kNowhere};  // where the first range begins that threw
  std::exception_ptr failure_;               // what it threw
  std::vector<Share> shares_;                // one for each thread
};

}  // namespace Stg::threads

#endif
