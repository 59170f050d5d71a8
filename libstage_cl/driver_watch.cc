// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/driver_watch.hh"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "libstage_cl/call_clock.hh"
#include "libstage_cl/calls.hh"

namespace Stg::cl {

namespace {

struct Crash {
  int signal;
  const char* name;  // stored here because strsignal() may allocate
  struct sigaction before;
};
// A plain array, because the signal handler reads it.
Crash g_crashes[] = {{SIGSEGV, "Segmentation fault", {}},
                     {SIGBUS, "Bus error", {}},
                     {SIGILL, "Illegal instruction", {}},
                     {SIGFPE, "Floating point exception", {}},
                     {SIGABRT, "Aborted", {}}};

/// One line on standard error. Never allocates, so that signal handlers can use it.
class ErrorLine {
 public:
  ErrorLine() { *this << "stage: "; }
  ErrorLine& operator<<(const char* text) {
    const size_t space = sizeof text_ - length_;
    const size_t count = std::min(strlen(text), space);
    memcpy(text_ + length_, text, count);
    length_ += count;
    return *this;
  }
  /// Appends "the OpenCL driver of NAME", or without a name "the OpenCL driver".
  ErrorLine& AddDriver(const calls::Record& record) {
    char name[128];
    calls::CopyDriver(record, &name);
    return *this << "the OpenCL driver" << (name[0] ? " of " : "") << name;
  }
  void Write() {
    *this << "; run without --opencl for the same results without a driver\n";
    size_t written = 0;
    while (written < length_) {
      const ssize_t count = write(STDERR_FILENO, text_ + written, length_ - written);
      if (count <= 0) return;
      written += static_cast<size_t>(count);
    }
  }

 private:
  char text_[512];
  size_t length_ = 0;
};

/// This thread's call in progress, otherwise another thread's, otherwise null.
const calls::Record* RecordOfCrash(bool* is_own) {
  const calls::Record* other = nullptr;
  for (const calls::Record& record : calls::Records()) {
    if (!record.call) continue;
    *is_own = pthread_equal(record.thread, pthread_self()) != 0;
    if (*is_own) return &record;
    other = &record;
  }
  return other;
}

void ReportCrash(const char* name) {
  bool is_own = false;
  const calls::Record* const record = RecordOfCrash(&is_own);
  if (!record) return;
  const char* const call = record->call;
  if (!call) return;  // it has just ended
  ErrorLine line;
  if (is_own) {
    line.AddDriver(*record) << " has crashed in " << call << " (" << name << ")";
  } else {  // most likely a thread of the driver
    line << "a thread has crashed (" << name << ") while ";
    line.AddDriver(*record) << " was in " << call;
  }
  line.Write();
}

void OnCrash(int signal, siginfo_t* info, void*) {
  const int error = errno;
  for (Crash& crash : g_crashes) {
    if (crash.signal != signal) continue;
    ReportCrash(crash.name);
    sigaction(signal, &crash.before, nullptr);
    // After return, a fault happens again by itself; a sent signal must be raised again.
    if (info->si_code <= 0) raise(signal);
  }
  errno = error;
}

void InstallHandlers() {
  struct sigaction action = {};
  action.sa_sigaction = OnCrash;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK;
  sigemptyset(&action.sa_mask);
  for (const Crash& crash : g_crashes) sigaction(crash.signal, &action, nullptr);
}

void RemoveHandlers() {
  for (const Crash& crash : g_crashes) {
    struct sigaction now = {};
    sigaction(crash.signal, nullptr, &now);
    if ((now.sa_flags & SA_SIGINFO) != 0 && now.sa_sigaction == OnCrash)
      sigaction(crash.signal, &crash.before, nullptr);
  }
}

/// Reports at the end of the process if a driver has ended it.
void ReportExit() {
  bool is_own = false;
  const calls::Record* const record = RecordOfCrash(&is_own);
  if (!record || !is_own) return;
  const char* const call = record->call;
  (ErrorLine().AddDriver(*record) << " has ended the process in " << call).Write();
}

[[noreturn]] void EndHungProcess(const calls::Record& record, unsigned seconds) {
  char text[16];
  std::snprintf(text, sizeof text, "%u", seconds);
  const char* const call = record.call;
  (ErrorLine().AddDriver(record) << " hangs: " << (call ? call : "a call")
                                 << " has not returned for " << text << " s (STAGE_CL_TIMEOUT)")
      .Write();
  // Flush earlier output, unless the hanging thread holds the stream.
  if (ftrylockfile(stdout) == 0) fflush_unlocked(stdout);
  _exit(EXIT_FAILURE);  // destructors would wait for the driver
}

/// A thread that checks the calls of all threads until it is stopped.
class Watchdog {
 public:
  explicit Watchdog(unsigned seconds) : seconds_(seconds), thread_([this] { Watch(); }) {}
  ~Watchdog() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_up_.notify_one();
    thread_.join();
  }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  bool IsOfThisProcess() const { return getpid() == process_; }

 private:
  void Watch() {
    const std::array<calls::Record, 64>& records = calls::Records();
    std::vector<CallClock> clocks(records.size(), CallClock(seconds_));
    std::unique_lock lock(mutex_);
    while (!wake_up_.wait_for(lock, clocks[0].nap(), [this] { return stop_; }))
      for (size_t i = 0; i < records.size(); i++)
        if (clocks[i].IsOverdue(records[i])) EndHungProcess(records[i], seconds_);
  }

  const unsigned seconds_;
  const pid_t process_ = getpid();
  bool stop_ = false;
  std::mutex mutex_;
  std::condition_variable wake_up_;
  std::thread thread_;
};

/// State of all watches in the process. Never deleted: worlds may outlive static destructors.
struct WatchState {
  std::mutex mutex;
  unsigned watches = 0;
  std::unique_ptr<Watchdog> watchdog;
  WatchState() { std::atexit(ReportExit); }
};

WatchState& GlobalWatchState() {
  static WatchState* const state = new WatchState;
  return *state;
}

}  // namespace

DriverWatch::DriverWatch(unsigned seconds) {
  WatchState& state = GlobalWatchState();
  const std::lock_guard lock(state.mutex);
  if (state.watches++ > 0) return;
  for (Crash& crash : g_crashes) sigaction(crash.signal, nullptr, &crash.before);
  InstallHandlers();
  if (seconds == 0) return;
  try {
    state.watchdog = std::make_unique<Watchdog>(seconds);
  } catch (const std::system_error&) {
    // No thread available: hanging calls stay undetected.
  }
}

DriverWatch::~DriverWatch() {
  WatchState& state = GlobalWatchState();
  const std::lock_guard lock(state.mutex);
  if (--state.watches > 0) return;
  // A forked process does not have this thread, so it must not join it.
  if (state.watchdog && !state.watchdog->IsOfThisProcess())
    static_cast<void>(state.watchdog.release());
  state.watchdog.reset();
  RemoveHandlers();
}

SetUpWatch::SetUpWatch() { calls::g_after_call = InstallHandlers; }

SetUpWatch::~SetUpWatch() { calls::g_after_call = nullptr; }

}  // namespace Stg::cl
