// SPDX-License-Identifier: GPL-2.0-or-later
//
// A backend of some other version: behind its version there may be anything.

#include <cstdint>

extern "C" {
extern const uint32_t stage_backend;
alignas(8) const uint32_t stage_backend = 4711;
}
