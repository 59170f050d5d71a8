// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller that leaves a mark, to show that code named by a world file has run.

#include <fstream>

#include "stage.hh"

namespace {

struct WhenOpened {
  WhenOpened() { std::ofstream("opened") << "\n"; }
} when_opened;

}  // namespace

extern "C" int Init(Stg::Model*, Stg::CtrlArgs*) {
  std::ofstream("initialised") << "\n";
  return 0;
}
