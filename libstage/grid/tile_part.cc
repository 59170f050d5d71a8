// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/tile_part.hh"

#include <algorithm>
#include <bit>

#include "messages/assert.hh"

namespace Stg::internal::grid {

std::size_t CountCells(std::span<const TilePart> parts) {
  std::size_t count = 0;
  for (const TilePart& part : parts) count += static_cast<std::size_t>(std::popcount(part.cells));
  return count;
}

bool AreSorted(std::span<const TilePart> parts) {
  for (std::size_t i = 1; i < parts.size(); i++)
    if (!parts[i - 1].ComesBefore(parts[i])) return false;
  return true;
}

void PartsMaker::Finish() {
  AppendLast();
  const auto begin = parts_.begin() + static_cast<std::ptrdiff_t>(first_);
  if (begin == parts_.end()) return;
  std::sort(begin, parts_.end(),
            [](const TilePart& a, const TilePart& b) { return a.ComesBefore(b); });
  auto last = begin;
  for (auto part = begin + 1; part != parts_.end(); ++part) {
    if (!part->SameTile(*last)) {
      *++last = *part;
      continue;
    }
    last->cells |= part->cells;
    last->edges |= part->edges;
  }
  parts_.erase(last + 1, parts_.end());
  STAGE_ASSERT(AreSorted(std::span(parts_).subspan(first_)));
}

}  // namespace Stg::internal::grid
