// SPDX-License-Identifier: GPL-2.0-or-later
//
// A plug-in that carries the stamp of another version. It leaves a file if any of its code runs.

#include <cstdint>
#include <fstream>

namespace {

struct Note {
  uint32_t name_size, stamp_size, type;
  char name[8], stamp[32];
};
__attribute__((section(".note.stage"), aligned(4), used))
const Note note = {6, 32, 1, "Stage", "4.9.0 0123456789abcdef"};

struct WhenOpened {
  WhenOpened() { std::ofstream("opened") << "\n"; }
} when_opened;

}  // namespace

extern "C" int Init(void*, void*) { return 0; }
