// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/worker_pool.hh"

#include <algorithm>
#include <system_error>

namespace Stg::internal::sensing {

WorkerPool::WorkerPool(unsigned threads) {
  try {
    for (unsigned i = 1; i < threads; i++) workers_.emplace_back([this, i] { Work(i); });
  } catch (const std::system_error&) {
    // The system grants no more threads: those that there are do the work.
  }
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::Run(size_t count, size_t grain, const Job& job) {
  grain = std::max<size_t>(grain, 1);
  if (workers_.empty() || count <= grain) {
    if (count > 0) job(0, count, 0);
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    job_ = &job;
    count_ = count;
    grain_ = grain;
    next_ = 0;
    busy_ = static_cast<unsigned>(workers_.size());
    generation_++;
  }
  start_.notify_all();
  TakeRanges(0);
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

void WorkerPool::TakeRanges(unsigned thread) {
  for (;;) {
    const size_t begin = next_.fetch_add(grain_);
    if (begin >= count_) return;
    (*job_)(begin, std::min(count_, begin + grain_), thread);
  }
}

void WorkerPool::Work(unsigned thread) {
  uint64_t seen = 0;
  for (;;) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      start_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
    }
    TakeRanges(thread);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (--busy_ == 0) done_.notify_one();
  }
}

}  // namespace Stg::internal::sensing
