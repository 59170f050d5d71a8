// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller for tests that ends its process or hangs, depending on its first argument.

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

#include "stage.hh"

namespace {

std::string what;

int Fail(Stg::World*, void*) {
  if (what == "crash") {
    std::puts("about to crash");
    std::fflush(stdout);
    std::signal(SIGSEGV, SIG_DFL);  // sanitizers would report it
    std::raise(SIGSEGV);
  }
  if (what == "exit") std::exit(7);
  while (what == "hang") sleep(1);
  return 0;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* arguments) {
  std::istringstream words(arguments->worldfile);
  words >> what >> what;
  model->GetWorld()->AddUpdateCallback(Fail, nullptr);
  return 0;
}
