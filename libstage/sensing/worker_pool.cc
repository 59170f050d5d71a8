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

WorkerPool::WorkerPool(unsigned threads) : shares_(std::max(threads, 1u)) {
  HoldProcessors(true);
  try {
    for (unsigned i = 1; i < threads; i++) workers_.emplace_back([this, i] { Work(i); });
  } catch (const std::system_error&) {
    // The system grants no more threads: those that there are do the work.
  }
}

WorkerPool::~WorkerPool() {
  stop_ = true;
  WakeAll(&workers_bed_);
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::HoldProcessors(bool hold) {
  constexpr unsigned kFew = 500, kMany = 20000;  // some 25 microseconds; a millisecond
  constexpr unsigned kManyThreads = 8;           // fewer are awake soon enough
  const auto threads = static_cast<unsigned>(shares_.size());
  // Where threads share processors, whoever waits has to make way at once.
  if (threads > std::thread::hardware_concurrency())
    looks_ = 0;
  else
    looks_ = hold && threads >= kManyThreads ? kMany : kFew;
}

size_t WorkerPool::Grain(size_t count, size_t most) const {
  return std::clamp<size_t>(count / (size_t{4} * threads()), 1, most);
}

void WorkerPool::RunBeside(const std::function<void()>& first, size_t count, size_t grain,
                           const Job& job) {
  grain = std::max<size_t>(grain, 1);
  if (workers_.empty() || count <= grain) {
    if (count > 0) job(0, count, 0);
    return;
  }
  job_ = &job;
  grain_ = grain;
  for (unsigned i = 0; i < threads(); i++) {
    shares_[i].next.store(count * i / threads(), std::memory_order_relaxed);
    shares_[i].end = count * (i + 1) / threads();
  }
  busy_ = static_cast<unsigned>(workers_.size());
  generation_++;
  WakeAll(&workers_bed_);
  if (first) first();
  TakeRanges(0);
  WaitUntil([this] { return busy_ == 0; }, &caller_bed_);
}

void WorkerPool::WakeAll(Bed* bed) {
  if (bed->asleep == 0) return;
  // Who has said so holds the mutex until it sleeps.
  { const std::lock_guard<std::mutex> lock(mutex_); }
  bed->wake_up.notify_all();
}

/// Jobs follow one another quickly within a step, and sleeping and waking takes longer than most
/// of them: so it is looked for a little while whether something becomes true.
template <typename F>
void WorkerPool::WaitUntil(F is_true, Bed* bed) {
  for (unsigned i = 0; i < looks_.load(std::memory_order_relaxed); i++) {
    if (is_true()) return;
    Pause();
  }
  std::unique_lock<std::mutex> lock(mutex_);
  bed->asleep++;
  bed->wake_up.wait(lock, is_true);
  bed->asleep--;
}

void WorkerPool::TakeRanges(unsigned thread) {
  for (unsigned i = 0; i < threads(); i++) TakeFrom(&shares_[(thread + i) % threads()], thread);
}

void WorkerPool::TakeFrom(Share* share, unsigned thread) {
  size_t begin = share->next.load(std::memory_order_relaxed);
  while (begin < share->end) {
    // Ever less towards the end, so that threads finish at about the same time.
    const size_t count = std::clamp<size_t>((share->end - begin) / 2, 1, grain_);
    if (!share->next.compare_exchange_weak(begin, begin + count, std::memory_order_relaxed))
      continue;
    (*job_)(begin, begin + count, thread);
    begin = share->next.load(std::memory_order_relaxed);
  }
}

void WorkerPool::Work(unsigned thread) {
  uint64_t seen = 0;
  for (;;) {
    WaitUntil([&] { return stop_ || generation_ != seen; }, &workers_bed_);
    if (stop_) return;
    seen = generation_;
    TakeRanges(thread);
    if (--busy_ == 0) WakeAll(&caller_bed_);
  }
}

}  // namespace Stg::internal::sensing
