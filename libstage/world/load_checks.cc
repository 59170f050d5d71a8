// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/load_checks.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/field.hh"
#include "models/groundsensor.hh"
#include "models/picture_path.hh"
#include "pictures/trace.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

/// Formats a length for a message.
std::string Metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g m", value);
  return text;
}

std::string Pixels(double count) { return std::to_string(std::llround(count)); }

/// Widths in pixels of the light margins between a picture's edges and its dark pixels.
struct Margins {
  double left = 0, right = 0, top = 0, bottom = 0;
};

Margins MarginsOf(const picture::Outlines& picture) {
  const double far = std::numeric_limits<double>::infinity();
  Bounds x(far, -far), y(far, -far);
  for (const std::vector<point_t>& polygon : picture.polygons) {
    for (const point_t& corner : polygon) {
      x = Bounds(std::min(x.min, corner.x), std::max(x.max, corner.x));
      y = Bounds(std::min(y.min, corner.y), std::max(y.max, corner.y));
    }
  }
  return {x.min, picture.width - x.max, -y.max, picture.height + y.min};
}

}  // namespace

void CheckFieldNames(const Host& host, const std::vector<Model*>& made, const Worldfile& wf) {
  if (host.ground_sensors.empty()) return;
  for (size_t entity = 1; entity < made.size(); entity++) {
    const auto* const sensor = dynamic_cast<const ModelGroundSensor*>(made[entity]);
    if (!sensor || sensor->field_name().empty() || sensor->GetField()) continue;
    std::string known;
    for (const ModelField* field : host.fields)
      known += (known.empty() ? "" : ", ") + messages::Quoted(field->TokenStr());
    wf.Fail(static_cast<int>(entity), "field",
            "found the field " + messages::Quoted(sensor->field_name()) +
                ", expected the name of a field (" + (known.empty() ? "there is none" : known) +
                ")");
  }
}

void World::LoadChecks::Run() {
  for (const Model* model : engine_.models) {
    if (model->wf_entity <= 0) continue;
    CheckSize(*model);
    CheckHeight(*model);
    CheckPicture(*model);
    CheckAcceleration(*model);
  }
  CheckRangers();
  CheckStarts();
}

void World::LoadChecks::WarnLikelyMistake(int entity, const char* property,
                                          const std::string& message) {
  if (Keep(wf_.Where(entity, property) + ": " + message)) wf_.Warn(entity, property, message);
}

bool World::LoadChecks::Keep(const std::string& line) {
  if (!warned_.insert(line).second) return false;
  engine_.load_warnings.push_back(line);
  return true;
}

/// Only --explain mentions this: many worlds for Stage 4.3 state bounds that have no effect there.
void World::LoadChecks::CheckAcceleration(const Model& model) {
  constexpr char kBounds[] = "acceleration_bounds";
  if (!wf_.PropertyExists(model.wf_entity, kBounds) ||
      wf_.PropertyExists(model.wf_entity, "limit_acceleration") ||
      !dynamic_cast<const ModelPosition*>(&model))
    return;
  Keep(wf_.Where(model.wf_entity, kBounds) +
       ": acceleration_bounds limit only commands of acceleration, as in Stage 4.3; "
       "limit_acceleration 1 makes them limit every command, limit_acceleration 0 silences this "
       "line");
}

// ---- bodies -------------------------------------------------------------------------------------

void World::LoadChecks::CheckSize(const Model& model) {
  const Size& size = model.geom.size;
  if (!(size.x < 0 || size.y < 0 || size.z < 0)) return;
  if (wf_.PropertyExists(model.wf_entity, "size"))
    WarnLikelyMistake(model.wf_entity, "size",
                      "found a negative size, expected 0 or more; it mirrors the body");
}

void World::LoadChecks::CheckHeight(const Model& model) {
  if (model.vis.ranger_return < 0 || !model.body().IsFlat()) return;
  const bool flattened = model.geom.size.z == 0;
  const int block = flattened ? -1 : FirstBlockOf(model.wf_entity);
  WarnLikelyMistake(
      block > 0 ? block : model.wf_entity, block > 0 ? "z" : "size",
      std::string("found a body without height, which rangers see at one height alone; expected ") +
          (block > 0 ? "z [BOTTOM TOP] with a top above the bottom"
                     : "a size whose third number is above 0"));
}

