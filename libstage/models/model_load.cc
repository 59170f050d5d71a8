// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads models from world files and saves them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "geometry/load_error.hh"
#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/deletion_watch.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/picture_path.hh"
#include "models/power_pack.hh"
#include "models/property_checks.hh"
#include "models/warn_about.hh"
#include "pictures/trace.hh"
#include "worldfile/find_file.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

/// Thickness in metres of the rectangles that `boundary 1` adds.
constexpr double kBoundaryThickness = 0.01;

// Limited, because a macro may repeat these for thousands of models.
constexpr size_t kMaxControllers = 100;
constexpr size_t kMaxTextBytes = 1000;  // bytes

constexpr int kMaxPoints = 100000;
constexpr int kMaxTrail = 100000;

/// Reads whether the whole picture or only its dark part is fitted to the model's size.
bool ReadKeepsFrame(Worldfile* wf, int entity) {
  const std::string frame = wf->ReadString(entity, "bitmap_frame", "dark");
  if (frame != "dark" && frame != "picture")
    wf->Warn(
        entity, "bitmap_frame",
        "found " + messages::Quoted(frame) + ", expected \"dark\" or \"picture\"; using \"dark\"");
  return frame == "picture";
}

std::string TooLong(const std::string& text) {
  return "found a text of " + std::to_string(text.size()) + " bytes, expected at most " +
         std::to_string(kMaxTextBytes);
}

/// Outlines of the model's picture, which models share.
const picture::Outlines& OutlinesOfPicture(Host* host, Worldfile* wf, int entity,
                                           const std::string& name) {
  const std::string* const content = PictureInMemory(*host, name);
  const std::string key = KeyOfPicture(*host, wf, entity, "bitmap", name);
  auto& known = host->outlines_of_pictures;
  try {
    auto found = known.find(key);
    if (found != known.end()) return *found->second;
    messages::Progress("[Image \"" + messages::Shortened(name, messages::kMaxDetailBytes) + "\"]");
    auto outlines = std::make_shared<picture::Outlines>(
        content ? picture::OutlinesOf(*content, name) : picture::OutlinesOf(key));
    return *known.emplace(key, std::move(outlines)).first->second;
  } catch (const LoadError& error) {
    throw LoadError(wf->Where(entity, "bitmap") + ": " + error.what(), error.exit_status());
  }
}

}  // namespace

Visibility& Visibility::Load(Worldfile* wf, int entity) {
  blob_return = wf->ReadInt(entity, "blob_return", blob_return);
  fiducial_key = wf->ReadInt(entity, "fiducial_key", fiducial_key);
  fiducial_return = wf->ReadInt(entity, "fiducial_return", fiducial_return);
  gripper_return = wf->ReadInt(entity, "gripper_return", gripper_return);
  obstacle_return = wf->ReadInt(entity, "obstacle_return", obstacle_return);
  ranger_return = wf->ReadFloat(entity, "ranger_return", ranger_return);
  return *this;
}

void Visibility::Save(Worldfile* wf, int entity) {
  wf->WriteInt(entity, "blob_return", blob_return);
  wf->WriteInt(entity, "fiducial_key", fiducial_key);
  wf->WriteInt(entity, "fiducial_return", fiducial_return);
  wf->WriteInt(entity, "gripper_return", gripper_return);
  wf->WriteInt(entity, "obstacle_return", obstacle_return);
  wf->WriteFloat(entity, "ranger_return", ranger_return);
}

void Model::SetWorldfile(Worldfile* file, int entity) {
  wf = file;
  wf_entity = entity;
}

void Model::Load(Worldfile* file, int entity) {
  const RandomScope random_numbers(&random_);
  SetWorldfile(file, entity);
  Load();
}

