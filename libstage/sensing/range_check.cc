// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/range_check.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "geometry/trigonometry.hh"
#include "grid/cover.hh"
#include "grid/outline.hh"
#include "random/random.hh"
#include "sensing/tracer.hh"

namespace Stg::internal::sensing {

namespace {

constexpr double kCellsPerMetre = 10;
constexpr uint32_t kBodies = 40, kCorners = 6, kSamples = 64;
constexpr double kHalfWidth = 6, kRange = 5;  // metres

/// A polygon that stands for a model of its own, with both rasterizations.
struct CheckPolygon {
  std::vector<point_t> corners;  // closed
  std::vector<grid::CellSet> thin, exact;
  double x = 0, y = 0;

  /// Only compared, never used as a model.
  Model* model() { return static_cast<Model*>(static_cast<void*>(this)); }
};

bool StopsAtOthers(Model* candidate, const Model* finder, const void*) {
  return candidate != finder;
}

class CheckScene {
 public:
  CheckScene() : polygons_(kBodies), workers_(1) {
    random_.Seed(1);
    grid_.TrackChanges(true);
    for (CheckPolygon& polygon : polygons_) Add(&polygon);
    for (const bool exact : {false, true}) layers_[exact] = grid_.RangerLayer(0, true, exact);
    grid_.ExpireLayers();  // so that the layers are older than the batch
    for (CheckPolygon& polygon : polygons_) AddFans(&polygon);
    batch_.Close(tables_);
  }

  /// Number of rays whose ranges are known and equal, or 0 if some differ.
  uint32_t Compare(Prefilter* prefilter) {
    batch_.AskForRanges(prefilter->ranges(), grid_);
    const HitLists found = prefilter->Walk(grid_, tables_, batch_, &workers_);
    prefilter->WaitFor(batch_, batch_.fans().size() - 1);
    const Tracer tracer(grid_);
    Tracer::Hits hits;
    TraceCounters counters;
    uint32_t equal = 0;
    for (const Fan& fan : batch_.fans()) {
      tracer.TraceFans(batch_, std::span(&fan, 1), HitLists(), &hits, &counters);
      const double* const ranges = found.RangesOf(fan.record.first_ray);
      const HitInterval* interval = hits.intervals.data();
      for (uint32_t i = 0; i < fan.record.samples; i++) {
        if (i == interval->end) interval++;
        const double expected = interval->model ? hits.ranges[i] : -hits.ranges[i];
        if (std::isnan(ranges[i])) continue;
        if (std::bit_cast<uint64_t>(ranges[i]) != std::bit_cast<uint64_t>(expected)) return 0;
        equal++;
      }
    }
    return equal;
  }

 private:
  void Add(CheckPolygon* polygon) {
    polygon->x = random_.Uniform(-kHalfWidth, kHalfWidth);
    polygon->y = random_.Uniform(-kHalfWidth, kHalfWidth);
    std::vector<point_int_t> cells;
    for (uint32_t i = 0; i < kCorners; i++) {
      const SineCosine turn = SinCos(2 * std::numbers::pi * i / kCorners);
      const double radius = random_.Uniform(0.2, 0.8);
      const point_t corner(polygon->x + radius * turn.cosine, polygon->y + radius * turn.sine);
      polygon->corners.push_back(corner);
      cells.emplace_back(static_cast<int>(std::floor(corner.x * kCellsPerMetre)),
                         static_cast<int>(std::floor(corner.y * kCellsPerMetre)));
    }
    polygon->corners.push_back(polygon->corners.front());
    grid::Body body{.z_min = -1, .z_max = 1, .model = polygon->model(), .tree = polygon};
    if (random_.Uniform() < 0.2) body.z_min = 0.5;  // passed by all rays
    body.number = static_cast<uint32_t>(polygon - polygons_.data());
    grid::AppendOutline(cells.data(), cells.size(), &polygon->thin);
    grid_.Rasterize(grid_.AddBody(body), {}, polygon->thin);
    AddExactly(body, polygon);
  }

  void AddExactly(grid::Body body, CheckPolygon* polygon) {
    grid::CellSetBuilder builder(&polygon->exact);
    for (uint32_t i = 0; i < kCorners; i++) {
      const point_t &from = polygon->corners[i], &to = polygon->corners[i + 1];
      grid::ForEachRowNear(
          point_t(from.x * kCellsPerMetre, from.y * kCellsPerMetre),
          point_t(to.x * kCellsPerMetre, to.y * kCellsPerMetre),
          [&](int32_t y, int32_t first, int32_t last) { builder.AddRow(y, first, last, 1u << i); });
    }
    builder.Finish();
    body.corners = polygon->corners.data();
    body.edges = kCorners;
    body.x = polygon->x;
    body.y = polygon->y;
    body.radius = 0.8;
    grid_.Rasterize(grid_.AddBody(body), {}, polygon->exact);
  }

  void AddFans(CheckPolygon* polygon) {
    const Pose origin(polygon->x, polygon->y, 0, random_.Uniform(-3, 3));
    for (const bool exact : {false, true}) {
      grid::Rasterizations own;
      own.of_bodies = {exact ? &polygon->exact : &polygon->thin};
      Fan fan;
      fan.exact = exact;
      fan.layer = layers_[exact];
      fan.predicate = StopsAtOthers;
      fan.finder = polygon->model();
      fan.sees_all_but = polygon;
      fan.record.first_direction = tables_.Find(6.1, kSamples);
      PlaceFan(&fan, origin, kRange, kCellsPerMetre);
      batch_.Add(fan, kSamples, batch_.MakeSelfMask(grid_, own, polygon, exact));
    }
  }

  std::vector<CheckPolygon> polygons_;
  threads::WorkerPool workers_;
  RandomStream random_;
  grid::Grid grid_;
  DirectionTables tables_;
  RayBatch batch_;
  grid::LayerIndex layers_[2]{};
};

}  // namespace

bool FindsRangesOfHost(Prefilter* prefilter) {
  constexpr uint32_t kEnough = kBodies * kSamples;  // half of all rays
  return CheckScene().Compare(prefilter) >= kEnough;
}

}  // namespace Stg::internal::sensing