int World::LoadChecks::FirstBlockOf(int entity) {
  if (first_blocks_.empty()) {
    first_blocks_[0] = 0;  // marks the map as filled
    for (int block = 1; block < wf_.GetEntityCount(); block++)
      if (std::string_view(wf_.GetEntityType(block)) == "block")
        first_blocks_.try_emplace(wf_.GetEntityParent(block), block);
  }
  const auto found = first_blocks_.find(entity);
  return found == first_blocks_.end() ? -1 : found->second;
}

// ---- pictures -----------------------------------------------------------------------------------

void World::LoadChecks::CheckPicture(const Model& model) {
  if (!wf_.PropertyExists(model.wf_entity, "bitmap") ||
      wf_.PropertyExists(model.wf_entity, "bitmap_frame"))
    return;
  const std::string name = wf_.ReadString(model.wf_entity, "bitmap", "");
  const auto found = engine_.outlines_of_pictures.find(
      KeyOfPicture(engine_, &wf_, model.wf_entity, "bitmap", name));
  if (found == engine_.outlines_of_pictures.end() || found->second->polygons.empty()) return;
  const picture::Outlines& picture = *found->second;
  const Margins margins = MarginsOf(picture);
  const double x = std::max(margins.left, margins.right) / picture.width;
  const double y = std::max(margins.top, margins.bottom) / picture.height;
  const double moved = std::max(x * std::fabs(model.geom.size.x), y * std::fabs(model.geom.size.y));
  if (moved * engine_.scene.cells_per_metre <= 1) return;
  WarnLikelyMistake(
      model.wf_entity, "bitmap",
      "found a picture with light margins (pixels: left " + Pixels(margins.left) + ", right " +
          Pixels(margins.right) + ", top " + Pixels(margins.top) + ", bottom " +
          Pixels(margins.bottom) + "), which are cut off before the rest is stretched to size: " +
          "that moves walls by up to " + Metres(moved) +
          "; bitmap_frame \"picture\" keeps the margins, bitmap_frame \"dark\" silences this "
          "warning");
}

// ---- visibility of robots to rangers ------------------------------------------------------------

void World::LoadChecks::CheckRangers() {
  if (!FindSeenRobots()) return;
  for (const Model* model : engine_.models)
    if (const auto* ranger = dynamic_cast<const ModelRanger*>(model)) CheckRanger(*ranger);
}

/// Collects robots visible to rangers by height. False if there are fewer than two robots.
bool World::LoadChecks::FindSeenRobots() {
  const Model* first = nullptr;
  bool several = false;
  for (const Model* model : engine_.models) {
    if (!dynamic_cast<const ModelPosition*>(model->root)) continue;
    if (!first) first = model->root;
    several |= model->root != first;
    if (model->vis.ranger_return < 0) continue;
    const double lift = model->GetGlobalPose().z + model->geom.pose.z;
    for (const auto& block : model->body().blocks()) {
      auto& robots = seen_robots_[{block->z_range().min + lift, block->z_range().max + lift}];
      if (!robots[0]) robots[0] = model->root;
      if (robots[0] != model->root) robots[1] = model->root;
    }
  }
  return several;
}

bool World::LoadChecks::SeesRobot(double z, const Model* own_root) const {
  return std::ranges::any_of(seen_robots_, [&](const auto& seen) {
    const auto& [heights, robots] = seen;
    return heights.first <= z && z <= heights.second &&
           (robots[0] != own_root || (robots[1] && robots[1] != own_root));
  });
}

void World::LoadChecks::CheckRanger(const ModelRanger& ranger) {
  if (ranger.wf_entity <= 0) return;
  const Pose frame = ranger.SensorFrame(ranger.GetGlobalPose());
  const SineCosine turn = SinCos(frame.a);
  double lowest = std::numeric_limits<double>::infinity();
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    if (sensor.sample_count == 0) continue;
    const double z = ModelRanger::OriginOf(sensor, frame, turn).z;
    if (SeesRobot(z, ranger.root)) return;
    lowest = std::min(lowest, z);
  }
  if (!std::isfinite(lowest)) return;
  double highest = 0;
  for (const auto& [heights, robots] : seen_robots_) highest = std::max(highest, heights.second);
  WarnLikelyMistake(
      ranger.wf_entity, "pose",
      "found sensors at a height of " + Metres(lowest) +
          ", where no other robot has a body, so that they see none (bodies of robots reach up "
          "to " +
          Metres(highest) +
          "); expected a ranger whose z, or robots whose size, makes them visible to each other");
}

}  // namespace Stg
