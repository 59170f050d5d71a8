// SPDX-License-Identifier: GPL-2.0-or-later
//
// A plug-in with two stamps, because one of its files was compiled with other headers.

#include <cstdint>

#include "stage.hh"

namespace {

struct Note {
  uint32_t name_size, stamp_size, type;
  char name[8], stamp[32];
};
__attribute__((section(".note.stage"), aligned(4), used))
const Note note = {6, 32, 1, "Stage", "4.9.0 0123456789abcdef"};

}  // namespace

extern "C" int Init(Stg::Model*, Stg::CtrlArgs*) { return 0; }
