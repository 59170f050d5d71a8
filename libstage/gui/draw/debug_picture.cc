// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/debug_picture.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "gui/draw/painter.hh"
#include "models/body.hh"
#include "models/ranger.hh"
#include "sensing/scene.hh"
#include "sensing/tracer.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg::draw {

namespace {

constexpr Rgba kBlue = {0, 0, 255, 255}, kGreen = {0, 160, 0, 255};
constexpr double kMinPixels = 3;  // minimum side of a square that is drawn, pixels

// ---- occupancy ----------------------------------------------------------------------------------

class GridPicture {
 public:
  GridPicture(const grid::Grid& grid, double cell, const view::Projection& projection,
              Painting* painting)
      : view_(grid.View(grid::kEverything)),
        cell_(cell),
        projection_(projection),
        painter_(painting) {}

  void Draw(const std::vector<ray_super_t>& directory) {
    for (const ray_super_t& super : directory)
      if (super.index != 0 && Outline(super.x, super.y, RAY_SUPER_SHIFT, kBlue)) DrawSuper(super);
  }

 private:
  /// Outlines the square of 2^shift cells. Returns false if it is out of view or too small to see.
  bool Outline(int x, int y, int shift, const Rgba& color) {
    const double side = cell_ * (1 << shift);
    const Bounds bx(x * side, (x + 1.0) * side), by(y * side, (y + 1.0) * side);
    const point3_t middle(x * side + side / 2, y * side + side / 2, 0);
    if (!projection_.Sees(middle.x, middle.y, 0, side)) return false;
    if (side < kMinPixels * projection_.PixelAt(middle)) return false;
    painter_.SetColor(color);
    painter_.RectangleOutline(bx, by, 0);
    return true;
  }

  void DrawSuper(const ray_super_t& super) {
    for (uint32_t i = 0; i < 256; i++) {
      const uint32_t region = view_.regions[super.index * 256 + i];
      if (region == 0 || view_.tile_maps[region] == 0) continue;
      const int x = super.x * 16 + static_cast<int>(i & 15),
                y = super.y * 16 + static_cast<int>(i >> 4);
      if (Outline(x, y, RAY_REGION_SHIFT, kGreen)) DrawRegion(region, x, y);
    }
  }

  void DrawRegion(uint32_t region, int region_x, int region_y) {
    const double side = cell_ * (1 << RAY_REGION_SHIFT);
    const point3_t middle((region_x + 0.5) * side, (region_y + 0.5) * side, 0);
    if (cell_ < projection_.PixelAt(middle)) return;
    painter_.SetColor({0, 160, 0, 128});
    for (int t = 0; t < 64; t++) {
      if (!((view_.tile_maps[region] >> t) & 1)) continue;
      const uint64_t word = view_.tiles[region * 64 + static_cast<uint32_t>(t)];
      for (int b = 0; b < 64; b++) {
        if (!((word >> b) & 1)) continue;
        const double x = cell_ * (region_x * 64 + (t & 7) * 8 + (b & 7));
        const double y = cell_ * (region_y * 64 + (t >> 3) * 8 + (b >> 3));
        painter_.Rectangle(Bounds(x, x + cell_), Bounds(y, y + cell_), 0);
      }
    }
  }

  const ray_grid_t view_;
  const double cell_;
  const view::Projection& projection_;
  Painter painter_;
};

// ---- rays ---------------------------------------------------------------------------------------

constexpr size_t kMaxRays = 60;  // per sensor; more could not be told apart

class RayPicture {
 public:
  RayPicture(World& world, const Model& root, Painting* painting)
      : world_(world), root_(root), cell_(1 / world.Resolution()), painter_(painting) {}

  void DrawTree(const Model& model, const Pose& global) {
    if (const auto* ranger = dynamic_cast<const ModelRanger*>(&model)) {
      const Pose frame = ranger->SensorFrame(global);
      const SineCosine turn = SinCos(frame.a);
      for (uint32_t i = 0; i < ranger->GetSensors().size(); i++)
        DrawFan(ranger->GetSensors()[i], ranger->FanOf(i, frame, turn));
    }
    for (const Model* child : model.GetChildren())
      DrawTree(*child, model.ChildGlobalPose(global, *child));
  }

