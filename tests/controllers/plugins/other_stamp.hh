// SPDX-License-Identifier: GPL-2.0-or-later
//
// The stamp that the headers of another version put into each plug-in.

#ifndef STAGE_TESTS_CONTROLLERS_PLUGINS_OTHER_STAMP_HH
#define STAGE_TESTS_CONTROLLERS_PLUGINS_OTHER_STAMP_HH

#include <cstdint>

namespace {

struct Note {
  uint32_t name_size, stamp_size, type;
  char name[8], stamp[32];
};
__attribute__((section(".note.stage"), aligned(4), used))
const Note note = {6, 32, 1, "Stage", "4.9.0 0123456789abcdef"};

}  // namespace

#endif
