// SPDX-License-Identifier: GPL-2.0-or-later
//
// The sizes of work-groups that step worlds. A group has a few worlds and some work-items for each.

#ifndef STAGE_LIBSTAGE_CL_ROW_GROUPS_HH
#define STAGE_LIBSTAGE_CL_ROW_GROUPS_HH

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "rows/row_backend.hh"

namespace Stg::cl {

struct RowGroups {
  unsigned items;   ///< of a world
  unsigned worlds;  ///< of a group
};

/// Work-items of a group on a GPU: those that it runs in step, so that they never wait for others.
inline constexpr unsigned kItemsOfGroup = 32;

/// Groups of at most `most` work-items. `wanted`: items of a world, unless the buffers have a
/// number; 0: those that suit a GPU. In many phases, only a work-item for each mover has work, so
/// many worlds are faster if they share the items of a group. Few worlds are faster with all items
/// for each.
inline RowGroups ChooseRowGroups(const rows::RowBuffers& buffers, unsigned wanted, size_t most) {
  constexpr size_t kFewWorlds = 2048;
  const auto movers = static_cast<unsigned>(std::min<size_t>(buffers.movers, kItemsOfGroup));
  const unsigned suitable =
      buffers.worlds <= kFewWorlds ? kItemsOfGroup : std::max(8u, std::bit_ceil(movers));
  if (buffers.work_items > 0) wanted = buffers.work_items;
  const unsigned items = std::min<unsigned>(wanted > 0 ? wanted : suitable,
                                            static_cast<unsigned>(std::min<size_t>(most, 1024)));
  const size_t worlds = std::min<size_t>(kItemsOfGroup, most) / items;
  return {items, static_cast<unsigned>(std::max<size_t>(worlds, 1))};
}

/// Calls f(first, groups, worlds) for launches that step this many worlds: the number of the
/// launch's first world, its groups, and the worlds of a group.
template <typename F>
void ForEachRowLaunch(size_t worlds, const RowGroups& groups, F f) {
  const size_t full = worlds / groups.worlds, rest = worlds % groups.worlds;
  if (full > 0) f(0u, full, groups.worlds);
  if (rest > 0) f(static_cast<uint32_t>(worlds - rest), size_t{1}, static_cast<unsigned>(rest));
}

}  // namespace Stg::cl

#endif
