// SPDX-License-Identifier: GPL-2.0-or-later
//
// A pool of threads for the parallel phases of a step.

#ifndef STAGE_THREADS_WORKER_POOL_HH
#define STAGE_THREADS_WORKER_POOL_HH

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace Stg::threads {

/// Number of forks between this process and the ancestor that loaded the library.
unsigned CountForks();

class WorkerPool {
 public:
  /// Starts `threads` - 1 workers, since the caller takes part, or fewer if the system refuses.
  explicit WorkerPool(unsigned threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// False in a process that was forked after construction: fork() does not copy the workers. Such
  /// a pool runs jobs on the caller's thread. It must be leaked, because its destructor would hang.
  bool IsUsable() const { return workers_.empty() || forks_ == CountForks(); }

  unsigned threads() const { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Allows or forbids workers to spin between jobs for up to a millisecond, because waking them
  /// takes as long as many a job. Initially allowed. Forbid it while a device that runs on the CPU
  /// itself needs the processors. Cheap; also affects workers that already wait.
  void AllowSpinning(bool hold);

  /// Calls job(begin, end, thread) for ranges that partition [0, count), on the caller (thread 0)
  /// and the workers; thread < threads(). Returns when all are done. Each thread starts with the
  /// same slice in every job, for its cache, and then helps others. Results must not depend on it.
  /// If the job throws, ranges behind the failed one may be skipped; ranges before it still run.
  /// When all have finished, the exception of the first range that threw is rethrown.
  using Job = std::function<void(size_t begin, size_t end, unsigned thread)>;
  void Run(size_t count, size_t grain, const Job& job) { RunAlongside(nullptr, count, grain, job); }
  /// Like Run(). If workers take part, the caller first calls `first` (unless null) and then joins
  /// them. An exception of `first` is rethrown only if the job threw none.
  void RunAlongside(const std::function<void()>& first, size_t count, size_t grain, const Job& job);
  /// Smallest index in [0, count) for which is_so(index) is true, or `count`. May also test some
  /// indices behind the result. The caller tests the first kSerialTests, all threads test the
  /// others.
  static constexpr size_t kSerialTests = 1000;
  template <typename F>
  size_t FindFirst(size_t count, F is_so) {
    const size_t few = std::min(count, kSerialTests);
    for (size_t i = 0; i < few; i++)
      if (is_so(i)) return i;
    for (size_t begin = few; begin < count;) {
      const size_t end = std::min(count, 4 * begin), found = FindFirstOf(begin, end, is_so);
      if (found < end) return found;
      begin = end;
    }
    return count;
  }
  /// Number of jobs that were shared with workers so far, for tests.
  uint64_t shared_jobs() const { return generation_; }
  /// A grain of at most `max_grain` that gives each thread several ranges, because their costs
  /// differ.
  size_t Grain(size_t count, size_t max_grain) const;

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
  /// The remaining part of the slice that a thread starts with. Aligned to a cache line, because
  /// each thread writes to its own all the time.
  struct alignas(64) Slice {
    std::atomic<size_t> next{0};
    size_t end = 0;
  };

  void Work(unsigned thread);
  bool Enter();
  void Leave();
  void RunRanges(unsigned thread);
  void RunSlice(Slice* slice, unsigned thread);
  void Finish(const std::exception_ptr& first_exception);
  bool AllTaken() const;
  void RecordFailure(size_t begin);
  /// A waiter counts itself as asleep and then checks its condition again under the mutex. A waker
  /// makes the condition true and then checks for sleepers, so no wake-up is lost.
  struct WaitQueue {
    std::condition_variable wake_up;
    std::atomic<unsigned> asleep{0};
  };
  template <typename F>
  void WaitUntil(F is_true, WaitQueue* queue);
  void WakeAll(WaitQueue* queue);

  const unsigned forks_;  // CountForks() at construction
  // True if there is a core for every thread; if not, waiting threads must not spin.
  const bool may_spin_;
  std::vector<std::thread> workers_;
  std::mutex mutex_;
  WaitQueue workers_queue_, caller_queue_;
  // Waiting workers poll these, so nothing else shares their cache line.
  alignas(64) std::atomic<uint64_t> generation_{0};  // number of jobs
  std::atomic<bool> stop_{false};
  std::atomic<int> spin_microseconds_{0};  // microseconds of spinning before a thread sleeps
  // Late workers skip the job: the caller waits only for workers that have already entered.
  static constexpr unsigned kOpen = 1, kOneInside = 2;
  alignas(64) std::atomic<unsigned> gate_{0};  // kOpen, plus kOneInside per worker in the job

  alignas(64) const Job* job_ = nullptr;
  size_t grain_ = 1;
  static constexpr size_t kNowhere = ~size_t{0};
  std::atomic<size_t> failed_at_{kNowhere};  // start of the first range that threw
  std::exception_ptr failure_;               // its exception
  std::vector<Slice> slices_;                // one slice per thread
};

/// A pool that is leaked if it has become unusable by a fork.
std::shared_ptr<WorkerPool> MakeWorkerPool(unsigned threads);

/// Calls job(begin, end, thread) as WorkerPool::Run() does, with a grain of at most `max_grain`; on
/// the caller alone if `workers` is null.
template <typename F>
void RunOn(WorkerPool* workers, size_t count, size_t max_grain, const F& job) {
  // A reference fits into a function without an allocation.
  if (workers != nullptr)
    return workers->Run(count, workers->Grain(count, max_grain), std::ref(job));
  if (count > 0) job(size_t{0}, count, 0u);
}

}  // namespace Stg::threads

#endif
