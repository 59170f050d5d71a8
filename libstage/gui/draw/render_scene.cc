// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/render_scene.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "gui/draw/debug_picture.hh"
#include "gui/draw/field_picture.hh"
#include "gui/draw/light_picture.hh"
#include "gui/draw/model_pictures.hh"
#include "gui/draw/painter.hh"
#include "gui/draw/scene_job.hh"
#include "gui/draw/type_picture.hh"
#include "models/body.hh"
#include "models/energy_charts.hh"
#include "models/light.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "models/robot_marks.hh"
#include "models/visualizer.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg::draw {

using view::Show;

bool Selection::Has(const Model* model) const {
  return std::find(models.begin(), models.end(), model) != models.end();
}

std::size_t RenderScene::fans_in_view() const {
  std::size_t count = 0;
  for (const FanGroup& group : frame_.fans) count += group.fans.size();
  return count;
}

void RenderScene::Update(World& world, const view::ViewState& view, int width, int height,
                         const Selection& selection) {
  if (world_ != &world || topology_version_ != world.engine().topology_version) Rebuild(world);
  if (body_version_ != world.engine().scene.body_changes) UpdateShapes(world);
  const Job job{world, view, selection, width, height};
  Begin(job);
  AddBodies(job);
  if (min_z_ < frame_.depths.min || max_z_ > frame_.depths.max) {
    Begin(job);  // something is outside of the last frame's z range
    AddBodies(job);
  }
  if (view.options[Show::kGrid])
    DrawAxisNumbers(frame_.floor_x, frame_.floor_y, frame_.step, *frame_.projection, &frame_.floor);
  if (view.options[Show::kFields] && !world.host().fields.empty()) DrawFields(world, &frame_.floor);
  if (view.options[Show::kLights])
    for (const LightSource* light : lights_) DrawGlow(*light, &frame_.floor);
  if (view.options[Show::kOccupancy]) DrawOccupancy(world, *frame_.projection, &frame_.floor);
  for (Model* model : selection.models)
    DrawSelected(*model, *frame_.projection, &frame_.marks, &frame_.over);
  if (job.shows_data()) AddData(job);
  if (view.options[Show::kRays] && selection.last)
    DrawRays(world, *selection.last->Root(), &frame_.over);
  Painter lines(&frame_.over);
  for (const World::RecordedRay& ray : world.recorded_rays()) {
    lines.SetColor(ToRgba(ray.color));
    lines.Line({ray.x1, ray.y1, 0.1}, {ray.x2, ray.y2, 0.1});
  }
}

// ---- list of models -----------------------------------------------------------------------------

RenderScene::Kind RenderScene::KindOf(const Model& model) {
  if (dynamic_cast<const ModelPosition*>(&model)) return Kind::kPosition;
  if (dynamic_cast<const ModelRanger*>(&model)) return Kind::kRanger;
  const TypePicture* const picture = FindPicture(model);
  return picture && picture->draw ? Kind::kOther : Kind::kPlain;
}

void RenderScene::Rebuild(World& world) {
  world_ = &world;
  topology_version_ = world.engine().topology_version;
  body_version_ = world.engine().scene.body_changes;
  items_.clear();
  lights_.clear();
  robots_ = 0;
  // The old batches keep shapes alive until all models are added, so that they can be reused.
  std::vector<BodyBatch> old = std::move(frame_.bodies);
  frame_.bodies.clear();
  for (Model* model : world.GetChildren()) AddTree(model, kNone);
  old.clear();
  shapes_.Tidy();
}

void RenderScene::AddTree(Model* model, uint32_t parent) {
  const auto index = static_cast<uint32_t>(items_.size());
  Item item{};
  item.model = model;
  item.parent = parent;
  item.kind = KindOf(*model);
  item.is_of_robot =
      item.kind == Kind::kPosition || (parent != kNone && items_[parent].is_of_robot);
  item.has_children = !model->GetChildren().empty();
  item.cosine = 1;
  items_.push_back(item);
  FindShape(&items_.back());
  if (const auto* light = dynamic_cast<const LightSource*>(model)) lights_.push_back(light);
  robots_ += item.kind == Kind::kPosition && items_.back().batch != kNone;
  for (Model* child : model->GetChildren()) AddTree(child, index);
}

