// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/device_views.hh"

#include <algorithm>
#include <tuple>

#include "messages/assert.hh"

namespace Stg::rows {

namespace grid = internal::grid;

namespace {

/// True if the rays of the sensor stop at the body.
bool Stops(const Sensor& sensor, const grid::Body& body) {
  return !(sensor.z < body.z_min || sensor.z > body.z_max) && !(body.model->vis.ranger_return < 0);
}

}  // namespace

DeviceViews::DeviceViews(const Scene& scene, std::vector<row_sensor_t>* sensors) : scene_(scene) {
  std::map<std::tuple<grid::LayerIndex, double, bool>, uint32_t> known;
  for (size_t k = 0; k < scene.sensors.size(); k++) {
    const Sensor& sensor = scene.sensors[k];
    const auto [place, is_new] =
        known.try_emplace({sensor.layer, sensor.z, sensor.exact}, views_.size());
    (*sensors)[k].view = place->second;
    if (is_new) views_.push_back(sensor.exact ? ExactView(sensor) : CellView(sensor));
  }
}

DeviceViews::View DeviceViews::CellView(const Sensor& sensor) {
  const grid::Occupancy& cells = scene_.grid.occupancy(sensor.layer);
  View view;
  view.tile_maps.resize(cells.tile_maps().size());
  view.tiles.assign(cells.tiles().begin(), cells.tiles().end());
  view.of_tiles.resize(cells.tiles().size());
  for (uint32_t slot = 0; slot < view.tiles.size(); slot++)
    if (view.tiles[slot] != 0) AddTile(sensor, slot, &view);
  return view;
}

/// Removes the cells of a tile that the rays pass, and enters what they meet in the others.
void DeviceViews::AddTile(const Sensor& sensor, uint32_t slot, View* view) {
  uint64_t& tile = view->tiles[slot];
  std::vector<uint32_t> walls(64);
  uint32_t one = ROW_NONE;
  bool several = false;
  for (uint32_t bit = 0; bit < 64; bit++) {
    if (!(tile >> bit & 1)) continue;
    walls[bit] = WallIn(sensor, grid::CellOf(slot, bit));
    if (walls[bit] == ROW_NONE) {
      tile &= ~(uint64_t{1} << bit);
      continue;
    }
    several |= one != ROW_NONE && one != walls[bit];
    one = walls[bit];
  }
  if (tile == 0) return;
  view->tile_maps[slot / grid::kTilesPerRegion] |= uint64_t{1} << slot % grid::kTilesPerRegion;
  view->of_tiles[slot] = one;
  if (!several) return;
  view->of_tiles[slot] = ROW_SEVERAL | static_cast<uint32_t>(view->lists.size() / 64);
  view->lists.insert(view->lists.end(), walls.begin(), walls.end());
}

/// Returns the index in walls() of the body that the rays meet in a cell, or ROW_NONE.
uint32_t DeviceViews::WallIn(const Sensor& sensor, grid::CellRef cell) {
  uint32_t wall = ROW_NONE;
  scene_.grid.AnyIn(cell, [&](grid::BodyId id) {
    if (!Stops(sensor, scene_.grid.body(id))) return false;
    wall = WallOf(id);
    return true;
  });
  return wall;
}

uint32_t DeviceViews::WallOf(grid::BodyId id) {
  const auto [place, is_new] = wall_of_.try_emplace(id, static_cast<uint32_t>(walls_.size()));
  if (is_new)
    walls_.push_back({scene_.grid.Stamp(id), BrightnessOf(*scene_.grid.body(id).model), 0});
  return place->second;
}

DeviceViews::View DeviceViews::ExactView(const Sensor& sensor) {
  const grid::Occupancy& cells = scene_.grid.occupancy(sensor.layer);
  View view;
  view.tile_maps.assign(cells.tile_maps().begin(), cells.tile_maps().end());
  view.tiles.assign(cells.tiles().begin(), cells.tiles().end());
  view.of_tiles.assign(cells.tiles().size(), ROW_NONE);
  for (uint32_t slot = 0; slot < view.of_tiles.size(); slot++)
    scene_.grid.ForEachOutline(
        scene_.grid.OutlinesIn(slot), [&](const grid::OutlineFragment& outline) {
          const grid::Body& body = scene_.grid.body(outline.id);
          if (!Stops(sensor, body)) return;
          fragments_.push_back({body.x, body.y, body.radius, FirstCornerOf(outline.id),
                                outline.edges, body.number, body.model->GetId(),
                                BrightnessOf(*body.model), view.of_tiles[slot]});
          view.of_tiles[slot] = static_cast<uint32_t>(fragments_.size()) - 1;
        });
  return view;
}

/// Index in corners() of the body's first corner.
uint32_t DeviceViews::FirstCornerOf(grid::BodyId id) {
  const auto [place, is_new] = corner_of_.try_emplace(id, static_cast<uint32_t>(corners_.size()));
  const grid::Body& body = scene_.grid.body(id);
  for (uint32_t i = 0; is_new && i <= body.edges; i++)
    corners_.push_back({body.corners[i].x, body.corners[i].y});
  return place->second;
}

uint32_t DeviceViews::BrightnessOf(const Model& model) const {
  const auto found = std::ranges::find(scene_.brightness, model.vis.ranger_return);
  STAGE_ASSERT(found != scene_.brightness.end());
  return static_cast<uint32_t>(found - scene_.brightness.begin());
}

}  // namespace Stg::rows
