// SPDX-License-Identifier: GPL-2.0-or-later
//
// Layers of the grid: their selection, creation and expiry, and the bodies that each shows.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "grid/grid.hh"
#include "messages/assert.hh"

namespace Stg::internal::grid {

bool Grid::Shows(const Layer& layer, const Body& body) {
  if (layer.exact != body.exact() || (layer.map && body.drives)) return false;
  switch (layer.kind) {
    case Layer::kUnused:
      return false;
    case Layer::kAll:
      return true;
    case Layer::kAnyHeight:
      return body.ranger_visible;
    case Layer::kHeight:
      return body.ranger_visible && !(layer.z < body.z_min || layer.z > body.z_max);
  }
  return true;
}

uint32_t Grid::LayersOf(const Body& body) const {
  uint32_t layers = 0;
  for (LayerIndex i = 0; i < layers_.size(); i++)
    if (Shows(layers_[i], body)) layers |= 1u << i;
  return layers;
}

LayerIndex Grid::EverythingLayer(bool exact) {
  const LayerIndex found = FindLayer(Layer::kAll, 0, exact, false);
  return found != kNoLayer ? found : MakeLayer(Layer::kAll, 0, exact, false);
}

LayerIndex Grid::RangerLayerOf(double z, bool z_test, bool exact, bool map) {
  const LayerIndex found = FindRangerLayerOf(z, z_test, exact, map);
  if (found != kNoLayer) return found;
  const bool any_height = !z_test || std::isnan(z) || HeightsAreFull(exact);
  return MakeLayer(any_height ? Layer::kAnyHeight : Layer::kHeight, any_height ? 0 : z, exact, map);
}

LayerIndex Grid::FindRangerLayerOf(double z, bool z_test, bool exact, bool map) const {
  if (!z_test || std::isnan(z)) return FindLayer(Layer::kAnyHeight, 0, exact, map);
  const LayerIndex found = FindLayer(Layer::kHeight, z, exact, map);
  if (found != kNoLayer || !HeightsAreFull(exact)) return found;
  return FindLayer(Layer::kAnyHeight, 0, exact, map);
}

uint32_t Grid::LayersOfAllHeights() const {
  uint32_t layers = 0;
  for (LayerIndex i = 0; i < layers_.size(); i++)
    if (layers_[i].kind == Layer::kAnyHeight) layers |= 1u << i;
  return layers;
}

uint32_t Grid::NewLayers() const {
  uint32_t layers = 0;
  for (LayerIndex i = 0; i < layers_.size(); i++)
    if (layers_[i].kind != Layer::kUnused && layers_[i].made == step_) layers |= 1u << i;
  return layers;
}

/// True if further heights must share the layer of any height.
bool Grid::HeightsAreFull(bool exact) const {
  const auto heights = std::count_if(layers_.begin(), layers_.end(), [&](const Layer& layer) {
    return layer.kind == Layer::kHeight && layer.exact == exact;
  });
  return heights >= static_cast<std::ptrdiff_t>(kMaxHeights);
}

LayerIndex Grid::FindLayer(Layer::Kind kind, double z, bool exact, bool map) const {
  for (LayerIndex i = 0; i < layers_.size(); i++) {
    const Layer& layer = layers_[i];
    if (layer.exact != exact || layer.map != map || layer.kind != kind || layer.z != z) continue;
    // Several threads may search concurrently.
    const std::atomic_ref<uint64_t> last_used(layer.last_used);
    if (last_used.load(std::memory_order_relaxed) != step_)
      last_used.store(step_, std::memory_order_relaxed);
    return i;
  }
  return kNoLayer;
}

LayerIndex Grid::MakeLayer(Layer::Kind kind, double z, bool exact, bool map) {
  // Allocate before changing anything, so that bad_alloc leaves the grid unchanged.
  Occupancy cells;
  cells.TrackChanges(tracking_);
  cells.Resize(static_cast<uint32_t>(regions_.size()));
  LayerIndex index = 0;
  while (index < layers_.size() && layers_[index].kind != Layer::kUnused) index++;
  STAGE_ASSERT(index < kMaxLayers && kind != Layer::kUnused && !std::isnan(z));
  if (index == layers_.size()) layers_.emplace_back();
  Layer& layer = layers_[index];
  layer.kind = kind;
  layer.z = z;
  layer.exact = exact;
  layer.map = map;
  layer.made = layer.last_used = step_;
  layer.cells = std::move(cells);
  for (Body& body : bodies_)
    if (body.model) body.layers = LayersOf(body);
  for (uint32_t slot = 0; slot < tiles_.size(); slot++) {
    if (exact)
      RefreshOutlines(slot);
    else
      RefreshCells({.slot = slot, .cells = tiles_[slot].cells});
  }
  return index;
}

/// Mask of the layers that show exact or thin outlines.
uint32_t Grid::LayersOfKind(bool exact) const {
  uint32_t layers = 0;
  for (LayerIndex i = 0; i < layers_.size(); i++)
    if (layers_[i].exact == exact) layers |= 1u << i;
  return layers;
}

void Grid::ExpireLayers() {
  constexpr uint64_t kExpirySteps = 1000;  // steps
  step_++;
  for (LayerIndex i = 1; i < layers_.size(); i++) {
    Layer& layer = layers_[i];
    if (layer.kind == Layer::kUnused || step_ - layer.last_used < kExpirySteps) continue;
    STAGE_ASSERT(step_ > layer.last_used);
    layer.kind = Layer::kUnused;
    layer.cells = Occupancy();
    layer.cells.Resize(static_cast<uint32_t>(regions_.size()));
    for (Body& body : bodies_) body.layers &= ~(1u << i);
  }
}

void Grid::TrackChanges(bool on) {
  tracking_ = on;
  changed_bodies_.Track(on);
  changed_outlines_.Track(on);
  changed_exact_bodies_.assign(on ? bodies_.size() : 0, 0);
  for (Layer& layer : layers_) layer.cells.TrackChanges(on);
}

ray_grid_t Grid::View(LayerIndex layer) const {
  STAGE_ASSERT(layer < layers_.size() && layers_[layer].kind != Layer::kUnused);
  STAGE_ASSERT(layers_[layer].cells.tile_maps().size() == regions_.size());
  ray_grid_t view;
  view.directory = directory_.data();
  view.regions = region_tables_.data();
  view.region_maps = region_maps_.data();
  view.tile_maps = layers_[layer].cells.tile_maps().data();
  view.tiles = layers_[layer].cells.tiles().data();
  view.directory_mask = static_cast<uint32_t>(directory_.size() - 1);
  view.min_x = occupied_.min_x;
  view.min_y = occupied_.min_y;
  view.max_x = occupied_.max_x;
  view.max_y = occupied_.max_y;
  return view;
}

}  // namespace Stg::internal::grid