void RenderScene::FindShape(Item* item) {
  const BlockGroup& body = item->model->body();
  item->version = body.version();
  item->batch = body.empty() ? kNone : BatchOf(shapes_.Find(body, item->model->GetGeom().pose));
  item->is_leaf = item->batch == kNone && item->parent != kNone && !item->has_children;
}

void RenderScene::UpdateShapes(World& world) {
  body_version_ = world.engine().scene.body_changes;
  for (Item& item : items_)
    if (item.version != item.model->body().version()) FindShape(&item);
  DropUnusedBatches();
}

uint32_t RenderScene::BatchOf(const std::shared_ptr<const Shape>& shape) {
  uint32_t free = static_cast<uint32_t>(frame_.bodies.size());
  for (uint32_t i = 0; i < frame_.bodies.size(); i++) {
    if (frame_.bodies[i].shape == shape) return i;
    if (!frame_.bodies[i].shape) free = i;
  }
  if (free == frame_.bodies.size()) frame_.bodies.emplace_back();
  frame_.bodies[free].shape = shape;
  return free;
}

/// Releases shapes that no model uses any more, such as earlier openings of a gripper.
void RenderScene::DropUnusedBatches() {
  std::vector<bool> used(frame_.bodies.size(), false);
  for (const Item& item : items_)
    if (item.batch != kNone) used[item.batch] = true;
  for (size_t i = 0; i < used.size(); i++)
    if (!used[i]) frame_.bodies[i].shape.reset();
  shapes_.Tidy();
}

void RenderScene::PlaceItem(Item* item) {
  const Pose pose = item->model->GetPose();
  if (item->parent == kNone) {
    item->x = pose.x;
    item->y = pose.y;
    item->z = pose.z;
    item->a = pose.a;
  } else {
    const Item& parent = items_[item->parent];
    item->x = parent.x + pose.x * parent.cosine - pose.y * parent.sine;
    item->y = parent.y + pose.x * parent.sine + pose.y * parent.cosine;
    item->z = parent.z + pose.z;
    if (parent.model->StacksChildren()) item->z += parent.model->GetGeom().size.z;
    item->a = parent.a + pose.a;
  }
  if (!item->has_children) return;
  item->sine = std::sin(item->a);
  item->cosine = std::cos(item->a);
}

// ---- frame --------------------------------------------------------------------------------------

void RenderScene::Begin(const Job& job) {
  Frame& f = frame_;
  f.flat = job.view.flat;
  f.perspective = job.view.perspective;
  f.is_perspective = job.view.is_perspective();
  f.keep_last = job.view.options[Show::kTrailFast];
  f.checked_floor = job.view.options[Show::kGrid];
  f.step = AxisStep(job.view.flat.scale());
  const bounds3d_t extent = job.world.GetExtent();
  f.floor_x = extent.x;
  f.floor_y = extent.y;
  bounds3d_t reach = extent;
  f.depths = reach.z = Bounds(min_z_ - 10, max_z_ + 10);
  f.projection.emplace(job.view, job.width, job.height, reach);
  pixel_ = f.is_perspective ? 0 : f.projection->PixelAt(point3_t());
  f.dots.clear();
  f.dot_width = static_cast<float>(DotWidth(robots_));
  items_with_nose_.clear();
  for (Painting* painting : {&f.floor, &f.solid, &f.marks, &f.data, &f.over}) painting->Clear();
  for (BodyBatch& batch : f.bodies) {
    batch.solid.clear();
    batch.robots.clear();
    batch.translucent.clear();
    batch.footprints.clear();
    batch.noses.clear();
  }
  for (FanGroup& group : f.fans) group.fans.clear();
  f.ray_ends.clear();
  f.visuals.clear();
  f.stalled.clear();
  f.chart_count = 0;
}

/// Prefetches a model a few items ahead: models are scattered over the memory.
void RenderScene::Prefetch(size_t index) const {
  constexpr size_t kAhead = 12, kLine = 64;
  if (index + kAhead >= items_.size()) return;
  const Item& item = items_[index + kAhead];
  const char* last = reinterpret_cast<const char*>(&item.model->speech());
  const char* first = reinterpret_cast<const char*>(&item.model->visualizers()) - kLine;
  for (const char* line = item.is_leaf ? last : first; line <= last + kLine; line += kLine)
    __builtin_prefetch(line);
}

