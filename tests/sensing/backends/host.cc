// SPDX-License-Identifier: GPL-2.0-or-later
//
// A complete backend in one file. Its device is this process, which walks rays one by one, as a
// kernel would, and reads the batch from the records for devices.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "kernels/ray_walk.h"
#include "kernels/records.h"
#include "sensing/backend.hh"
#include "sensing/device_batch.hh"

namespace {

using namespace Stg;

class HostPrefilter final : public sensing::Prefilter {
 public:
  explicit HostPrefilter(uint32_t per_ray) : per_ray_(per_ray) {}

  sensing::HitLists Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                         const sensing::RayBatch& batch, threads::WorkerPool* workers) override {
    sorted_.Sort(batch, workers);
    // There is no copy of the grid, so only the index of a layer's place is used.
    sorted_.PlanLaunches(std::vector{1.0}, 1, false, [](grid::LayerIndex layer) {
      return sensing::DeviceBatch::LayerPlace{0, layer, 0};
    });
    memory_.resize(sorted_.bytes() / sizeof(Chunk) + 1);
    sorted_.Write(batch, memory_.data(), workers);
    directions_ = tables.all();
    directions_.insert(directions_.end(), batch.own_directions().begin(),
                       batch.own_directions().end());
    words_.resize(static_cast<std::size_t>(batch.ray_count()) * (1 + per_ray_));
    for (const sensing::DeviceBatch::Launch& launch : sorted_.launches())
      for (std::size_t g = launch.first_group; g < launch.end_group; g++)
        WalkGroup(grid, At<ray_group_record_t>()[g]);
    for (const grid::LayerIndex layer : sorted_.layers()) grid.occupancy(layer).ForgetChanges();
    grid.ForgetChangedBodies();
    statistics_.bytes_sent += sorted_.bytes();
    return {words_.data(), per_ray_};
  }

  bool UsesHost() const override { return true; }
  std::string DeviceName() const override { return "cpu this process (test)"; }
  const sensing::PrefilterStatistics& statistics() const override { return statistics_; }

 private:
  struct alignas(16) Chunk {
    unsigned char bytes[16];
  };

  template <typename Record>
  const Record* At() const {
    return reinterpret_cast<const Record*>(memory_.data());
  }

  void WalkGroup(const grid::Grid& grid, const ray_group_record_t& group) {
    const ray_grid_t view = grid.View(group.tile_maps);
    for (uint32_t i = 0; i < group.fans; i++)
      WalkFan(grid, view, At<ray_fan_record_t>()[group.first_fan + i], group.samples);
  }

  void WalkFan(const grid::Grid& grid, const ray_grid_t& view, const ray_fan_record_t& fan,
               uint32_t samples) {
    ray_mask_t mask;
    mask.tiles = At<uint64_t>() + sorted_.first_mask() + fan.mask_first;
    mask.x = fan.mask_x;
    mask.y = fan.mask_y;
    mask.width = fan.mask_size & 0xffffu;
    mask.height = fan.mask_size >> 16;
    for (uint32_t i = 0; i < samples; i++) {
      const ray_direction_t d = directions_[fan.first_direction + i];
      ray_t ray;
      ray_begin(&ray, &view, fan.x, fan.y, static_cast<int>(fan.fraction & 0xffffu),
                static_cast<int>(fan.fraction >> 16),
                ray_rotate_x(fan.cosine, fan.sine, d.cosine, d.sine),
                ray_rotate_y(fan.cosine, fan.sine, d.cosine, d.sine));
      ListHits(grid, view, mask, &ray, &words_[std::size_t{fan.first_ray + i} * (1 + per_ray_)]);
    }
  }

  void ListHits(const grid::Grid& grid, const ray_grid_t& view, const ray_mask_t& mask, ray_t* ray,
                uint32_t* words) {
    for (uint32_t n = 0; n < per_ray_; n++) {
      const bool found = ray_next(&view, &mask, ray) != 0;
      words[1 + n] = found ? ray_pack(ray->u, ray->v) : RAY_NO_HIT;
      if (!found) return;
      if (n == 0) words[0] = grid.OnlyBody(ray->region * grid::kTilesPerRegion + ray->tile);
    }
  }

  uint32_t per_ray_;
  sensing::DeviceBatch sorted_;
  std::vector<Chunk> memory_;
  std::vector<sensing::Direction> directions_;
  std::vector<uint32_t> words_;
  sensing::PrefilterStatistics statistics_;
};

std::string List() { return "cpu: this process, with 1 to 9 hits a ray\n"; }

/// `choice`: number of hits per ray; 2 if it is empty.
std::unique_ptr<HostPrefilter> Make(const std::string& choice, std::string* message) {
  if (choice == "broken") throw sensing::PrefilterError("this device is broken");
  const char digit = choice.empty() ? '2' : choice[0];
  if (choice.size() <= 1 && digit >= '1' && digit <= '9')
    return std::make_unique<HostPrefilter>(static_cast<uint32_t>(digit - '0'));
  *message = "no device matches \"" + choice + "\"; there is\n" + List();
  return nullptr;
}

}  // namespace

STAGE_EXPORT_BACKEND(Make, List);
