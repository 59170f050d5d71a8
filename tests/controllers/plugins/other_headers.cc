// SPDX-License-Identifier: GPL-2.0-or-later
//
// A plug-in that carries the stamp of another version. It leaves a file if any of its code runs.

#include <fstream>

#include "tests/controllers/plugins/other_stamp.hh"

namespace {

struct WhenOpened {
  WhenOpened() { std::ofstream("opened") << "\n"; }
} when_opened;

}  // namespace

extern "C" int Init(void*, void*) { return 0; }
