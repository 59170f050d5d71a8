// SPDX-License-Identifier: GPL-2.0-or-later
//
// A backend of another version: anything may follow the version.

#include <cstdint>

extern "C" {
extern const uint32_t stage_backend;
alignas(8) const uint32_t stage_backend = 4711;
}
