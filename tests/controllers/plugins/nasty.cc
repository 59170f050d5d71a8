// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller for tests that disturbs the program that runs its process. Arguments: an action, and
// its time, "load" or "step". Does nothing unless the environment variable STAGE_NASTY is set.

#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>

#include "stage.hh"

namespace {

std::string deed;

void CloseFiles(int first, int last = 1023) {
  for (int file = first; file <= last; file++) close(file);
}

[[noreturn]] void SleepForEver() {
  for (;;) sleep(1);
}

/// Starts a child process that keeps all files open.
void StartChild() {
  if (fork() == 0) SleepForEver();
}

[[noreturn]] void Print(int file, const char* text) {
  for (;;) (void)!write(file, text, std::strlen(text));
}

[[noreturn]] void EatMemory() {
  constexpr size_t kMegabyte = 1 << 20;
  for (int megabytes = 0; megabytes < 400; megabytes++) {
    void* const memory = std::malloc(kMegabyte);
    if (memory) std::memset(memory, 1, kMegabyte);
    usleep(1000);
  }
  SleepForEver();
}

[[noreturn]] void Execute(const char* program, const char* argument) {
  execlp(program, program, argument, static_cast<char*>(nullptr));
  std::abort();
}

void IgnoreSignals() {
  for (int signal = 1; signal < 32; signal++) std::signal(signal, SIG_IGN);
}

void Do() {
  if (deed == "close_files_and_sleep") CloseFiles(0), SleepForEver();
  if (deed == "close_replies_and_sleep") CloseFiles(4, 4), SleepForEver();
  if (deed == "close_output_and_sleep") CloseFiles(0, 2), SleepForEver();
  if (deed == "close_files_and_go_on") CloseFiles(3);
  if (deed == "child_and_exit") StartChild(), _exit(3);
  if (deed == "child_and_sleep") StartChild(), SleepForEver();
  if (deed == "child_and_go_on") StartChild();
  if (deed == "child_eats_memory") {
    if (fork() == 0) EatMemory();
    SleepForEver();
  }
  if (deed == "ignore_signals") IgnoreSignals(), SleepForEver();
  if (deed == "stop") std::raise(SIGSTOP), SleepForEver();
  if (deed == "eat_memory") EatMemory();
  if (deed == "print_without_end") Print(1, "nothing but words\n");
  if (deed == "print_without_line_ends") Print(2, "x");
  if (deed == "reply_without_end") Print(4, "done 7\n");
  if (deed == "reply_without_line_ends") Print(4, "done");
  if (deed == "exit") std::exit(0);
  if (deed == "abort") std::signal(SIGABRT, SIG_DFL), std::abort();
  if (deed == "kill") std::raise(SIGKILL);
  if (deed == "become_sleep") Execute("sleep", "1000");
  if (deed == "become_true") Execute("true", nullptr);
  if (deed == "become_yes") Execute("yes", nullptr);
  for (volatile bool spins = deed == "spin"; spins;) {
  }
  if (deed == "sleep") SleepForEver();
}

int DoAtAStep(Stg::World*, void*) {
  Do();
  return 0;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* arguments) {
  std::istringstream words(arguments->worldfile);
  std::string name, when;
  words >> name >> deed >> when;
  if (!std::getenv("STAGE_NASTY")) return 0;
  if (when == "load") Do();
  if (when == "step") model->GetWorld()->AddUpdateCallback(DoAtAStep, nullptr);
  return 0;
}
