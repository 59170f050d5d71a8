// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/first_hits.hh"

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

/// Fewer rays are walked faster one by one.
constexpr uint32_t kFewestForWide = 4;

}  // namespace

void FirstHits::Look(const Direction* directions, const uint32_t* lists, uint32_t per_ray,
                     uint32_t count) {
  for (uint32_t i = 0; i < count; i++) {
    hits_[i] = lists[size_t{i} * per_ray];
    if (HitsNothing(i)) {
      SetNoPassage(i);
      continue;
    }
    const Step step = StepTo(directions[i]);
    SetPassage(i, step);
    Locate(i, step);
    grid_.PrefetchCell(cells_[i]);
  }
  FindMiddles(count);
  PrefetchBodies(count);
}

void FirstHits::Walk(const Direction* directions, const ray_grid_t& view,
                     const ray_window_t& window, uint32_t count) {
  static const WideWalk wide_walk = FindWidestWalk();
  if (wide_walk && count >= kFewestForWide)
    WalkSideBySide(wide_walk, {&view, &window, &fan_.record, directions, count});
  else
    WalkOneByOne(directions, view, window, count);
  FindMiddles(count);
  PrefetchBodies(count);
}

void FirstHits::WalkSideBySide(WideWalk walk, const WideRays& rays) {
  WideHits found;
  walk(rays, &found);
  for (uint32_t i = 0; i < rays.count; i++) {
    hits_[i] = static_cast<uint32_t>(found.hits[i]);
    if (HitsNothing(i)) {
      SetNoPassage(i);
      continue;
    }
    const FanRecord& r = fan_.record;
    const Step step{static_cast<int>(found.dx[i]), static_cast<int>(found.dy[i])};
    SetPassage(i, step);
    const int u = ray_packed_u(hits_[i]), v = ray_packed_v(hits_[i]);
    const uint32_t bit =
        grid::Grid::BitOf(step.dx < 0 ? r.x - u : r.x + u, step.dy < 0 ? r.y - v : r.y + v);
    const auto tile = static_cast<uint64_t>(found.tiles[i]);
    cells_[i] = grid_.CellAt(static_cast<uint32_t>(tile / grid::kTilesPerRegion),
                             static_cast<uint32_t>(tile % grid::kTilesPerRegion), bit);
    grid_.PrefetchCell(cells_[i]);
  }
}

void FirstHits::WalkOneByOne(const Direction* directions, const ray_grid_t& view,
                             const ray_window_t& window, uint32_t count) {
  const FanRecord& r = fan_.record;
  for (uint32_t i = 0; i < count; i++) {
    const Step step = StepTo(directions[i]);
    ray_t ray;
    ray_begin(&ray, &view, r.x, r.y, fraction_x_, fraction_y_, step.dx, step.dy);
    const bool found = ray_next(&view, &window, &ray);
    hits_[i] = found ? ray_pack(ray.u, ray.v) : RAY_NO_HIT;
    if (!found) {
      SetNoPassage(i);
      continue;
    }
    SetPassage(i, step);
    cells_[i] = grid_.CellAt(ray.region, ray.tile, ray.bit);
    grid_.PrefetchCell(cells_[i]);
  }
}

FirstHits::Step FirstHits::StepTo(const Direction& d) const {
  const FanRecord& r = fan_.record;
  return {ray_rotate_x(r.cosine, r.sine, d.cosine, d.sine),
          ray_rotate_y(r.cosine, r.sine, d.cosine, d.sine)};
}

/// How the ray passes the cell of its hit: as ray_begin() has it.
void FirstHits::SetPassage(uint32_t i, Step step) {
  const auto [dx, dy] = step;
  const int u = ray_packed_u(hits_[i]), v = ray_packed_v(hits_[i]);
  in_x_[i] = (u << 16) - (dx < 0 ? 65536 - fraction_x_ : fraction_x_);
  in_y_[i] = (v << 16) - (dy < 0 ? 65536 - fraction_y_ : fraction_y_);
  across_[i] = dx == 0 ? kNearlyNothing : std::abs(dx);
  along_[i] = dy == 0 ? kNearlyNothing : std::abs(dy);
}

/// Something to reckon with.
void FirstHits::SetNoPassage(uint32_t i) {
  in_x_[i] = in_y_[i] = 0;
  across_[i] = along_[i] = 1;
}

void FirstHits::Locate(uint32_t i, Step step) {
  const FanRecord& r = fan_.record;
  const int u = ray_packed_u(hits_[i]), v = ray_packed_v(hits_[i]);
  cells_[i] = CellAt(step.dx < 0 ? r.x - u : r.x + u, step.dy < 0 ? r.y - v : r.y + v);
}

void FirstHits::PrefetchBodies(uint32_t count) const {
  for (uint32_t i = 0; i < count; i++)
    if (!HitsNothing(i)) grid_.PrefetchBodyIn(cells_[i]);
}

/// Neighbouring rays mostly hit the same tile.
grid::CellRef FirstHits::CellAt(int32_t x, int32_t y) {
  const int32_t tile_x = x >> RAY_TILE_SHIFT, tile_y = y >> RAY_TILE_SHIFT;
  if (slot_ == 0 || tile_x != tile_x_ || tile_y != tile_y_) {
    tile_x_ = tile_x;
    tile_y_ = tile_y;
    slot_ = grid_.FindTileSlot(x, y);
  }
  return slot_ << 6 | grid::Grid::BitOf(x, y);
}

void FirstHits::FindMiddles(uint32_t count) {
  if (count % 2 == 1) SetNoPassage(count);
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
