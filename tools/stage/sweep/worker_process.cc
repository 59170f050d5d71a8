// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/worker_process.hh"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "messages/report.hh"
#include "stage/sweep/worker.hh"

namespace Stg::program {

namespace {

constexpr size_t kMostPrinted = 4096;  // bytes that are kept
constexpr size_t kMostLines = 10;      // of these, in a record

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

/// The descriptors lie above those that they are to become, so that none is overwritten too early.
int Above(int file) { return fcntl(file, F_DUPFD_CLOEXEC, 10); }

/// In the new process. Only what is allowed after a fork.
[[noreturn]] void Become(char* const words[], pid_t parent, int commands, int answers, int output) {
  // A coordinator that is killed takes its workers with it.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  setpgid(0, 0);  // Ctrl-C is the coordinator's to hear
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int high[] = {Above(commands), Above(answers), Above(output)};
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
  if (pid_ == 0) Become(pointers.data(), parent, commands.from, answers.to, output.to);
  for (const int file : {commands.from, answers.to, output.to}) close(file);
  commands_ = commands.to;
  answers_ = answers.from;
  output_ = output.from;
  if (pid_ < 0)
    throw std::runtime_error(std::string("can't start a worker: ") + std::strerror(errno));
  for (const int file : {answers_, output_}) fcntl(file, F_SETFL, O_NONBLOCK);
  reader_ = LineReader(answers_);
}

WorkerProcess::~WorkerProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (const int file : {commands_, answers_, output_}) close(file);
}

/// To a worker that is gone, too: then its answers end.
void WorkerProcess::Order(const std::string& command) {
  const auto action = std::signal(SIGPIPE, SIG_IGN);
  WriteWhole(commands_, command + "\n");
  std::signal(SIGPIPE, action);
}

std::optional<std::string> WorkerProcess::Answer() {
  if (!reader_.Fill()) silent_ = true;
  return reader_.Take();
}

bool WorkerProcess::HasEnded() {
  if (silent_) return true;
  // What a controller has started may hold its end of the pipe open.
  siginfo_t info = {};
  return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid != 0;
}

bool WorkerProcess::ReadOutput() {
  char bytes[4096];
  for (;;) {
    const ssize_t count = read(output_, bytes, sizeof bytes);
    if (count <= 0) return count < 0 && (errno == EAGAIN || errno == EINTR);
    printed_.append(bytes, static_cast<size_t>(count));
    if (printed_.size() > 2 * kMostPrinted) printed_.erase(0, printed_.size() - kMostPrinted);
  }
}

Death WorkerProcess::Bury() {
  Death death;
  while (waitpid(pid_, &death.wait_status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  ReadOutput();
  death.reason = reason_;
  for (size_t begin = 0; begin < printed_.size();) {
    const size_t end = std::min(printed_.find('\n', begin), printed_.size());
    if (end > begin)
      death.lines.push_back(
          messages::Shortened(printed_.substr(begin, end - begin), messages::kLongestDetail));
    begin = end + 1;
  }
  if (death.lines.size() > kMostLines)
    death.lines.erase(death.lines.begin(), death.lines.end() - kMostLines);
  return death;
}

void WorkerProcess::Kill(const std::string& reason) {
  reason_ = reason;
  if (pid_ > 0) kill(pid_, SIGKILL);
}

double WorkerProcess::MemoryMb() const {
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  double pages = 0, resident = 0;
  statm >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

}  // namespace Stg::program
