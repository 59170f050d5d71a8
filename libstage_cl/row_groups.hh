// SPDX-License-Identifier: GPL-2.0-or-later
//
// The sizes of work-groups that step worlds. A group has a few worlds and some work-items for each.

#ifndef STAGE_LIBSTAGE_CL_ROW_GROUPS_HH
#define STAGE_LIBSTAGE_CL_ROW_GROUPS_HH

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "libstage_cl/row_kernels.hh"
#include "rows/row_backend.hh"

namespace Stg::cl {

struct RowGroups {
  unsigned items;   ///< of a world
  unsigned worlds;  ///< of a group
};

/// Work-items of a group on a GPU: those that it runs in step, so that they never wait for others.
inline constexpr unsigned kItemsOfGroup = 32;

struct RowLimits {
  unsigned wanted_items = 0;       ///< of a world; 0: those that suit a GPU
  size_t most_items = SIZE_MAX;    ///< of a group that steps worlds
  size_t entry_items = 128;        ///< of a group of a kernel of entries
  size_t island_items = SIZE_MAX;  ///< of a group that solves islands, at most
  unsigned processors = 1;         ///< compute units of the GPU
};

/// Takes what a kernel needs into account.
inline void LowerLimits(RowItem item, size_t most_items, RowLimits* limits) {
  size_t& limit = item == RowItem::kPartOfWorld ? limits->most_items
                  : item == RowItem::kEntry     ? limits->entry_items
                                                : limits->island_items;
  limit = std::min(limit, most_items);
}

/// The groups for these buffers. In many phases, only a work-item for each mover has work, so
/// worlds that share the items of a group are faster, as long as their work-items keep the GPU
/// busy. With many rays, worlds of their own groups are faster, because each world takes other
/// branches.
inline RowGroups ChooseRowGroups(const rows::RowBuffers& buffers, const RowLimits& limits) {
  constexpr size_t kBusyItems = 256;  // of a processor
  constexpr size_t kRaysOfItem = 16;
  const size_t most = std::min<size_t>(kItemsOfGroup, limits.most_items);
  const size_t wanted = buffers.work_items > 0 ? buffers.work_items : limits.wanted_items;
  const size_t suitable = std::bit_ceil(
      std::max({size_t{4}, buffers.movers, buffers.rays / kRaysOfItem,
                kBusyItems * limits.processors / std::max<size_t>(1, buffers.worlds)}));
  const auto items = static_cast<unsigned>(wanted > 0 ? std::min(wanted, limits.most_items)
                                                      : std::min(suitable, most));
  return {items, static_cast<unsigned>(std::max<size_t>(most / items, 1))};
}

/// The groups that solve the islands of all worlds, one of each work-item after the other. More
/// than a GPU runs at a time would only wait.
struct IslandGroups {
  size_t groups;
  unsigned items;  ///< of a group
};

inline IslandGroups ChooseIslandGroups(const rows::RowBuffers& buffers, const RowGroups& of_worlds,
                                       const RowLimits& limits) {
  constexpr size_t kGroupsOfProcessor = 16;
  const bool is_alone = of_worlds.items * of_worlds.worlds == 1;  // a CPU
  const size_t items = is_alone ? 1 : std::min<size_t>(kItemsOfGroup, limits.island_items);
  const size_t islands = std::max<size_t>(1, buffers.worlds * buffers.movers);
  return {std::min((islands + items - 1) / items, kGroupsOfProcessor * limits.processors),
          static_cast<unsigned>(items)};
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
