// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/walk_record.hh"

#include <algorithm>

namespace Stg::internal::sensing {

namespace {

using Kind = WalkStep::Kind;

/// Fraction of the displacement at which a border is crossed.
double FractionAt(int border, int offset, int displacement) {
  return displacement == 0 ? 1.0 : (border * 65536.0 - offset) / displacement;
}

struct Ground {
  Kind kind;      // kind of the largest empty square around the cell
  int shift;      // its side is 2^shift cells
  bool occupied;  // true if the cell itself is occupied
};

Ground GroundAt(const ray_grid_t& grid, const ray_mask_t& mask, int x, int y) {
  const ray_uint super = ray_find_super(&grid, x >> RAY_SUPER_SHIFT, y >> RAY_SUPER_SHIFT);
  if (super == 0) return {Kind::kSuper, RAY_SUPER_SHIFT, false};
  const ray_uint region =
      grid.regions[super * 256 + static_cast<ray_uint>(
                                     ray_place(x >> RAY_REGION_SHIFT, y >> RAY_REGION_SHIFT, 4))];
  const ray_ulong tile_map = region ? grid.tile_maps[region] : 0;
  if (tile_map == 0) return {Kind::kRegion, RAY_REGION_SHIFT, false};
  const int t = ray_place(x >> RAY_TILE_SHIFT, y >> RAY_TILE_SHIFT, 3);
  const ray_ulong word =
      (tile_map >> t) & 1
          ? ray_visible(&mask, grid.tiles[region * 64 + static_cast<ray_uint>(t)], x, y)
          : 0;
  if (word == 0) return {Kind::kTile, RAY_TILE_SHIFT, false};
  return {Kind::kCell, 0, ((word >> ray_place(x, y, 3)) & 1) != 0};
}

/// Moves to the border of the ray's square of 2^shift cells, as ray_next() does. Returns the
/// position there, as a fraction of the displacement.
double Leap(ray_t* ray, int x, int y, int shift) {
  const int to_x = ray->u + 1 + ray_cells_left(x, ray->sx, shift);
  const int to_y = ray->v + 1 + ray_cells_left(y, ray->sy, shift);
  const bool in_x =
      ray_product((to_x << 16) - ray->ox, ray->ady) < ray_product((to_y << 16) - ray->oy, ray->adx);
  if (in_x) {
    ray->v = ray_leap_end(to_x, ray->ox, ray->adx, ray->oy, ray->ady, ray->dy_per_dx, ray->v, 1);
    ray->u = to_x;
    return FractionAt(to_x, ray->ox, ray->adx);
  }
  ray->u = ray_leap_end(to_y, ray->oy, ray->ady, ray->ox, ray->adx, ray->dx_per_dy, ray->u, 0);
  ray->v = to_y;
  return FractionAt(to_y, ray->oy, ray->ady);
}

}  // namespace

void RecordWalk(const ray_grid_t& grid, const ray_mask_t& mask, ray_t ray, std::size_t max_cells,
                std::vector<WalkStep>* steps) {
  double at = 0;
  while (steps->size() < max_cells && (ray.u << 16) - ray.ox <= ray.limit_x &&
         (ray.v << 16) - ray.oy <= ray.limit_y) {
    const int x = ray.x0 + ray.sx * ray.u, y = ray.y0 + ray.sy * ray.v;
    const Ground ground = GroundAt(grid, mask, x, y);
    if (ground.occupied) steps->push_back({Kind::kHit, x, y, at, at});
    const double next = std::min(1.0, Leap(&ray, x, y, ground.shift));
    steps->push_back({ground.kind, x, y, at, next});
    at = next;
  }
}

}  // namespace Stg::internal::sensing
