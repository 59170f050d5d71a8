// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/ray_scene.hh"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_set>

#include "grid/outline.hh"
#include "kernels/ray_walk.h"
#include "sensing/fan.hh"
#include "support/fan_with_own_directions.hh"

namespace ray_scene {

namespace grid = Stg::internal::grid;
namespace sensing = Stg::internal::sensing;
using Stg::point_int_t;
using Stg::ray_grid_t;
using Stg::ray_t;

namespace {

constexpr int32_t kNear = 300;  // distance from the centre within which most bodies are, cells
constexpr uint32_t kTrees = 6;

// The grid only compares the addresses of models and trees, so these may point to anything.
char trees[kTrees];
const void* TreeOf(uint32_t tree) { return &trees[tree]; }
Stg::Model* ModelOf(uint32_t tree) { return reinterpret_cast<Stg::Model*>(&trees[tree]); }

}  // namespace

RayScene::RayScene(uint64_t seed) : random_(seed) {
  // Some scenes are at the edge of the grid.
  const auto centre = [this] {
    const int32_t edge = grid::kMaxCell - 2 * kNear;
    const int32_t places[] = {0, 0, 31, -1000, 123456789, edge, -edge};
    return places[Below(7)];
  };
  centre_x_ = centre();
  centre_y_ = centre();
  const uint32_t count = 5 + Below(60);
  for (uint32_t i = 0; i < count; i++) AddBody(MakeOutline());
  MakeBatch();
}

// ---- bodies -------------------------------------------------------------------------------------

double RayScene::PickHeight() { return 0.25 * Below(12); }

std::vector<point_int_t> RayScene::MakeOutline() {
  const auto within = [this](uint32_t reach) {
    return static_cast<int32_t>(Below(2 * reach + 1)) - static_cast<int32_t>(reach);
  };
  const int32_t x = centre_x_ + within(kNear), y = centre_y_ + within(kNear);
  const uint32_t sizes[] = {0, 1, 4, 15, 60, 200};
  const uint32_t size = sizes[Below(6)];
  std::vector<point_int_t> outline(3 + Below(5));
  for (point_int_t& corner : outline) corner = point_int_t(x + within(size), y + within(size));
  return outline;
}

void RayScene::AddBody(const std::vector<point_int_t>& outline) {
  Drawn drawn;
  drawn.tree = Below(kTrees);
  const double bottom = PickHeight();
  const grid::Body body{
      bottom, bottom + PickHeight(), ModelOf(drawn.tree), TreeOf(drawn.tree), !Chance(0.1), 0};
  drawn.id = grid_.AddBody(body);
  grid::AppendOutline(outline.data(), outline.size(), &drawn.cells);
  grid_.Rasterize(drawn.id, {}, drawn.cells);
  bodies_.push_back(std::move(drawn));
}

void RayScene::RemoveBody(size_t i) {
  grid_.Rasterize(bodies_[i].id, bodies_[i].cells, {});
  grid_.RemoveBody(bodies_[i].id);
  bodies_[i] = std::move(bodies_.back());
  bodies_.pop_back();
}

void RayScene::ChangeVisibility(Drawn* drawn) {
  grid::Body body = grid_.body(drawn->id);
  body.ranger_visible = !body.ranger_visible;
  body.z_min = PickHeight();
  body.z_max = body.z_min + PickHeight();
  grid_.ChangeBody(drawn->id, body, drawn->cells);
}

/// Adds a field of dots, a region or more apart. When they are removed, regions are dropped.
void RayScene::AddDots() {
  const int32_t side = 20, pitch = 70;
  const int32_t x0 = centre_x_ < 0 ? centre_x_ + 5000 : centre_x_ - 5000;
  for (int32_t i = 0; i < side * side; i++) {
    const point_int_t dot(x0 + i % side * pitch, centre_y_ / 2 + i / side * pitch);
    AddBody({dot, dot, dot});
  }
}

/// Adds a frame along the border of the bounding box of all occupied cells.
void RayScene::AddFrame() {
  const grid::CellBox box = grid_.occupied();
  const int64_t longest = 10000;
  if (int64_t{box.max_x} - box.min_x > longest || int64_t{box.max_y} - box.min_y > longest) return;
  AddBody({{box.min_x, box.min_y},
           {box.max_x, box.min_y},
           {box.max_x, box.max_y},
           {box.min_x, box.max_y}});
}

void RayScene::Change() {
  for (size_t i = bodies_.size(); i-- > 0;) {
    if (Chance(0.1)) ChangeVisibility(&bodies_[i]);
    if (Chance(0.15)) RemoveBody(i);
  }
  const uint32_t added = Below(16);
  for (uint32_t i = 0; i < added; i++) AddBody(MakeOutline());
  if (Chance(0.1)) AddDots();
  if (Chance(0.2)) AddFrame();
  if (bodies_.size() > 400)
    while (bodies_.size() > 20) RemoveBody(bodies_.size() - 1);
  if (Chance(0.05))
    for (int i = 0; i < 1100; i++) grid_.ExpireLayers();
}

// ---- fans ---------------------------------------------------------------------------------------

Stg::Pose RayScene::PickOrigin() {
  Stg::Pose origin(centre_x_ + random_.Uniform(-1.3, 1.3) * kNear,
                   centre_y_ + random_.Uniform(-1.3, 1.3) * kNear, PickHeight(),
                   random_.Uniform(-4, 4));
  // Sometimes at the edges of the bounding box of occupied cells.
  const grid::CellBox box = grid_.occupied();
  const auto near = [this](int32_t edge) { return edge + random_.Uniform(-1, 2); };
  if (Chance(0.2)) origin.x = near(Chance(0.5) ? box.min_x : box.max_x);
  if (Chance(0.2)) origin.y = near(Chance(0.5) ? box.min_y : box.max_y);
  // Sometimes on borders and corners of cells.
  if (Chance(0.3)) origin.x = std::floor(origin.x);
  if (Chance(0.3)) origin.y = std::floor(origin.y);
  // Sometimes along axes and diagonals.
  if (Chance(0.4)) origin.a = M_PI / 4 * (static_cast<int>(Below(9)) - 4);
  return origin;
}

double RayScene::PickRange() {
  const double ranges[] = {
      0, 1e-7, 0.3, 1, 1.5, 7, 30, 64, 100, 300, 299.7, 1024.5, RAY_LEG_CELLS, RAY_LEG_CELLS + 1.0};
  return Chance(0.6) ? random_.Uniform(0, 400) : ranges[Below(14)];
}

void RayScene::AddFan() {
  const uint32_t counts[] = {0, 1, 2, 3, 7, 31, 64, 65};
  const uint32_t samples = counts[Below(8)];
  const double fov = random_.Uniform(-7, 14);
  const Stg::Pose origin = PickOrigin();
  sensing::Fan fan;
  PlaceFan(&fan, origin, PickRange(), 1.0);
  fan.layer = Chance(0.2) ? grid::kEverything : grid_.RangerLayer(origin.z, Chance(0.7));

  sensing::SelfMask mask;
  if (Chance(0.5)) {
    const uint32_t tree = Below(kTrees);
    grid::Rasterizations own;
    for (const Drawn& drawn : bodies_)
      if (drawn.tree == tree && Chance(0.3)) own.of_bodies.push_back(&drawn.cells);
    mask = batch_.MakeSelfMask(grid_, own, TreeOf(tree), false);
  }
  if (Chance(0.2)) {
    std::vector<double> bearings;
    for (uint32_t i = 0; i < samples; i++) bearings.push_back(random_.Uniform(-4, 4));
    Stg::test::AddTurned(&batch_, fan, bearings, mask);
  } else {
    fan.record.first_direction = tables_.Find(Chance(0.5) ? 3.14 : fov, samples);
    batch_.Add(fan, samples, mask);
  }
}

void RayScene::MakeBatch() {
  batch_.Clear();
  const uint32_t count = Chance(0.05) ? 1 : 1 + Below(40);
  for (uint32_t i = 0; i < count; i++) AddFan();
  batch_.Close(tables_);
}

// ---- expected hits ------------------------------------------------------------------------------

namespace {

/// Calls f(fan, view, ray, index) for each ray of the single-leg fans, at the start of its walk.
template <typename F>
void ForEachRay(const RayScene& scene, F f) {
  for (const sensing::Fan& fan : scene.batch().fans()) {
    const sensing::FanRecord& r = fan.record;
    if (!fan.single_leg() || r.samples == 0) continue;
    const ray_grid_t view = scene.grid().View(fan.layer);
    const sensing::Direction* directions = scene.batch().DirectionsOf(fan);
    for (uint32_t i = 0; i < r.samples; i++) {
      ray_t ray;
      Stg::ray_begin(&ray, &view, r.x, r.y, static_cast<int>(r.fraction & 0xffff),
                     static_cast<int>(r.fraction >> 16),
                     Stg::ray_rotate_x(r.cosine, r.sine, directions[i].cosine, directions[i].sine),
                     Stg::ray_rotate_y(r.cosine, r.sine, directions[i].cosine, directions[i].sine));
      f(fan, view, &ray, r.first_ray + i);
    }
  }
}

/// The occupied cells of one layer, computed from the lists of bodies.
class CoordinateSet {
 public:
  CoordinateSet(const grid::Grid& grid, grid::LayerIndex layer) : grid_(grid), layer_(layer) {}
  bool Has(int32_t x, int32_t y) const {
    const uint32_t region = grid_.FindRegion(x, y);
    return region != 0 && grid_.AnyAt(region, grid::Grid::TileOf(x, y), grid::Grid::BitOf(x, y),
                                      [this](grid::BodyId id) {
                                        return (grid_.body(id).layers >> layer_ & 1) != 0;
                                      });
  }

