// SPDX-License-Identifier: GPL-2.0-or-later
//
// Threads that share the work of one step.

#ifndef STAGE_SENSING_WORKER_POOL_HH
#define STAGE_SENSING_WORKER_POOL_HH

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace Stg::internal::sensing {

class WorkerPool {
 public:
  /// `threads` in all, the caller's included; 1 or less: no thread is started. Fewer than that, if
  /// the system grants no more.
  explicit WorkerPool(unsigned threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  unsigned threads() const { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls job(begin, end, thread) for ranges that make up [0, count), on all threads, the caller's
  /// among them; `thread` is below threads(). Returns when all is done. Which thread does what is
  /// left open: results must not depend on it. The job must not throw.
  using Job = std::function<void(size_t begin, size_t end, unsigned thread)>;
  void Run(size_t count, size_t grain, const Job& job);
  /// A grain of `most` at most, so that each thread gets several shares of that many things: for
  /// some may take longer than others.
  size_t Grain(size_t count, size_t most) const;

 private:
  void Work(unsigned thread);
  void TakeRanges(unsigned thread);
  template <typename F>
  bool SoonTrue(F is_true) const;

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable start_, done_;
  // They change under the mutex where somebody may sleep until they do, so no wake-up can be
  // missed.
  std::atomic<uint64_t> generation_{0};  // of jobs
  std::atomic<bool> stop_{false};
  std::atomic<unsigned> busy_{0};
  unsigned looks_ = 0;  // before going to sleep

  const Job* job_ = nullptr;
  size_t count_ = 0, grain_ = 1;
  std::atomic<size_t> next_{0};
};

}  // namespace Stg::internal::sensing

namespace Stg {
namespace sensing = internal::sensing;  // for the rooms above: clients see no such header
}

#endif
