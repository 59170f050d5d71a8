// SPDX-License-Identifier: GPL-2.0-or-later
//
// The stamp of these headers. Each plug-in that includes <stage.hh> carries it, so that a plug-in
// built with other headers is refused when it is loaded; it would crash, because classes differ.
//
// The stamp is an ELF note of the name "Stage" in the section .note.stage: it can be read before
// the plug-in runs any code, and no option that hides symbols removes it.
//
// Part of <stage.hh>; C++11.

#ifndef STAGE_WORLD_PLUGIN_STAMP_HH
#define STAGE_WORLD_PLUGIN_STAMP_HH

#include <stdint.h>

/// The version of Stage, and a checksum of the code of all headers that <stage.hh> includes. The
/// test tests/rules/plugin_stamp_test.py fails if it is out of date, and can update it.
#define STAGE_PLUGIN_STAMP "5.0.0 81851394b0f6960e"

namespace Stg {

/// An ELF note whose type is 1.
struct PluginNote {
  uint32_t name_size, stamp_size, type;
  char name[8], stamp[32];
};

#if defined(__ELF__) && (defined(__GNUC__) || defined(__clang__))
__attribute__((section(".note.stage"), aligned(4), used)) static const PluginNote plugin_note = {
    6, 32, 1, "Stage", STAGE_PLUGIN_STAMP};
#endif

}  // namespace Stg

#endif
