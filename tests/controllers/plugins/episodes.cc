// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller that loads the world file named by --args after half a second, as programs that
// learn in episodes do.

#include <string>

#include "stage.hh"

namespace {

std::string file;

int StartAgain(Stg::World* world, void*) {
  if (world->SimTimeNow() < 500000) return 0;
  world->Load(file);
  return 1;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* arguments) {
  file = arguments->cmdline;
  model->GetWorld()->AddUpdateCallback(StartAgain, nullptr);
  return 0;
}