void RenderScene::AddBodies(const Job& job) {
  bodies_in_view_ = 0;
  min_z_ = 0;
  max_z_ = 1;
  const bool all = job.shows_data() || job.view.options[Show::kBoundingBoxes];
  for (size_t i = 0; i < items_.size(); i++) {
    Prefetch(i);
    Item& item = items_[i];
    const bool silent = item.is_leaf && item.model->speech().empty() && !item.model->Stalled();
    if (silent && !all) continue;
    PlaceItem(&item);
    item.is_dot = item.parent != kNone && items_[item.parent].is_dot;
    if (item.batch != kNone) AddBody(job, &item);
    if (item.parent == kNone && item.kind == Kind::kPosition) AddTrails(job, item);
    AddExtras(job, item);
  }
  AddNoses(job);
}

namespace {

Instance InstanceAt(double x, double y, double z, double a, const Rgba& color) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z),
          static_cast<float>(a), color};
}

Color ShownColor(const Model& model, const view::ViewOptions& options) {
  return options[Show::kBlink] ? model.GetShownColor() : model.GetColor();
}

}  // namespace

void RenderScene::AddBody(const Job& job, Item* item) {
  BodyBatch& batch = frame_.bodies[item->batch];
  const Shape& shape = *batch.shape;
  min_z_ = std::min(min_z_, item->z + shape.bottom);
  max_z_ = std::max(max_z_, item->z + shape.top);
  if (!job.view.options[Show::kBlocks]) return;
  if (!frame_.projection->Sees(item->x, item->y, item->z, shape.radius)) return;
  const Rgba color = ToRgba(ShownColor(*item->model, job.view.options));
  if (color.a == 0) return;
  bodies_in_view_++;
  if (AddDot(item, shape, color)) return;
  (color.a < 255       ? batch.translucent
   : item->is_of_robot ? batch.robots
                       : batch.solid)
      .push_back(InstanceAt(item->x, item->y, item->z, item->a, color));
  if (!shape.nose.empty() && item->model->HasGuiNose() && !IsNarrow(*item, shape, kNoseWidth))
    items_with_nose_.push_back(static_cast<std::size_t>(item - items_.data()));
}

bool RenderScene::IsNarrow(const Item& item, const Shape& shape, double pixels) const {
  const double pixel =
      pixel_ > 0 ? pixel_ : frame_.projection->PixelAt(point3_t(item.x, item.y, item.z));
  return 2 * shape.reach < pixels * pixel;
}

/// Adds a dot for a robot that is too small to see. Returns true if the body itself must not be
/// drawn: its dot, or that of its robot, stands for it.
bool RenderScene::AddDot(Item* item, const Shape& shape, const Rgba& color) {
  const bool is_part = item->is_dot;
  item->is_dot = (is_part || item->kind == Kind::kPosition) &&
                 IsNarrow(*item, shape, double{frame_.dot_width});
  if (item->is_dot && !is_part)
    frame_.dots.push_back({static_cast<float>(item->x), static_cast<float>(item->y),
                           static_cast<float>(item->z + shape.top), color});
  return item->is_dot;
}

void RenderScene::AddNoses(const Job& job) {
  for (const std::size_t index : items_with_nose_) {
    const Item& item = items_[index];
    const Color body = ShownColor(*item.model, job.view.options);
    frame_.bodies[item.batch].noses.push_back(
        InstanceAt(item.x, item.y, HeightOfNose(index), item.a, ToRgba(NoseColor(body))));
  }
}

