// SPDX-License-Identifier: GPL-2.0-or-later

#include "scene.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "canvas.hh"
#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/light.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "models/robot_marks.hh"
#include "models/types/glow.hh"
#include "models/types/light_index.hh"
#include "random/random.hh"
#include "world/world.hh"

namespace Stg::python {

namespace {

class Words {
 public:
  void Add(uint32_t word) { bytes_.append(reinterpret_cast<const char*>(&word), sizeof word); }
  void Add(double value) { Add(std::bit_cast<uint32_t>(static_cast<float>(value))); }
  void Add(const Canvas::Ink& ink) {
    const uint8_t parts[] = {ink.red, ink.green, ink.blue, ink.opacity};
    bytes_.append(reinterpret_cast<const char*>(parts), sizeof parts);
  }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

bool IsRobot(const Model& model) { return dynamic_cast<const ModelPosition*>(&model) != nullptr; }

bool IsThing(const Model& model) { return !model.Parent() || IsRobot(model); }

/// The blocks of one model that share a height range.
struct Area {
  const Model* model;
  Pose frame;  // frame of the model's body, relative to the thing
  Bounds z;
  Bounds blocks;  // height range of the blocks in the body's frame
};

/// `whole`: with everything that the model carries except for robots.
void AddAreas(const Model& model, const Pose& pose, double ground, bool whole,
              std::vector<Area>* areas) {
  Pose frame = pose + model.GetGeom().pose;
  frame.z = model.GetGlobalPose().z + model.GetGeom().pose.z - ground;
  std::vector<Bounds> known;
  for (const auto& block : model.body().blocks()) {
    const Bounds& range = block->z_range();
    const auto same = [&](const Bounds& b) { return b.min == range.min && b.max == range.max; };
    if (std::any_of(known.begin(), known.end(), same)) continue;
    known.push_back(range);
    areas->push_back({&model, frame, Bounds(frame.z + range.min, frame.z + range.max), range});
  }
  if (!whole) return;
  for (const Model* child : model.GetChildren())
    if (!IsThing(*child)) AddAreas(*child, pose + child->GetPose(), ground, true, areas);
}

void AddOutlines(const Area& area, Words* words) {
  const SineCosine turn = SinCos(area.frame.a);
  const auto belongs = [&](const Block& block) {
    return block.z_range().min == area.blocks.min && block.z_range().max == area.blocks.max;
  };
  const auto& blocks = area.model->body().blocks();
  words->Add(static_cast<uint32_t>(
      std::count_if(blocks.begin(), blocks.end(), [&](const auto& b) { return belongs(*b); })));
  for (const auto& block : blocks) {
    if (!belongs(*block)) continue;
    words->Add(static_cast<uint32_t>(block->points().size()));
    for (const point_t& p : block->points()) {
      words->Add(area.frame.x + p.x * turn.cosine - p.y * turn.sine);
      words->Add(area.frame.y + p.x * turn.sine + p.y * turn.cosine);
    }
  }
}

/// Adds the robot's nose as a thin area on top of everything else.
void AddNose(const Model& model, double top, Words* words) {
  constexpr double kThickness = 0.005;  // metres
  const Canvas::Ink ink = Canvas::Ink::Of(NoseColor(model.GetShownColor()));
  const std::optional<Nose> nose = NoseOf(model.body(), model.GetGeom().pose);
  if (!nose || !model.HasGuiNose() || ink.opacity == 0) return;
  words->Add(ink);
  words->Add(top);
  words->Add(top + kThickness);
  words->Add(uint32_t{1});
  words->Add(static_cast<uint32_t>(nose->size()));
  for (const point_t& corner : *nose) {
    words->Add(corner.x);
    words->Add(corner.y);
  }
}

/// Sorts the areas from low to high, and adds those that are visible.
void AddSorted(std::vector<Area>* areas, Words* words) {
  std::stable_sort(areas->begin(), areas->end(),
                   [](const Area& a, const Area& b) { return a.z.max < b.z.max; });
  for (const Area& area : *areas) {
    const Canvas::Ink ink = Canvas::Ink::Of(area.model->GetShownColor());
    if (ink.opacity == 0) continue;
    words->Add(ink);
    words->Add(area.z.min);
    words->Add(area.z.max);
    AddOutlines(area, words);
  }
}

Thing Describe(const Model& model) {
  const double ground = model.GetGlobalPose().z;
  std::vector<Area> areas;
  AddAreas(model, Pose(), ground, true, &areas);
  Words words;
  AddSorted(&areas, &words);
  if (!areas.empty()) AddNose(model, areas.back().z.max, &words);
  Thing thing;
  thing.id = model.GetId();
  thing.name = model.TokenStr();
  thing.type = model.GetModelType();
  thing.robot = IsRobot(model);
  thing.movable = model.IsMovable();
  thing.ground = static_cast<float>(ground);
  thing.top = static_cast<float>(ground + (areas.empty() ? 0 : areas.back().z.max));
  thing.shape = std::move(words.bytes());
  return thing;
}

uint64_t Bits(double value) { return std::bit_cast<uint64_t>(value); }

uint64_t KeyOf(const Model& model) {
  uint64_t key = model.GetId();
  const auto mix = [&](uint64_t part) { key = MixSeeds(key, part); };
  const Model* const parent = model.Parent();
  mix(parent ? parent->GetId() + uint64_t{1} : 0);
  mix(model.body().version());
  mix(std::bit_cast<uint32_t>(Canvas::Ink::Of(model.GetShownColor())));
  const Pose local = model.GetGeom().pose;
  for (const double part : {local.x, local.y, local.z, local.a}) mix(Bits(part));
  mix(Bits(model.GetPose().z));
  if (IsThing(model)) return key;
  const Pose pose = model.GetPose();
  for (const double part : {pose.x, pose.y, pose.a}) mix(Bits(part));
  return key;
}

/// Time of the world's state that the ranger sensed: the beginning of the step in which it last
/// updated.
usec_t TimeOfScan(const ModelRanger& ranger) {
  const usec_t step = ranger.GetWorld()->sim_interval, end = ranger.GetLastUpdate();
  return end > step ? end - step : 0;
}

/// Global pose of the thing when the ranger on it sensed. NaN if another model of the thing's tree
/// has updated since, because a tree keeps only its newest such pose.
Pose PlaceAtScan(const Model& thing, const ModelRanger& ranger) {
  const auto* const robot = dynamic_cast<const ModelPosition*>(&thing);
  if (!robot || !robot->HasSubscribers()) return thing.GetGlobalPose();
  if (robot->GetSensedTime() == ranger.GetLastUpdate()) return robot->GetSensedPose();
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  return Pose(kNone, kNone, kNone, kNone);
}

/// Returns false if the scan has more than `*room` samples.
bool AddScan(const ModelRanger& ranger, const ModelRanger::Sensor& sensor, const Model& thing,
             size_t* capacity, Words* words) {
  const size_t count = sensor.ranges.size();
  if (count == 0 || sensor.bearings.size() != count) return true;
  if (count > *capacity) return false;
  *capacity -= count;
  const Pose frame = ranger.SensorFrame(ranger.GetScanPose());
  const Pose origin = ModelRanger::OriginOf(sensor, frame, SinCos(frame.a));
  const Pose place = PlaceAtScan(thing, ranger);
  const usec_t time = TimeOfScan(ranger);
  words->Add(thing.GetId());
  words->Add(static_cast<uint32_t>(count));
  words->Add(static_cast<uint32_t>(time));
  words->Add(static_cast<uint32_t>(time >> 32));
  for (const double part :
       {place.x, place.y, place.a, origin.x, origin.y, origin.a, sensor.fov, sensor.Reach()})
    words->Add(part);
  for (const double range : sensor.ranges) words->Add(range);
  for (const double bearing : sensor.bearings) words->Add(bearing);
  return true;
}

bool AddScans(const Model& model, const Model& thing, size_t* capacity, Words* words) {
  if (const auto* const ranger = dynamic_cast<const ModelRanger*>(&model))
    for (const ModelRanger::Sensor& sensor : ranger->GetSensors())
      if (!AddScan(*ranger, sensor, thing, capacity, words)) return false;
  for (const Model* child : model.GetChildren())
    if (!IsThing(*child) && !AddScans(*child, thing, capacity, words)) return false;
  return true;
}

}  // namespace

std::vector<Thing> ThingsOf(World& world) {
  std::vector<Thing> things;
  for (const Model* model : world.host().models)
    if (model != world.GetGround() && IsThing(*model)) things.push_back(Describe(*model));
  std::stable_sort(things.begin(), things.end(), [](const Thing& a, const Thing& b) {
    return a.robot != b.robot ? b.robot : !a.robot && a.top < b.top;
  });
  return things;
}

std::string BodyOf(const Model& model) {
  std::vector<Area> areas;
  AddAreas(model, Pose(), model.GetGlobalPose().z, false, &areas);
  Words words;
  AddSorted(&areas, &words);
  return std::move(words.bytes());
}

uint64_t SceneKey(World& world) {
  uint64_t key = world.host().models.size();
  for (const Model* model : world.host().models) key = MixSeeds(key, KeyOf(*model));
  return key;
}

void PlacesOf(World& world, const uint32_t* ids, size_t count, float* places, bool* stalled) {
  for (size_t i = 0; i < count; i++, places += 3) {
    const Model* const model = world.FindModel(ids[i]);
    stalled[i] = model && model->Stalled();
    if (model) {
      const Pose pose = model->GetGlobalPose();
      places[0] = static_cast<float>(pose.x);
      places[1] = static_cast<float>(pose.y);
      places[2] = static_cast<float>(pose.a);
    } else {
      std::fill(places, places + 3, std::numeric_limits<float>::quiet_NaN());
    }
  }
}

std::string ScansOf(World& world, const uint32_t* ids, size_t count, size_t max_samples) {
  Words words;
  for (size_t i = 0; i < count; i++)
    if (const Model* const model = world.FindModel(ids[i]))
      if (!AddScans(*model, *model, &max_samples, &words)) break;
  return std::move(words.bytes());
}

std::string GlowsOf(World& world) {
  Words words;
  for (const LightSource* light : world.host().lights->sources()) {
    const double radius = GlowRadius(*light);
    if (radius == 0) continue;
    const Model& model = light->model();
    const Pose place = model.GetGlobalPose() + model.GetGeom().pose;
    words.Add(place.x);
    words.Add(place.y);
    words.Add(radius);
    words.Add(Canvas::Ink::Of(model.GetColor()));
  }
  return std::move(words.bytes());
}

}  // namespace Stg::python
