// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/first_hits.hh"

#include <algorithm>
#include <cstdlib>

#include "messages/assert.hh"
#include "sensing/free_box.hh"
#include "sensing/middle.hh"

namespace Stg::internal::sensing {

namespace {

/// Moves a ray that starts in the box to where it leaves the box, with a leap of ray_next().
void LeaveBox(const grid::CellBox& box, ray_t* ray) {
  const int left = ray->x0 - box.min_x, right = box.max_x - ray->x0;
  const int below = ray->y0 - box.min_y, above = box.max_y - ray->y0;
  if ((left | right | below | above) < 0) return;
  const int to_x = (ray->sx < 0 ? left : right) + 1, to_y = (ray->sy < 0 ? below : above) + 1;
  if (ray_product((to_x << 16) - ray->ox, ray->ady) <
      ray_product((to_y << 16) - ray->oy, ray->adx)) {
    ray->v = ray_leap_end(to_x, ray->ox, ray->adx, ray->oy, ray->ady, ray->dy_per_dx, 0, 1);
    ray->u = to_x;
  } else {
    ray->u = ray_leap_end(to_y, ray->oy, ray->ady, ray->ox, ray->adx, ray->dx_per_dy, 0, 0);
    ray->v = to_y;
  }
}

}  // namespace

namespace {

/// True if the slices hold all rays of the group, and none is empty.
[[maybe_unused]] bool IsComplete(const RayGroup& rays) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < rays.slice_count; i++) {
    if (rays.slices[i].count == 0) return false;
    count += rays.slices[i].count;
  }
  return count == rays.count && count > 0 && count <= RayGroup::kMaxRays;
}

}  // namespace

void FirstHits::EvaluateDeviceHits(const RayGroup& rays, double* ranges) {
  STAGE_ASSERT(IsComplete(rays) && rays.words_per_ray >= 2);
  if (wide_walk_.evaluate && rays.count >= kMinForLanes) {
    wide_walk_.evaluate(rays, grid_.tables(), {hits_, lists_, ranges, ends_});
  } else {
    EvaluateOneByOne(rays);
    WriteRanges(rays, ranges);
    FindEnds(rays.count);
  }
  EndSlices(rays);
  PrefetchBodies(rays);
}

void FirstHits::Walk(const RayGroup& rays, double* ranges) {
  STAGE_ASSERT(IsComplete(rays));
  if (wide_walk_.walk && rays.count >= kMinForLanes) {
    wide_walk_.walk(rays, grid_.tables(), {hits_, lists_, ranges, ends_});
  } else {
    WalkOneByOne(rays);
    WriteRanges(rays, ranges);
    FindEnds(rays.count);
  }
  EndSlices(rays);
  PrefetchBodies(rays);
}

void FirstHits::WriteRanges(const RayGroup& rays, double* ranges) const {
  uint32_t ray = 0;
  for (uint32_t i = 0; i < rays.slice_count; i++)
    for (uint32_t k = 0; k < rays.slices[i].count; k++, ray++)
      ranges[ray] = (rays.exact ? 1.0 : middles_[ray]) * rays.slices[i].leg_length;
}

void FirstHits::EvaluateOneByOne(const RayGroup& rays) {
  uint32_t ray = 0;
  for (uint32_t slice = 0; slice < rays.slice_count; slice++) {
    CopyDeviceHits(rays.slices[slice], rays.words_per_ray, lists_ + ray, hits_ + ray);
    if (rays.exact) ClearBodies(rays.slices[slice].count, lists_ + ray);
    const auto& [fan, directions, count, leg_length, walked] = rays.slices[slice];
    for (uint32_t k = 0; k < count; k++, ray++) {
      if (HitsNothing(ray)) {
        SetNoPassage(ray);
        continue;
      }
      const Displacement way = DisplacementOf(*fan, directions[k]);
      SetPassage(ray, *fan, way);
      if (lists_[ray] != 0) continue;
      const int u = ray_packed_u(hits_[ray]), v = ray_packed_v(hits_[ray]);
      cells_[ray] =
          CellAt(way.x < 0 ? fan->x - u : fan->x + u, way.y < 0 ? fan->y - v : fan->y + v);
      grid_.PrefetchList(cells_[ray]);
    }
  }
  FindMiddles(rays.count);
  FindBodies(rays);
}

