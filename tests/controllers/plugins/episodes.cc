// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller that loads another world after half a second, like learning in episodes: the file
// named by --args.

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