 private:
  void DrawFan(const ModelRanger::Sensor& sensor, sensing::Fan fan) {
    if (fan.nothing) return;
    grid::Grid& grid = world_.engine().scene.grid;
    fan.layer = grid.RangerLayer(fan.z, fan.z_test, fan.exact);
    grid::Rasterizations own;
    root_.CollectRasterizations(&own, fan.exact);
    sensing::RayBatch batch;
    const sensing::SelfMask mask = batch.MakeSelfMask(grid, own, root_.Root(), fan.exact);
    const ray_mask_t hidden{batch.mask_words().data() + mask.first, mask.x, mask.y, mask.width,
                            mask.height};
    const sensing::Tracer tracer(grid);
    // A sensor without subscribers has no bearings yet.
    const bool has_data = sensor.bearings.size() == sensor.sample_count;
    const size_t count = sensor.sample_count;
    for (size_t i = 0; i < count; i += (count + kMaxRays - 1) / kMaxRays) {
      const double bearing = has_data ? sensor.bearings[i] : BearingOf(sensor, i);
      sensing::RayRecord record;
      tracer.Record(fan, {sensing::MakeDirection(bearing), sensing::UnitVectorOf(bearing)}, hidden,
                    &record);
      DrawRay(record);
    }
  }

  static double BearingOf(const ModelRanger::Sensor& sensor, size_t sample) {
    return sensing::SampleBearing(sensor.fov, sensor.sample_count, static_cast<uint32_t>(sample));
  }

  void DrawRay(const sensing::RayRecord& record) {
    z_ = record.fan.z;
    for (const sensing::RayRecord::Leg& leg : record.legs) DrawLeg(record, leg);
    for (const sensing::RayRecord::PotentialHit& cell : record.potential_hits) DrawCell(cell);
  }

  void DrawLeg(const sensing::RayRecord& record, const sensing::RayRecord::Leg& leg) {
    const sensing::Fan& fan = record.fan;
    const double end = record.hit.range / fan.leg_length - leg.number;
    const auto at = [&](double fraction) {
      return point3_t(fan.x + (leg.number + fraction) * record.dx / 65536.0 * cell_,
                      fan.y + (leg.number + fraction) * record.dy / 65536.0 * cell_, z_);
    };
    for (const sensing::WalkStep& step : leg.steps) {
      if (step.from > end) break;
      if (step.kind == sensing::WalkStep::Kind::kHit) continue;
      painter_.SetColor(ColorOf(step.kind));
      painter_.Line(at(step.from), at(std::min(step.to, end)));
      if (step.kind != sensing::WalkStep::Kind::kCell && step.to <= end) {
        const point3_t landing = at(step.to);
        painter_.Point(landing.x, landing.y, landing.z);
      }
    }
  }

  void DrawCell(const sensing::RayRecord::PotentialHit& cell) {
    const bool stopped = std::ranges::any_of(cell.tests, [](const auto& test) {
      return test.answer == sensing::RayRecord::Answer::kAccepted;
    });
    painter_.SetColor(stopped ? Rgba{220, 0, 0, 255} : Rgba{255, 150, 0, 255});
    painter_.Rectangle(Bounds(cell.x * cell_, (cell.x + 1) * cell_),
                       Bounds(cell.y * cell_, (cell.y + 1) * cell_), z_);
  }

  static Rgba ColorOf(sensing::WalkStep::Kind kind) {
    switch (kind) {
      case sensing::WalkStep::Kind::kSuper:
        return {0, 0, 90, 255};
      case sensing::WalkStep::Kind::kRegion:
        return {0, 60, 200, 255};
      case sensing::WalkStep::Kind::kTile:
        return {0, 150, 230, 255};
      case sensing::WalkStep::Kind::kCell:
      case sensing::WalkStep::Kind::kHit:
        break;
    }
    return {90, 200, 120, 255};
  }

  World& world_;
  const Model& root_;
  const double cell_;
  double z_ = 0;
  Painter painter_;
};

}  // namespace

void DrawOccupancy(World& world, const view::Projection& projection, Painting* painting) {
  const grid::Grid& grid = world.engine().scene.grid;
  GridPicture(grid, 1 / world.Resolution(), projection, painting).Draw(grid.directory());
}

void DrawRays(World& world, const Model& root, Painting* painting) {
  RayPicture(world, root, painting).DrawTree(root, root.GetGlobalPose());
}

}  // namespace Stg::draw
