// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/first_listed.hh"

#include <cstdlib>

namespace Stg::internal::sensing {

namespace {

/// Two numbers that the processor handles at once: what x86-64 and AArch64 all have.
typedef double Pair __attribute__((vector_size(16)));

Pair Larger(Pair a, Pair b) { return a > b ? a : b; }
Pair Smaller(Pair a, Pair b) { return a < b ? a : b; }

/// To divide by instead of 0 on an axis along which the ray doesn't go. There the start lies within
/// the cell, so that the border behind it comes out far back, and the one ahead far on.
constexpr double kNearlyNothing = 1e-290;

}  // namespace

void FirstListed::Look(const Direction* directions, const uint32_t* lists, uint32_t per_ray,
                       uint32_t count) {
  for (uint32_t i = 0; i < count; i++) {
    const uint32_t hit = lists[size_t{i} * per_ray];
    listed_[i] = hit != RAY_NO_HIT;
    if (!listed_[i]) {
      SetPassage(i, 0, 0, 1, 1);
      continue;
    }
    Locate(i, directions[i], hit);
    grid_.PrefetchCell(cells_[i]);
  }
  if (count % 2 == 1) SetPassage(count, 0, 0, 1, 1);
  FindMiddles(count);
  for (uint32_t i = 0; i < count; i++)
    if (listed_[i]) grid_.PrefetchBodyIn(cells_[i]);
}

/// The cell, and how the ray passes it: as ray_begin() has it.
void FirstListed::Locate(uint32_t i, const Direction& d, uint32_t hit) {
  const FanRecord& r = fan_.record;
  const int dx = ray_rotate_x(r.cosine, r.sine, d.cosine, d.sine);
  const int dy = ray_rotate_y(r.cosine, r.sine, d.cosine, d.sine);
  const int u = ray_packed_u(hit), v = ray_packed_v(hit);
  SetPassage(i, (u << 16) - (dx < 0 ? 65536 - fraction_x_ : fraction_x_),
             (v << 16) - (dy < 0 ? 65536 - fraction_y_ : fraction_y_),
             dx == 0 ? kNearlyNothing : std::abs(dx), dy == 0 ? kNearlyNothing : std::abs(dy));
  cells_[i] = CellAt(dx < 0 ? r.x - u : r.x + u, dy < 0 ? r.y - v : r.y + v);
}

/// Neighbouring rays mostly hit the same tile.
grid::CellRef FirstListed::CellAt(int32_t x, int32_t y) {
  const int32_t tile_x = x >> RAY_TILE_SHIFT, tile_y = y >> RAY_TILE_SHIFT;
  if (slot_ == 0 || tile_x != tile_x_ || tile_y != tile_y_) {
    tile_x_ = tile_x;
    tile_y_ = tile_y;
    slot_ = grid_.FindTileSlot(x, y);
  }
  return slot_ << 6 | grid::Grid::BitOf(x, y);
}

void FirstListed::SetPassage(uint32_t i, double in_x, double in_y, double across, double along) {
  in_x_[i] = in_x;
  in_y_[i] = in_y;
  across_[i] = across;
  along_[i] = along;
}

void FirstListed::FindMiddles(uint32_t count) {
  for (uint32_t i = 0; i < count; i += 2) {
    const auto pair = [i](double* numbers) -> Pair& {
      return *static_cast<Pair*>(static_cast<void*>(numbers + i));
    };
    const Pair in_x = pair(in_x_), in_y = pair(in_y_), across = pair(across_), along = pair(along_);
    const Pair in = Larger(Larger(in_x / across, in_y / along), Pair{0, 0});
    const Pair out_x = (in_x + 65536.0) / across, out_y = (in_y + 65536.0) / along;
    const Pair out = Smaller(Smaller(out_x, out_y), Pair{1, 1});
    pair(middle_) = 0.5 * (in + out);
  }
}

}  // namespace Stg::internal::sensing
