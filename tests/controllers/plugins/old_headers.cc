// SPDX-License-Identifier: GPL-2.0-or-later
//
// A plug-in that carries no stamp, like one built with older headers: it does not include
// <stage.hh>. It leaves a file if any of its code runs.

#include <fstream>

namespace {

struct WhenOpened {
  WhenOpened() { std::ofstream("opened") << "\n"; }
} when_opened;

}  // namespace

extern "C" int Init(void*, void*) { return 0; }