void Model::Load() {
  if (!wf) return;
  const DeletionWatch watch(*this);          // callbacks may delete the model
  wf->ReadInt(wf_entity, "event_queue", 0);  // has no effect: it is overwritten at startup
  LoadEnergy();
  debug = wf->ReadInt(wf_entity, "debug", debug);
  LoadName();
  if (debug) messages::Progress("Model " + messages::Quoted(token) + " is in debug mode");

  Geom new_geom = geom;
  new_geom.pose.Load(wf, wf_entity, "origin");
  new_geom.size.Load(wf, wf_entity, "size");
  SetGeom(new_geom);
  if (watch.gone()) return;
  Pose new_pose = pose;
  SetPose(new_pose.Load(wf, wf_entity, "pose"));
  if (watch.gone()) return;
  color.Load(wf, wf_entity);
  // When loaded again, the model keeps its body (pictures do not change) and its controllers.
  if (!loaded_) LoadBody();

  stack_children = wf->ReadInt(wf_entity, "stack_children", stack_children);
  mass = wf->ReadFloat(wf_entity, "mass", mass);
  CheckNotNegative(*wf, wf_entity, "mass", mass);
  vis.Load(wf, wf_entity);
  LoadGuiState();
  map_resolution = wf->ReadFloat(wf_entity, "map_resolution", map_resolution);
  LoadContacts();
  if (!loaded_) LoadControllers();
  loaded_ = true;

  // At least one microsecond; an interval of zero means every step.
  const int milliseconds =
      wf->ReadInt(wf_entity, "update_interval", static_cast<int>(interval / 1000));
  if (milliseconds < 0)
    wf->Warn(wf_entity, "update_interval", "found a negative interval; updating in every step");
  interval = milliseconds > 0 ? static_cast<usec_t>(milliseconds) * 1000 : 1;
  const std::string text = wf->ReadString(wf_entity, "say", say_string);
  if (text.size() > kMaxTextBytes) wf->Fail(wf_entity, "say", TooLong(text));
  Say(text);
  LoadTrail();
  alwayson = wf->ReadInt(wf_entity, "alwayson", alwayson);
  if (alwayson && subs == 0) Subscribe();
  if (watch.gone()) return;

  blockgroup->Fit(geom.size);
  Map();
  CallCallbacks(CB_LOAD);
}

void Model::LoadTrail() {
  const auto count = [&](const char* name, unsigned int value, int min, int max) {
    const int found = wf->ReadInt(wf_entity, name, static_cast<int>(value));
    const int taken = std::clamp(found, min, max);
    if (taken != found)
      wf->Warn(wf_entity, name,
               std::string("found a ") + name + " of " + std::to_string(found) + "; using " +
                   std::to_string(taken));
    return static_cast<unsigned int>(taken);
  };
  trail_length = count("trail_length", trail_length, 0, kMaxTrail);
  if (world_base_->IsGUI() && wf->PropertyExists(wf_entity, "trail_length"))  // no trail otherwise
    host().memory.Take(*wf, wf_entity, "trail_length", trail_length, sizeof(TrailItem),
                       "items of a trail");
  trail_interval = count("trail_interval", trail_interval, 1, std::numeric_limits<int>::max());
}

bool Model::LoadCommon() {
  const DeletionWatch watch(*this);
  Model::Load();
  return !watch.gone() && wf;
}

void Model::LoadEnergy() {
  const auto read = [this](const char* name, double unit, bool is_stored) {
    if (!wf->PropertyExists(wf_entity, name)) return;
    const joules_t joules = wf->ReadFloat(wf_entity, name, 0) * unit;
    if (!std::isfinite(joules))
      wf->Fail(wf_entity, name,
               std::string("property \"") + name +
                   "\": found a number of joules that is too large, expected less than 1.8e308");
    if (!power_pack) power_pack = std::make_unique<PowerPack>(this);
    power_pack->SetCapacity(joules);
    if (is_stored) power_pack->SetStored(joules);
  };
  read("joules", 1, true);
  read("joules_capacity", 1, false);
  read("kjoules", 1000, true);
  read("kjoules_capacity", 1000, false);
  const auto read_watts = [this](const char* name, watts_t* value) {
    *value = wf->ReadFloat(wf_entity, name, *value);
    CheckNotNegative(*wf, wf_entity, name, *value);
  };
  read_watts("watts", &watts);
  read_watts("give_watts", &watts_give);
  read_watts("take_watts", &watts_take);
}