void FirstHits::WalkOneByOne(const RayGroup& rays) {
  const FreeBoxes boxes = FindFreeBoxesIfWorthwhile(rays);
  std::fill(lists_, lists_ + rays.count, 0);
  uint32_t i = 0;
  for (uint32_t slice = 0; slice < rays.slice_count; slice++) {
    const auto& [fan, directions, count, leg_length, walked] = rays.slices[slice];
    for (uint32_t k = 0; k < count; k++, i++) {
      const Displacement way = DisplacementOf(*fan, directions[k]);
      ray_t ray;
      BeginRay(*rays.grid, *fan, way, &ray);
      LeaveBox(boxes.towards[way.y < 0][way.x < 0], &ray);
      const bool found = ray_next(rays.grid, rays.mask, &ray);
      hits_[i] = found ? ray_pack(ray.u, ray.v) : RAY_NO_HIT;
      if (!found) {
        SetNoPassage(i);
        continue;
      }
      SetPassage(i, *fan, way);
      cells_[i] = grid_.CellAt(ray.region, ray.tile, ray.bit);
      grid_.PrefetchList(cells_[i]);
    }
  }
  FindMiddles(rays.count);
  FindBodies(rays);
}

/// Sets the passage of a ray through the cell of its hit, with ray_begin()'s offsets.
void FirstHits::SetPassage(uint32_t i, const FanRecord& fan, const Displacement& way) {
  const auto [dx, dy] = way;
  const int u = ray_packed_u(hits_[i]), v = ray_packed_v(hits_[i]);
  const int fraction_x = static_cast<int>(fan.fraction & 0xffff);
  const int fraction_y = static_cast<int>(fan.fraction >> 16);
  in_x_[i] = (u << 16) - (dx < 0 ? 65536 - fraction_x : fraction_x);
  in_y_[i] = (v << 16) - (dy < 0 ? 65536 - fraction_y : fraction_y);
  across_[i] = dx == 0 ? kTinyDisplacement : std::abs(dx);
  along_[i] = dy == 0 ? kTinyDisplacement : std::abs(dy);
}

/// Sentinel passage: FindMiddles() returns 1 (the end of the ray).
void FirstHits::SetNoPassage(uint32_t i) { in_x_[i] = in_y_[i] = across_[i] = along_[i] = 1; }

/// Looks up the body lists that the device did not supply (0). The cells have been prefetched.
void FirstHits::FindBodies(const RayGroup& rays) {
  for (uint32_t i = 0; i < rays.count; i++) {
    if (HitsNothing(i))
      lists_[i] = kNothing;
    else if (lists_[i] == 0)
      lists_[i] = rays.exact ? grid_.OutlinesIn(static_cast<uint32_t>(cells_[i] >> 6))
                             : grid_.ListIn(cells_[i]);
  }
}

void FirstHits::PrefetchBodies(const RayGroup& rays) const {
  STAGE_ASSERT(EndOfInterval(rays.count - 1) == rays.count);
  for (uint32_t i = 0; i < rays.count; i = EndOfInterval(i)) {
    if (lists_[i] == kNothing) continue;
    if (rays.exact)
      grid_.PrefetchOutline(lists_[i]);
    else
      grid_.PrefetchBody(lists_[i]);
  }
}

void FirstHits::FindEnds(uint32_t count) {
  std::fill(ends_, ends_ + WideHits::kEndWords, 0);
  for (uint32_t i = 0; i + 1 < count; i++)
    ends_[i / 64] |= uint64_t{lists_[i] != lists_[i + 1]} << i % 64;
}

void FirstHits::EndSlices(const RayGroup& rays) {
  uint32_t end = 0;
  for (uint32_t slice = 0; slice < rays.slice_count; slice++) {
    end += rays.slices[slice].count;
    ends_[(end - 1) / 64] |= uint64_t{1} << (end - 1) % 64;
  }
}

/// Caches the last tile, because neighbouring rays mostly hit the same one.
grid::CellRef FirstHits::CellAt(int32_t x, int32_t y) {
  const int32_t tile_x = x >> RAY_TILE_SHIFT, tile_y = y >> RAY_TILE_SHIFT;
  if (slot_ == 0 || tile_x != tile_x_ || tile_y != tile_y_) {
    tile_x_ = tile_x;
    tile_y_ = tile_y;
    slot_ = grid_.FindTileSlot(x, y);
  }
  return grid::CellOf(slot_, grid::Grid::BitOf(x, y));
}

void FirstHits::FindMiddles(uint32_t count) {
  STAGE_ASSERT(count <= kAtOnce);
  if (count % 2 == 1) SetNoPassage(count);
  for (uint32_t i = 0; i < count; i += 2) {
    const auto pair = [i](double* numbers) -> Pair& {
      return *static_cast<Pair*>(static_cast<void*>(numbers + i));
    };
    pair(middles_) = MiddlesOf(pair(in_x_), pair(in_y_), pair(across_), pair(along_));
  }
}

}  // namespace Stg::internal::sensing