/// Returns a height just above the robot and its parts, which follow it in the list of items.
double RenderScene::HeightOfNose(std::size_t index) const {
  constexpr double kAbove = 0.005;  // metres
  const Item& robot = items_[index];
  const Shape& shape = *frame_.bodies[robot.batch].shape;
  const Corner &tip = shape.nose[0], &left = shape.nose[1];
  const double middle = 0.5 * (double{tip.x} + double{left.x});
  const double radius = std::hypot(double{tip.x} - middle, double{left.y} - double{tip.y});
  const SineCosine turn = SinCos(robot.a);
  const double x = robot.x + middle * turn.cosine - double{tip.y} * turn.sine;
  const double y = robot.y + middle * turn.sine + double{tip.y} * turn.cosine;
  double top = robot.z + shape.top;
  for (std::size_t i = index + 1; i < items_.size(); i++) {
    const Item& part = items_[i];
    if (part.parent == kNone || part.parent < index) break;
    if (part.batch == kNone) continue;
    const Shape& its = *frame_.bodies[part.batch].shape;
    const double away = std::hypot(part.x - x, part.y - y);
    if (away < radius + its.reach) top = std::max(top, part.z + its.top);
  }
  return top + kAbove;
}

void RenderScene::AddTrails(const Job& job, const Item& item) {
  const view::ViewOptions& options = job.view.options;
  const bool footprints = options[Show::kFootprints], blocks = options[Show::kTrailBlocks],
             arrows = options[Show::kTrailArrows];
  if (!footprints && !blocks && !arrows) return;
  constexpr double kRise = 0.1;  // m per second of age
  const double step = 0.5 / (item.model->trail_capacity() + 1);
  double opacity = 0;
  Painter painter(&frame_.solid);
  item.model->ForEachTrailItem([&](const Model::TrailItem& past) {
    opacity += step;
    const double radius = item.batch == kNone ? 0.2 : frame_.bodies[item.batch].shape->radius;
    const double age = static_cast<double>(job.world.SimTimeNow() - past.time) / 1e6;
    const double z = past.pose.z + kRise * age;
    max_z_ = std::max(max_z_, z + radius);
    if (!frame_.projection->Sees(past.pose.x, past.pose.y, footprints ? 0 : z,
                                 radius + (footprints ? z : 0)))
      return;
    const Rgba color = ToRgba(past.color);
    const auto instance = [&](double height, const Rgba& c) {
      return InstanceAt(past.pose.x, past.pose.y, height, past.pose.a, c);
    };
    if (item.batch != kNone && footprints)
      frame_.bodies[item.batch].footprints.push_back(instance(0, color.WithOpacity(opacity)));
    if (item.batch != kNone && blocks)
      frame_.bodies[item.batch].robots.push_back(instance(z, color.WithOpacity(1)));
    if (!arrows) return;
    painter.SetFrame(Pose(past.pose.x, past.pose.y, z, past.pose.a));
    painter.SetColor(color);
    DrawArrow(&painter);
  });
}

void RenderScene::AddExtras(const Job& job, const Item& item) {
  const view::ViewOptions& options = job.view.options;
  const Model& model = *item.model;
  const Pose global(item.x, item.y, item.z, item.a);
  if (options[Show::kStatus]) {
    if (!model.speech().empty()) DrawSpeech(model, global, &frame_.over);
    if (model.Stalled())
      frame_.stalled.emplace_back(item.x, item.y, item.z + StackHeight(model) + 0.3 + 0.25);
  }
  if (options[Show::kFlags] && item.parent == kNone && !model.flags().empty())
    DrawFlags(model, global, &frame_.solid);
  if (options[Show::kBoundingBoxes] && &model != job.world.GetGround())
    DrawBoundingBox(model, global, &frame_.solid);
  if (options[Show::kGrid] && model.HasGuiGrid() && item.batch != kNone)
    DrawModelGrid(model, global, frame_.bodies[item.batch].shape->top, frame_.step, &frame_.marks);
}

// ---- sensor data --------------------------------------------------------------------------------

void RenderScene::AddData(const Job& job) {
  const view::ViewOptions& options = job.view.options;
  const Layers layers{&frame_.floor, &frame_.data, &frame_.over};
  const DataFrame frame{options, *frame_.projection, layers};
  for (const Item& item : items_) {
    if (options[Show::kRasterization])
      DrawRaster(*item.model, Pose(item.x, item.y, item.z, item.a), &frame_.marks, &frame_.over);
    if (!item.model->HasSubscribers() || !job.shows_data_of(*item.model)) continue;
    if (item.kind == Kind::kRanger && options[Show::kRanger]) AddFans(job, item);
    if (item.kind == Kind::kOther || item.kind == Kind::kPosition)
      FindPicture(*item.model)->draw(*item.model, Pose(item.x, item.y, item.z, item.a), frame);
    if (!item.model->visualizers().empty()) AddVisuals(job, item);
  }
}