void Model::LoadName() {
  if (wf->PropertyExists(wf_entity, "name")) {
    const std::string name = wf->ReadString(wf_entity, "name", "");
    if (name.empty() || name == "/")
      wf->Warn(wf_entity, "name",
               "found an empty name, the model keeps " + messages::Quoted(token));
    else if (name[0] == '/')
      AssignName(name.substr(1));
    else
      AssignName(parent ? parent->TokenStr() + "." + name : name);
  }
  if (token.size() > kMaxTextBytes)
    wf->Fail(wf_entity, "name",
             "found a name of " + std::to_string(token.size()) +
                 " bytes, including the names of its ancestors, expected at most " +
                 std::to_string(kMaxTextBytes));
}

/// Warns about duplicate names: a lookup by name finds only the last model.
void Model::AssignName(const std::string& name) {
  const Model* holder = host().names.Find(name, host());
  if (holder && holder != this && holder->token == name)
    wf->Warn(wf_entity, "name",
             "found the name of an earlier model, expected another; a lookup finds the last one");
  SetToken(name);
}

void Model::LoadBody() {
  if (wf->ReadInt(wf_entity, "noblocks", 0) && has_default_block) {
    blockgroup->Clear();
    has_default_block = false;
  }
  if (wf->PropertyExists(wf_entity, "round")) LoadRoundBody();
  const bool keeps_frame = ReadKeepsFrame(wf, wf_entity);
  if (wf->PropertyExists(wf_entity, "bitmap")) LoadPicture(keeps_frame);
  boundary = wf->ReadInt(wf_entity, "boundary", boundary);
  if (boundary) AddBoundary();
}

/// A round body without blocks is drawn with many corners. Blocks of the world file replace it.
void Model::LoadRoundBody() {
  round_ = wf->ReadInt(wf_entity, "round", 0) != 0 ? 1 : 0;
  if (round_ == 0 || !has_default_block) return;
  constexpr int kCorners = 32;
  std::vector<point_t> circle;
  for (int i = 0; i < kCorners; i++) {
    const SineCosine at = SinCos(i * (2 * M_PI / kCorners));
    circle.emplace_back(0.5 * at.cosine, 0.5 * at.sine);
  }
  blockgroup->Clear();
  blockgroup->Add(std::move(circle), Bounds(0, 1));
  if (geom.size.x != geom.size.y) round_ = 0;  // an ellipse
}

/// Adds the outlines of a picture as blocks. `keeps_frame`: fits the whole picture to the size, not
/// only its dark part.
void Model::LoadPicture(bool keeps_frame) {
  const std::string name = wf->ReadString(wf_entity, "bitmap", "");
  if (name.empty())
    throw LoadError(wf->Where(wf_entity, "bitmap") + ": found an empty name, expected a picture",
                    255);
  const picture::Outlines& picture = OutlinesOfPicture(&host(), wf, wf_entity, name);
  const std::vector<std::vector<point_t>>& outlines = picture.polygons;
  if (outlines.empty())
    wf->Warn(wf_entity, "bitmap",
             "found a picture without a dark pixel, expected a body; no body is added");
  const size_t corners = std::accumulate(
      outlines.begin(), outlines.end(), size_t{0},
      [](size_t sum, const std::vector<point_t>& outline) { return sum + outline.size(); });
  host().memory.Take(*wf, wf_entity, "bitmap", corners, MemoryBudget::kCorner,
                     "corners of a picture");
  if (has_default_block) blockgroup->Clear();
  has_default_block = false;
  for (const std::vector<point_t>& outline : outlines) blockgroup->Add(outline, Bounds(0, 1));
  if (keeps_frame) blockgroup->SetFrame(Bounds(0, picture.width), Bounds(-picture.height, 0));
  blockgroup->Fit(geom.size);
}

void Model::AddBoundary() {
  blockgroup->Fit(geom.size);
  bounds3d_t box = blockgroup->BoundingBox();
  if (blockgroup->empty() || blockgroup->has_frame()) {
    box.x = Bounds(-geom.size.x / 2, geom.size.x / 2);
    box.y = Bounds(-geom.size.y / 2, geom.size.y / 2);
  }
  if (blockgroup->empty()) box.z = Bounds(0, geom.size.z);
  const double width = box.x.max - box.x.min, depth = box.y.max - box.y.min;
  const double t = kBoundaryThickness;
  blockgroup->AddRectangle(box.x.min, box.y.min, t, depth, box.z);
  blockgroup->AddRectangle(box.x.min, box.y.min, width, t, box.z);
  blockgroup->AddRectangle(box.x.min, box.y.max - t, width, t, box.z);
  blockgroup->AddRectangle(box.x.max - t, box.y.min, t, depth, box.z);
}

