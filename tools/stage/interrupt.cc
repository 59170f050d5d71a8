// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/interrupt.hh"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <ctime>

namespace Stg::program {

namespace {

std::atomic<int> caught{0};
std::atomic<void (*)()> on_signal{nullptr};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<void (*)()>::is_always_lock_free,
              "signal handlers need it");

// A signal may arrive between the check of `caught` and sleeping, or in another thread. A byte in a
// pipe wakes the sleeper in both cases.
int wake_pipe[2] = {-1, -1};

void Note(int signal) {
  const int saved = errno;
  caught = signal;
  if (void (*const action)() = on_signal) action();
  const char byte = 0;
  [[maybe_unused]] const ssize_t written = write(wake_pipe[1], &byte, 1);
  errno = saved;
}

void Catch(int signal) {
  struct sigaction action = {};
  // Signals that are ignored stay ignored: nohup and background jobs of shells rely on it.
  if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) return;
  action = {};
  action.sa_handler = Note;
  action.sa_flags = SA_RESTART;
  // Closing a terminal sends SIGHUP directly and again through the shell.
  if (signal != SIGHUP) action.sa_flags |= static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

}  // namespace

void CatchSignals() {
  if (pipe(wake_pipe) != 0) return;  // without the pipe, signals keep their default action
  for (const int end : wake_pipe) {
    fcntl(end, F_SETFD, FD_CLOEXEC);
    fcntl(end, F_SETFL, O_NONBLOCK);
  }
  Catch(SIGINT);
  Catch(SIGTERM);
  Catch(SIGHUP);
}

void OnSignal(void (*action)()) { on_signal = action; }

int CaughtSignal() { return caught; }

bool SleepUntil(double time) {
  constexpr double kMaxNap = 3600;
  for (;;) {
    if (CaughtSignal() != 0) return false;
    const double left = std::min(time - WallClock(), kMaxNap);
    if (left <= 0) return true;
    pollfd wake = {wake_pipe[0], POLLIN, 0};
#ifdef __linux__
    const double seconds = std::floor(left);
    const timespec nap = {static_cast<std::time_t>(seconds),
                          static_cast<long>((left - seconds) * 1e9)};
    ppoll(&wake, 1, &nap, nullptr);
#else
    poll(&wake, 1, static_cast<int>(std::ceil(left * 1e3)));
#endif
  }
}

int RaiseDefault(int signal) {
  std::signal(signal, SIG_DFL);
  raise(signal);
  return 128 + signal;
}

}  // namespace Stg::program
