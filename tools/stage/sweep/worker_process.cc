// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/worker_process.hh"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "messages/report.hh"
#include "stage/interrupt.hh"
#include "stage/parse_number.hh"
#include "stage/process.hh"
#include "stage/sweep/worker.hh"

namespace Stg::program {

namespace {

constexpr size_t kMaxPrinted = 4096;  // bytes of output that are kept
constexpr size_t kMaxLines = 10;      // lines of these in a record
constexpr size_t kMaxRead = 1 << 18;  // maximum bytes per read, since output may never end
constexpr double kExitGrace = 0.5;    // seconds that a worker may outlive its answers
constexpr double kKillTimeout = 5;    // seconds to wait for a killed process

struct Pipe {
  int from = -1, to = -1;

  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
      throw std::runtime_error(std::string("can't make a pipe: ") + std::strerror(errno));
    from = ends[0];
    to = ends[1];
  }
};

/// Duplicates a descriptor above the ones that dup2() will overwrite.
int DuplicateAbove(int file) { return fcntl(file, F_DUPFD_CLOEXEC, 10); }

/// Runs in the child process. Only async-signal-safe calls are allowed after a fork.
[[noreturn]] void ExecWorker(char* const words[], pid_t parent, int commands, int answers,
                             int output) {
#ifdef __linux__
  // Workers die with a coordinator that is killed.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  if (getppid() != parent) _exit(1);
  setpgid(0, 0);  // Ctrl-C reaches only the coordinator, and the group can be killed as a whole
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int high[] = {DuplicateAbove(commands), DuplicateAbove(answers), DuplicateAbove(output)};
  dup2(nothing, STDIN_FILENO);
  dup2(high[2], STDOUT_FILENO);
  dup2(high[2], STDERR_FILENO);
  dup2(high[0], kCommandsFile);
  dup2(high[1], kAnswersFile);
  execvp(words[0], words);
  const char* const error = std::strerror(errno);
  for (const char* const part : {"can't run '", static_cast<const char*>(words[0]), "': ", error})
    (void)!write(STDERR_FILENO, part, std::strlen(part));
  _exit(127);
}

/// Proportional set size (PSS) of a process: shared pages count in part.
double ProportionalMemoryMb(pid_t pid) {
  const std::string file = "/proc/" + std::to_string(pid) + "/smaps_rollup";
  return std::atof(FromProc(file.c_str(), "Pss:").c_str()) / 1024;  // /proc counts in KiB
}

}  // namespace

WorkerProcess::WorkerProcess(const std::vector<std::string>& command, const std::string& folder)
    : reader_(-1) {
  std::vector<std::string> words = command;
  words.push_back(folder);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const Pipe commands, answers, output;
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) ExecWorker(pointers.data(), parent, commands.from, answers.to, output.to);
  for (const int file : {commands.from, answers.to, output.to}) close(file);
  commands_ = commands.to;
  answers_ = answers.from;
  output_ = output.from;
  if (pid_ < 0)
    throw std::runtime_error(std::string("can't start a worker: ") + std::strerror(errno));
  setpgid(pid_, pid_);  // also done by the child, because either may run first
  for (const int file : {commands_, answers_, output_}) fcntl(file, F_SETFL, O_NONBLOCK);
  reader_ = LineReader(answers_);
}

WorkerProcess::~WorkerProcess() {
  Reap();
  for (const int file : {commands_, answers_, output_}) close(file);
}

void WorkerProcess::Order(const std::string& command) {
  const auto action = std::signal(SIGPIPE, SIG_IGN);
  WriteWhole(commands_, command + "\n");
  std::signal(SIGPIPE, action);
}

std::optional<std::string> WorkerProcess::Answer() {
  if (killed_at_ > 0) return std::nullopt;
  if (answers_ended_at_ == 0 && !reader_.ReadAvailable()) answers_ended_at_ = WallClock();
  return reader_.NextBuffered();
}

bool WorkerProcess::IsDead() const {
  siginfo_t info = {};
  return pid_ < 0 ||
         (waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
          info.si_pid != 0);
}

bool WorkerProcess::HasEnded() {
  // A process started by a controller may keep the pipes open, so only the worker's own death
  // counts.
  if (IsDead()) return true;
  if (reader_.is_full()) Kill("replied with an overlong line");
  if (answers_ended_at_ > 0 && WallClock() - answers_ended_at_ > kExitGrace)
    Kill("closed the file that its replies go to");
  return killed_at_ > 0 && WallClock() - killed_at_ > kKillTimeout;
}

void WorkerProcess::ReadOutput() {
  char bytes[4096];
  for (size_t taken = 0; taken < kMaxRead;) {
    const ssize_t count = read(output_, bytes, sizeof bytes);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      output_ended_ = output_ended_ || count == 0;
      return;
    }
    taken += static_cast<size_t>(count);
    printed_.append(bytes, static_cast<size_t>(count));
    if (printed_.size() > 2 * kMaxPrinted) printed_.erase(0, printed_.size() - kMaxPrinted);
  }
}

/// Kills the group before waiting for its leader, whose id is not reused until then. A process that
/// cannot be killed, for example while it waits for a broken disk, is left behind.
void WorkerProcess::Reap() {
  if (pid_ < 0) return;
  const double start = WallClock();
  kill(-pid_, SIGKILL);
  while (!IsDead() && WallClock() - start < kKillTimeout) usleep(1000);
  waitpid(pid_, &wait_status_, WNOHANG);
  pid_ = -1;
}

WorkerExit WorkerProcess::CollectExit() {
  Reap();
  ReadOutput();
  WorkerExit worker_exit;
  worker_exit.wait_status = wait_status_;
  worker_exit.reason = reason_;
  for (size_t begin = 0; begin < printed_.size();) {
    const size_t end = std::min(printed_.find('\n', begin), printed_.size());
    if (end > begin)
      worker_exit.lines.push_back(
          messages::Shortened(printed_.substr(begin, end - begin), messages::kMaxDetailBytes));
    begin = end + 1;
  }
  if (worker_exit.lines.size() > kMaxLines)
    worker_exit.lines.erase(worker_exit.lines.begin(), worker_exit.lines.end() - kMaxLines);
  return worker_exit;
}

void WorkerProcess::Kill(const std::string& reason) {
  if (reason_.empty()) reason_ = reason;
  if (killed_at_ == 0) killed_at_ = WallClock();
  if (pid_ > 0) kill(-pid_, SIGKILL);
}

double WorkerProcess::MemoryMb() const {
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  double pages = 0, resident = 0;
  statm >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

std::map<pid_t, double> MemoryOfGroups(const std::set<pid_t>& groups) {
  std::map<pid_t, std::vector<pid_t>> members;
  std::error_code failed;
  std::filesystem::directory_iterator entry("/proc", failed);
  for (; !failed && entry != std::filesystem::directory_iterator(); entry.increment(failed)) {
    const auto pid = ParseNumber<pid_t>(entry->path().filename().string());
    const pid_t group = pid && *pid > 0 ? getpgid(*pid) : -1;
    if (groups.count(group) > 0) members[group].push_back(*pid);
  }
  std::map<pid_t, double> memory;
  for (const auto& [group, pids] : members)
    for (const pid_t pid : pids)
      if (pids.size() > 1) memory[group] += ProportionalMemoryMb(pid);
  return memory;
}

}  // namespace Stg::program
