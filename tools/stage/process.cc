// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/process.hh"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace Stg::program {

namespace {

double Megabytes(const char* key) {
  return std::atof(FromProc("/proc/self/status", key).c_str()) / 1024;  // /proc counts in KiB
}

/// Requires errno to be 0 before the last output. The reason of an earlier failure is unknown.
void CheckOutput() {
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && std::ferror(stdout) == 0) return;
  const std::string reason = errno != 0 ? std::string(": ") + std::strerror(errno) : "";
  throw std::runtime_error("can't write to standard output" + reason);
}

}  // namespace

std::string FromProc(const char* file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(key)) continue;
    const size_t value = line.find_first_not_of(" \t", line.find(':') + 1);
    return value == std::string::npos ? "" : line.substr(value);
  }
  return "";
}

double PeakMemoryMb() {
  // getrusage() may report the peak of the parent process.
  const double peak = Megabytes("VmHWM:");
  if (peak > 0) return peak;
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

double MemoryMb() { return Megabytes("VmRSS:"); }

void ReserveStandardStreams() {
  // Opened in the wrong direction, so that writing to standard output still fails.
  for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(file, F_GETFD) < 0) open("/dev/null", file == STDOUT_FILENO ? O_RDONLY : O_WRONLY);
}

void PrintWhole(const std::string& text) {
  errno = 0;
  std::fputs(text.c_str(), stdout);
  CheckOutput();
}

void FlushOutput() {
  errno = 0;
  CheckOutput();
}

OutputToError::OutputToError() : saved_(-1) {
  std::fflush(stdout);
  saved_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  if (saved_ >= 0) dup2(STDERR_FILENO, STDOUT_FILENO);
}

OutputToError::~OutputToError() {
  std::fflush(stdout);
  std::clearerr(stdout);  // clears errors of writing to standard error
  if (saved_ < 0) return;
  dup2(saved_, STDOUT_FILENO);
  close(saved_);
}

}  // namespace Stg::program