void Model::LoadBlock(Worldfile* file, int entity) {
  const int count = file->ReadInt(entity, "points", 0);
  if (count < 0 || count > kMaxPoints)
    file->Fail(entity, "points",
               "found " + std::to_string(count) + " points, expected a number from 0 to " +
                   std::to_string(kMaxPoints));
  host().memory.Take(*file, entity, "points", static_cast<size_t>(count), MemoryBudget::kCorner,
                     "points");
  std::vector<point_t> points(static_cast<size_t>(count));
  int points_found = 0;
  for (int i = 0; i < count; i++) {
    const std::string name = "point[" + std::to_string(i) + "]";
    point_t& p = points[static_cast<size_t>(i)];
    if (file->ReadTuple(entity, name.c_str(), 0, 2, "ll", &p.x, &p.y) > 0) points_found++;
  }
  if (points_found < count)
    file->Warn(entity, "points",
               "found " + std::to_string(points_found) + " of " + std::to_string(count) +
                   " points; the others are [0 0]");
  const bool has_heights = file->PropertyExists(entity, "z");
  Bounds z;
  z.Load(file, entity, "z");
  CheckInOrder(*file, entity, "z", &z, 1);
  OrientPolygon(&points);

  if (has_default_block) {
    blockgroup->Clear();
    has_default_block = false;
  }
  if (has_heights)
    blockgroup->Add(std::move(points), z);
  else
    blockgroup->AddWithoutHeights(std::move(points));
}

void Model::LoadGuiState() {
  gui.nose = wf->ReadInt(wf_entity, "gui_nose", gui.nose);
  gui.grid = wf->ReadInt(wf_entity, "gui_grid", gui.grid);
  gui.move = wf->ReadInt(wf_entity, "gui_move", gui.move);
  gui.outline = wf->ReadInt(wf_entity, "gui_outline", gui.outline);
}

void Model::LoadControllers() {
  wf->ReadElement(wf_entity, "ctrl", 0);  // marks an empty list as read too
  const size_t count = wf->TupleLength(wf_entity, "ctrl");
  if (count > kMaxControllers)
    wf->Fail(wf_entity, "ctrl",
             "found " + std::to_string(count) + " controllers, expected at most " +
                 std::to_string(kMaxControllers));
  for (size_t i = 0; i < count; i++) {
    const std::string text = wf->ReadElement(wf_entity, "ctrl", i);
    if (text.size() > kMaxTextBytes) wf->Fail(wf_entity, "ctrl", TooLong(text));
    if (text.find_first_not_of(" \t") == std::string::npos) {
      wf->Warn(wf_entity, "ctrl", "found an empty controller name; ignored");
      continue;
    }
    if (!host().loads_controllers) {
      host().controllers_left_out++;
      continue;
    }
    try {
      host().LoadController(this, text);
      controllers_++;
    } catch (const LoadError& error) {
      throw LoadError(wf->Where(wf_entity, "ctrl") + ": " + error.what(), error.exit_status());
    }
  }
}

void Model::LoadControllerModule(const char* lib) {
  try {
    host().LoadController(this, lib);
    controllers_++;
  } catch (const LoadError& error) {
    WarnAbout(*this, "%s", error.what());
  }
}

void Model::InitControllers() {
  try {
    InitOrThrow();
  } catch (const LoadError& error) {
    messages::Report(LogLevel::kError, error.what());
  }
}

void Model::Save() {
  if (!wf) return;
  Pose saved = pose;
  saved.Save(wf, wf_entity, "pose");
  geom.size.Save(wf, wf_entity, "size");
  Pose origin = geom.pose;
  origin.a = normalize(origin.a);
  origin.Save(wf, wf_entity, "origin");
  vis.Save(wf, wf_entity);
  CallCallbacks(CB_SAVE);
}

bool Model::SaveCommon() {
  const DeletionWatch watch(*this);
  Model::Save();
  return !watch.gone() && wf;
}

}  // namespace Stg