void RenderScene::AddVisuals(const Job& job, const Item& item) {
  for (Visualizer* visualizer : item.model->visualizers()) {
    if (!job.view.options.IsOn(visualizer->GetMenuName())) continue;
    if (auto* plot = dynamic_cast<StripPlotVis*>(visualizer)) {
      if (job.selection.Has(item.model->Root())) AddChart(*plot);
    } else if (const auto* heat = dynamic_cast<const DissipationVis*>(visualizer)) {
      DrawDissipation(*heat, &frame_.floor);
    } else {
      frame_.visuals.push_back({item.model, visualizer, Pose(item.x, item.y, item.z, item.a)});
    }
  }
}

void RenderScene::AddChart(StripPlotVis& plot) {
  if (frame_.chart_count == frame_.charts.size()) frame_.charts.emplace_back();
  Chart& chart = frame_.charts[frame_.chart_count++];
  chart.x = plot.x();
  chart.y = plot.y();
  chart.width = plot.width();
  chart.height = plot.height();
  chart.color = ToRgba(plot.color());
  chart.background = ToRgba(plot.background());
  chart.min_value = plot.Least();
  chart.max_value = plot.Greatest();
  chart.values = plot.Values();
  chart.name = plot.GetMenuName();
}

void RenderScene::AddFans(const Job& job, const Item& item) {
  const auto& ranger = static_cast<const ModelRanger&>(*item.model);
  const Pose frame = ranger.SensorFrame(ranger.GetScanPose());
  const SineCosine turn = SinCos(frame.a);
  if (job.view.options[Show::kRangerTransducers])
    DrawTransducers(ranger, Pose(item.x, item.y, item.z, item.a), &frame_.over);
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    const Pose place = ModelRanger::OriginOf(sensor, frame, turn);
    const double reach = Finite(sensor.Reach());
    if (!frame_.projection->Sees(place.x, place.y, place.z, reach)) continue;
    DrawSensor(sensor, place, job.view.options, &frame_.data);
    const size_t count = sensor.ranges.size();
    if (job.view.options[Show::kRangerArea] && count >= 2 && sensor.bearings.size() == count)
      AddFan(sensor, place, reach);
  }
}

void RenderScene::AddFan(const ModelRanger::Sensor& sensor, const Pose& place, double reach) {
  constexpr double kInvisible = 0.5;  // pixels
  constexpr size_t kStep = 16;        // rounds fans up to a few sizes, so that there are few groups
  const double pixel = frame_.projection->PixelAt(point3_t(place.x, place.y, place.z));
  const size_t first = frame_.ray_ends.size();
  const size_t ray_ends =
      AppendSimplified(sensor.ranges, DirectionsOf(sensor), static_cast<float>(reach),
                       static_cast<float>(kInvisible * pixel), &frame_.ray_ends);
  const size_t wanted = (ray_ends + kStep - 1) / kStep * kStep;
  frame_.ray_ends.resize(first + wanted, frame_.ray_ends.back());
  GroupOf(wanted).fans.push_back({static_cast<float>(place.x), static_cast<float>(place.y),
                                  static_cast<float>(place.z), static_cast<float>(place.a),
                                  static_cast<uint32_t>(first),
                                  ToRgba(sensor.color).WithOpacity(0.1)});
}

/// Sensors with equal field of view and count share their unit vectors: most are alike.
const Directions& RenderScene::DirectionsOf(const ModelRanger::Sensor& sensor) {
  constexpr size_t kMaxKinds = 64;
  for (const SensorKind& kind : kinds_)
    if (kind.fov == sensor.fov && kind.directions.x.size() == sensor.bearings.size())
      return kind.directions;
  if (kinds_.size() == kMaxKinds) kinds_.clear();
  kinds_.push_back({sensor.fov, draw::DirectionsOf(sensor.bearings)});
  return kinds_.back().directions;
}

FanGroup& RenderScene::GroupOf(size_t ray_ends) {
  for (FanGroup& group : frame_.fans)
    if (group.ray_ends == ray_ends) return group;
  frame_.fans.push_back({ray_ends, {}});
  return frame_.fans.back();
}

}  // namespace Stg::draw
