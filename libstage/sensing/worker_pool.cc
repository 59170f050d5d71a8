// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/worker_pool.hh"

#include <algorithm>
#include <system_error>

namespace Stg::internal::sensing {

namespace {

/// Some ten nanoseconds in which the processor may do something else.
void Pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  __asm__ volatile("yield");
#endif
}

}  // namespace

WorkerPool::WorkerPool(unsigned threads) {
  // Where threads share cores, whoever waits has to make way at once.
  if (threads <= std::thread::hardware_concurrency()) looks_ = 500;
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

size_t WorkerPool::Grain(size_t count, size_t most) const {
  return std::clamp<size_t>(count / (size_t{4} * threads()), 1, most);
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
  if (SoonTrue([this] { return busy_ == 0; })) return;
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

/// Jobs follow one another quickly within a step, and sleeping and waking takes longer than most
/// of them: so it is looked for a little while whether something becomes true.
template <typename F>
bool WorkerPool::SoonTrue(F is_true) const {
  for (unsigned i = 0; i < looks_; i++) {
    if (is_true()) return true;
    Pause();
  }
  return is_true();
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
    SoonTrue([&] { return stop_ || generation_ != seen; });
    {
      std::unique_lock<std::mutex> lock(mutex_);
      start_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
    }
    TakeRanges(thread);
    if (--busy_ > 0) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    done_.notify_one();
  }
}

}  // namespace Stg::internal::sensing
