// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/probe.hh"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <new>

#include "libstage_cl/call_clock.hh"
#include "libstage_cl/calls.hh"
#include "libstage_cl/pocl_cache.hh"

namespace Stg::cl {

namespace {

// Exit statuses of the child unless a driver ends it. Drivers are unlikely to use these numbers.
constexpr int kDone = 90, kEndedByDriver = 91;

/// Result of the child, in memory shared with its parent.
struct Report {
  calls::Record record;
  char wrong[8192] = "";  // empty: success
};

class SharedReport {
 public:
  SharedReport()
      : memory_(mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                     -1, 0)) {
    if (*this) new (memory_) Report;
  }
  ~SharedReport() {
    if (*this) munmap(memory_, sizeof(Report));
  }
  SharedReport(const SharedReport&) = delete;
  SharedReport& operator=(const SharedReport&) = delete;

  explicit operator bool() const { return memory_ != MAP_FAILED; }
  Report* operator->() const { return static_cast<Report*>(memory_); }

 private:
  void* memory_;
};

[[noreturn]] void RunChild(const std::function<std::string()>& task, Report* report) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int crash : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT}) signal(crash, SIG_DFL);
  const struct rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  // If a driver calls exit(), handlers that the parent registered must not run.
  std::atexit([] { _exit(kEndedByDriver); });
  calls::RedirectThisThread(&report->record);
  const std::string wrong = task();
  wrong.copy(report->wrong, sizeof report->wrong - 1);
  _exit(kDone);
}

/// Waits for the child to end, which closes the pipe. Returns false if the child had to be killed.
bool WaitFor(pid_t child, int pipe, const calls::Record& record, unsigned seconds, int* status) {
  CallClock clock(seconds);
  struct pollfd end = {pipe, POLLIN, 0};
  while (waitpid(child, status, WNOHANG) == 0) {
    // Polls with a timeout, because a process left behind by a driver may keep the pipe open.
    const int ended = poll(&end, 1, static_cast<int>(clock.nap().count()));
    if (ended > 0) {
      waitpid(child, status, 0);
      break;
    }
    if (ended < 0 || !clock.IsOverdue(record)) continue;
    kill(child, SIGKILL);
    waitpid(child, status, 0);
    return false;
  }
  return true;
}

/// Returns, for example, "an OpenCL driver (NAME) crashes in CALL (SIGNAL)".
std::string DescribeFailure(const calls::Record& record, const std::string& deed,
                            const std::string& how) {
  char driver[128];
  calls::CopyDriver(record, &driver);
  const char* const call = record.call;
  const std::string name = driver;
  return "an OpenCL driver" + (name.empty() ? "" : " (" + name + ")") + " " + deed +
         (call ? std::string(" in ") + call : "") + (how.empty() ? "" : " (" + how + ")") +
         WhyPoclCrashes(name);
}

std::string EvaluateChild(int status, const Report& report) {
  if (WIFSIGNALED(status))
    return DescribeFailure(report.record, "crashes", strsignal(WTERMSIG(status)));
  if (WEXITSTATUS(status) == kDone) return report.wrong;
  return DescribeFailure(report.record, "ends the process", "");
}

}  // namespace

std::string Probe(const std::function<std::string()>& task, unsigned seconds) {
  const SharedReport report;
  int ends[2];
  if (!report || pipe2(ends, O_CLOEXEC) != 0) return "";
  const pid_t child = fork();
  if (child == 0) RunChild(task, report.operator->());
  close(ends[1]);
  int status = 0;
  const bool ended = child < 0 || WaitFor(child, ends[0], report->record, seconds, &status);
  close(ends[0]);
  if (child < 0) return "";
  if (ended) return EvaluateChild(status, *report.operator->());
  return DescribeFailure(report->record, "hangs",
                         "for " + std::to_string(seconds) + " s, STAGE_CL_TIMEOUT");
}

}  // namespace Stg::cl
