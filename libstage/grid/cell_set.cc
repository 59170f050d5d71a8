// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/cell_set.hh"

#include <algorithm>
#include <bit>

#include "messages/assert.hh"

namespace Stg::internal::grid {

std::size_t CountCells(std::span<const CellSet> sets) {
  std::size_t count = 0;
  for (const CellSet& set : sets) count += static_cast<std::size_t>(std::popcount(set.cells));
  return count;
}

bool AreSorted(std::span<const CellSet> sets) {
  for (std::size_t i = 1; i < sets.size(); i++)
    if (!sets[i - 1].ComesBefore(sets[i])) return false;
  return true;
}

void CellSetBuilder::Finish() {
  AppendLast();
  const auto begin = sets_.begin() + static_cast<std::ptrdiff_t>(first_);
  if (begin == sets_.end()) return;
  std::sort(begin, sets_.end(),
            [](const CellSet& a, const CellSet& b) { return a.ComesBefore(b); });
  auto last = begin;
  for (auto set = begin + 1; set != sets_.end(); ++set) {
    if (!set->SameTile(*last)) {
      *++last = *set;
      continue;
    }
    last->cells |= set->cells;
    last->edges |= set->edges;
  }
  sets_.erase(last + 1, sets_.end());
  STAGE_ASSERT(AreSorted(std::span(sets_).subspan(first_)));
}

}  // namespace Stg::internal::grid