 private:
  const grid::Grid& grid_;
  grid::LayerIndex layer_;
};

bool Hidden(const Stg::ray_mask_t& mask, int32_t x, int32_t y) {
  const int64_t wx = int64_t{x >> 3} - mask.x, wy = int64_t{y >> 3} - mask.y;
  if (wx < 0 || wy < 0 || wx >= mask.width || wy >= mask.height) return false;
  const uint64_t word = mask.tiles[wy * mask.width + wx];
  return (word >> grid::Grid::BitOf(x, y) & 1) != 0;
}

}  // namespace

std::vector<uint32_t> ListsByWalk(const RayScene& scene, uint32_t per_ray) {
  std::vector<uint32_t> lists(static_cast<size_t>(scene.batch().ray_count()) * per_ray, 0);
  ForEachRay(scene, [&](const sensing::Fan& fan, const ray_grid_t& view, ray_t* ray, uint32_t n) {
    const Stg::ray_mask_t mask = scene.batch().SelfMaskOf(fan);
    uint32_t* list = &lists[size_t{n} * per_ray];
    for (uint32_t i = 0; i < per_ray; i++) {
      const bool found = Stg::ray_next(&view, &mask, ray) != 0;
      list[i] = found ? Stg::ray_pack(ray->u, ray->v) : RAY_NO_HIT;
      if (!found) break;
    }
  });
  return lists;
}

std::vector<uint32_t> ListsCellByCell(const RayScene& scene, uint32_t per_ray) {
  std::vector<uint32_t> lists(static_cast<size_t>(scene.batch().ray_count()) * per_ray, 0);
  ForEachRay(scene, [&](const sensing::Fan& fan, const ray_grid_t&, ray_t* ray, uint32_t n) {
    const Stg::ray_mask_t mask = scene.batch().SelfMaskOf(fan);
    const CoordinateSet cells(scene.grid(), fan.layer);
    uint32_t* list = &lists[size_t{n} * per_ray];
    uint32_t found = 0;
    int64_t u = 0, v = 0;
    while (found < per_ray) {
      const int32_t x = static_cast<int32_t>(ray->x0 + ray->sx * u);
      const int32_t y = static_cast<int32_t>(ray->y0 + ray->sy * v);
      if (cells.Has(x, y) && !Hidden(mask, x, y))
        list[found++] = Stg::ray_pack(static_cast<int>(u), static_cast<int>(v));
      const int64_t to_x = ((u + 1) << 16) - ray->ox, to_y = ((v + 1) << 16) - ray->oy;
      const bool x_next = to_x * ray->ady < to_y * ray->adx;
      if (x_next ? to_x > ray->adx : to_y > ray->ady) break;
      (x_next ? u : v)++;
    }
    if (found < per_ray) list[found] = RAY_NO_HIT;
  });
  return lists;
}

std::string FirstDifference(const RayScene& scene, const std::vector<uint32_t>& expected,
                            const sensing::HitLists& found) {
  std::ostringstream text;
  ForEachRay(scene, [&](const sensing::Fan& fan, const ray_grid_t& view, ray_t* ray, uint32_t n) {
    for (uint32_t i = 0; i < found.per_ray && text.tellp() == 0; i++) {
      const uint32_t e = expected[size_t{n} * found.per_ray + i], f = found.ListOf(n)[i];
      if (e != f)
        text << "ray " << n << ", entry " << i << ": expected " << std::hex << e << ", found " << f
             << std::dec << "; from the cell " << ray->x0 << " " << ray->y0 << ", in it at "
             << ray->ox << " " << ray->oy << ", by " << ray->sx * ray->adx << " "
             << ray->sy * ray->ady << ", layer " << fan.layer << ", box " << view.min_x << " "
             << view.min_y << " " << view.max_x << " " << view.max_y;
      if (e == RAY_NO_HIT) break;
    }
  });
  return text.str();
}

std::string FirstWrongBody(const RayScene& scene, const sensing::HitLists& found) {
  std::ostringstream text;
  ForEachRay(scene, [&](const sensing::Fan&, const ray_grid_t&, ray_t* ray, uint32_t n) {
    const uint32_t hit = found.ListOf(n)[0];
    if (hit == RAY_NO_HIT || text.tellp() != 0) return;
    const int32_t x = ray->x0 + ray->sx * Stg::ray_packed_u(hit);
    const int32_t y = ray->y0 + ray->sy * Stg::ray_packed_v(hit);
    const uint32_t expected = scene.grid().OnlyBody(scene.grid().FindTileSlot(x, y));
    if (found.BodyOf(n) != expected)
      text << "ray " << n << " hits in " << x << " " << y << ": expected body " << expected
           << ", found " << found.BodyOf(n);
  });
  return text.str();
}

}  // namespace ray_scene
