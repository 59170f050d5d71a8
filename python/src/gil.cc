// SPDX-License-Identifier: GPL-2.0-or-later

#include "gil.hh"

#include <pthread.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "integers.hh"
#include "threads/wall_clock.hh"

namespace Stg::python {

namespace nb = nanobind;

namespace {

constexpr double kExitTimeout = 10;  // seconds that the exit of the program waits for running steps
constexpr std::chrono::milliseconds kPause(1);

std::atomic<bool> g_ending{false};
/// The thread that ends the program. Valid once g_ending is true.
pthread_t g_ender;
/// Number of live GilReleases in all threads that are not parked, and in this thread.
std::atomic<int> g_releases{0};
thread_local int t_releases = 0;

bool MustPark() noexcept { return g_ending && !pthread_equal(g_ender, pthread_self()); }

[[noreturn]] void Park() noexcept {
  g_releases -= t_releases;
  t_releases = 0;
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

/// Python calls it at exit, while all threads still run. A thread that is already waiting for the
/// GIL gets it, and parks at its next GilRelease.
void EndThreads() {
  // Parked threads never release their objects; nanobind must not report these as leaks.
  if (nb::cast<int>(nb::module_::import_("threading").attr("active_count")()) > 1)
    nb::set_leak_warnings(false);
  g_ender = pthread_self();
  g_ending = true;
  PyThreadState* const state = PyEval_SaveThread();
  const double end = threads::WallClock() + kExitTimeout;
  while (g_releases > t_releases && threads::WallClock() < end) std::this_thread::sleep_for(kPause);
  PyEval_RestoreThread(state);
}

/// Runs in the child process after fork(), which has only the calling thread.
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
