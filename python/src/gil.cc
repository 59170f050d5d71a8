// SPDX-License-Identifier: GPL-2.0-or-later

#include "gil.hh"

#include <pthread.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "threads/wall_clock.hh"

namespace Stg::python {

namespace nb = nanobind;

namespace {

constexpr double kPatience = 10;  // seconds that the end of the program waits for a step
constexpr std::chrono::milliseconds kPause(1);

std::atomic<bool> g_ending{false};
/// The thread that ends the program. Valid once g_ending is true.
pthread_t g_ender;
/// Number of GilReleases of all threads that may still ask for the GIL, and of this thread.
std::atomic<int> g_releases{0};
thread_local int t_releases = 0;

bool MustPark() noexcept { return g_ending && !pthread_equal(g_ender, pthread_self()); }

[[noreturn]] void Park() noexcept {
  g_releases -= t_releases;
  t_releases = 0;
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

/// Python calls it while all threads still run. Threads that have just asked for the GIL get it,
/// and park when they release it the next time.
void EndThreads() {
  // Threads that are parked never let go of their objects, which is no mistake of the bindings.
  if (nb::cast<int>(nb::module_::import_("threading").attr("active_count")()) > 1)
    nb::set_leak_warnings(false);
  g_ender = pthread_self();
  g_ending = true;
  PyThreadState* const state = PyEval_SaveThread();
  const double end = threads::WallClock() + kPatience;
  while (g_releases > t_releases && threads::WallClock() < end) std::this_thread::sleep_for(kPause);
  PyEval_RestoreThread(state);
}

/// The child of a fork has the calling thread alone.
void ForgetOtherThreads() { g_releases = t_releases; }

}  // namespace

GilRelease::GilRelease() noexcept {
  g_releases++;
  t_releases++;
  state_ = PyEval_SaveThread();
  ParkIfEnding();
}

GilRelease::~GilRelease() {
  ParkIfEnding();
  PyEval_RestoreThread(state_);
  t_releases--;
  g_releases--;
}

void GilRelease::ParkIfEnding() noexcept {
  if (MustPark()) Park();
}

void ParkThreadsAtExit() {
  pthread_atfork(nullptr, nullptr, &ForgetOtherThreads);
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(&EndThreads));
}

}  // namespace Stg::python
