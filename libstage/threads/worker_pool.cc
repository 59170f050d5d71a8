// SPDX-License-Identifier: GPL-2.0-or-later

#include "threads/worker_pool.hh"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <system_error>
#include <utility>

#include "messages/assert.hh"
#include "threads/processors.hh"

namespace Stg::threads {

namespace {

/// Yields the core to its other hardware thread for about ten nanoseconds.
void Pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__) || (defined(__arm__) && __ARM_ARCH >= 7)
  __asm__ volatile("yield");
#endif
}

std::atomic<unsigned> forks{0};
[[maybe_unused]] const int counting_forks = pthread_atfork(nullptr, nullptr, [] { forks++; });

}  // namespace

WorkerPool::WorkerPool(unsigned threads)
    : forks_(CountForks()),
      may_spin_(threads <= 1 || threads <= CountUsableProcessors()),
      slices_(std::max(threads, 1u)) {
  // Allocate before the first thread starts: an exception must not leave running threads behind.
  workers_.reserve(slices_.size() - 1);
  try {
    for (unsigned i = 1; i < threads; i++) workers_.emplace_back([this, i] { Work(i); });
  } catch (const std::system_error&) {
    // The system grants no more threads: continue with those that started.
  } catch (const std::bad_alloc&) {
  }
  AllowSpinning(true);
}

unsigned CountForks() { return forks; }

WorkerPool::~WorkerPool() {
  STAGE_ASSERT(IsUsable() && gate_ == 0);
  stop_ = true;
  WakeAll(&workers_queue_);
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::AllowSpinning(bool hold) {
  // Microseconds. Waking one thread takes about 10 to 40, waking many takes longer.
  constexpr int kShortSpin = 10, kWakeTimeSpin = 50, kLong = 1000;
  constexpr unsigned kManyThreads = 8;
  const int held = threads() < kManyThreads ? kWakeTimeSpin : kLong;
  const int spin_microseconds = !may_spin_ ? 0 : hold ? held : kShortSpin;
  // Waiting threads poll the value, so write it only if it changes and keep it in their caches.
  if (spin_microseconds != spin_microseconds_) spin_microseconds_ = spin_microseconds;
}

size_t WorkerPool::Grain(size_t count, size_t max_grain) const {
  return std::clamp<size_t>(count / (size_t{4} * threads()), 1, max_grain);
}

void WorkerPool::RunAlongside(const std::function<void()>& first, size_t count, size_t grain,
                              const Job& job) {
  grain = std::max<size_t>(grain, 1);
  if (workers_.empty() || count <= grain || !IsUsable()) {
    if (count > 0) job(0, count, 0);
    return;
  }
  STAGE_ASSERT(gate_ == 0 && failed_at_ == kNowhere);  // no job is running: jobs do not nest
  STAGE_ASSERT(!stop_ && slices_.size() >= threads());
  job_ = &job;
  grain_ = grain;
  for (unsigned i = 0; i < threads(); i++) {
    slices_[i].next.store(count * i / threads(), std::memory_order_relaxed);
    slices_[i].end = count * (i + 1) / threads();
  }
  gate_ = kOpen;
  generation_++;
  WakeAll(&workers_queue_);
  std::exception_ptr first_exception;
  try {
    if (first) first();
  } catch (...) {
    first_exception = std::current_exception();
  }
  RunRanges(0);
  Finish(first_exception);
}

/// Closes the job, waits for the workers inside and rethrows the first exception.
void WorkerPool::Finish(const std::exception_ptr& first_exception) {
  STAGE_ASSERT((gate_ & kOpen) != 0);
  gate_ -= kOpen;
  WaitUntil([this] { return gate_ == 0; }, &caller_queue_);
  STAGE_ASSERT(AllTaken());
  if (failed_at_ != kNowhere) {
    failed_at_ = kNowhere;
    std::rethrow_exception(std::exchange(failure_, nullptr));
  }
  if (first_exception) std::rethrow_exception(first_exception);
}

/// True if no range of the job is left.
bool WorkerPool::AllTaken() const {
  const auto taken = [](const Slice& slice) { return slice.next.load() >= slice.end; };
  return std::all_of(slices_.begin(), slices_.begin() + threads(), taken);
}

void WorkerPool::RecordFailure(size_t begin) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (begin > failed_at_) return;
  failed_at_ = begin;
  failure_ = std::current_exception();
}

void WorkerPool::WakeAll(WaitQueue* queue) {
  if (queue->asleep == 0) return;
  // A thread counted as asleep holds the mutex until it waits; locking it avoids lost wake-ups.
  { const std::lock_guard<std::mutex> lock(mutex_); }
  queue->wake_up.notify_all();
}

/// Spins before it sleeps: jobs follow one another quickly within a step, and sleeping and waking
/// takes longer than most jobs.
template <typename F>
void WorkerPool::WaitUntil(F is_true, WaitQueue* queue) {
  using Clock = std::chrono::steady_clock;
  constexpr unsigned kPollsPerClockRead = 16;  // checks between reads of the clock
  if (spin_microseconds_ > 0) {
    const Clock::time_point start = Clock::now();
    do {
      for (unsigned i = 0; i < kPollsPerClockRead; i++) {
        if (is_true()) return;
        Pause();
      }
    } while (Clock::now() - start < std::chrono::microseconds(spin_microseconds_));
  }
  std::unique_lock<std::mutex> lock(mutex_);
  queue->asleep++;
  queue->wake_up.wait(lock, is_true);
  queue->asleep--;
}

void WorkerPool::RunRanges(unsigned thread) {
  STAGE_ASSERT(thread < threads());
  for (unsigned i = 0; i < threads(); i++) RunSlice(&slices_[(thread + i) % threads()], thread);
}

void WorkerPool::RunSlice(Slice* slice, unsigned thread) {
  size_t begin = slice->next.load(std::memory_order_relaxed);
  while (begin < slice->end) {
    // Ranges shrink towards the end, so that all threads finish at about the same time.
    const size_t count = std::clamp<size_t>((slice->end - begin) / 2, 1, grain_);
    STAGE_ASSERT(job_ && grain_ >= 1);
    if (!slice->next.compare_exchange_weak(begin, begin + count, std::memory_order_relaxed))
      continue;
    try {
      if (begin < failed_at_.load(std::memory_order_relaxed)) (*job_)(begin, begin + count, thread);
    } catch (...) {
      RecordFailure(begin);
    }
    begin = slice->next.load(std::memory_order_relaxed);
  }
}

bool WorkerPool::Enter() {
  unsigned gate = gate_;
  while (gate & kOpen)
    if (gate_.compare_exchange_weak(gate, gate + kOneInside)) return true;
  return false;
}

void WorkerPool::Leave() {
  STAGE_ASSERT(gate_ >= kOneInside);
  if (gate_.fetch_sub(kOneInside) == kOneInside) WakeAll(&caller_queue_);
}

void WorkerPool::Work(unsigned thread) {
  uint64_t seen = 0;
  for (;;) {
    WaitUntil([&] { return stop_ || generation_ != seen; }, &workers_queue_);
    if (stop_) return;
    seen = generation_;
    if (!Enter()) continue;
    RunRanges(thread);
    Leave();
  }
}

/// Threads of a pool cannot be joined after a fork.
std::shared_ptr<WorkerPool> MakeWorkerPool(unsigned threads) {
  return {new WorkerPool(threads), [](WorkerPool* pool) {
            if (pool->IsUsable()) delete pool;
          }};
}

}  // namespace Stg::threads
