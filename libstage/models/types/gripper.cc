// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/gripper.hh"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/deletion_watch.hh"
#include "models/host.hh"
#include "models/property_checks.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/warn_about.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kStep = 0.05;      // change of finger and lift position per update
constexpr double kRounding = 1e-9;  // tolerance, so that a full travel takes exactly 20 steps

// Indices of the gripper's own blocks, which are the first of its body.
constexpr size_t kBase = 0, kLeft = 1, kRight = 2;

constexpr uint32_t kFirstContact = 2;  // tags of contact rays start here; lower ones are beams

bool StopsGripper(Model* candidate, const Model* finder, const void*) {
  return candidate != finder && candidate->vis.gripper_return;
}

/// Interpolates linearly from range.min (unit 0) to range.max (unit 1). Exact at both ends.
double Along(const Bounds& range, double unit) {
  return range.min * (1.0 - unit) + range.max * unit;
}
Bounds Along(const Bounds& range, const Bounds& unit) {
  return Bounds(Along(range, unit.min), Along(range, unit.max));
}

bool IsIn(const Host& host, const Model* model) {
  const std::vector<Model*>& models = host.models;
  return std::find(models.begin(), models.end(), model) != models.end();
}

Bounds Extent(const Block& block, meters_t point_t::*axis) {
  Bounds extent(block.points()[0].*axis, block.points()[0].*axis);
  for (const point_t& p : block.points()) {
    extent.min = std::min(extent.min, p.*axis);
    extent.max = std::max(extent.max, p.*axis);
  }
  return extent;
}

void Describe(const ModelGripper&, SensorExtent* extent) {
  extent->rays = extent->parts = 4;  // two beams, two contact strips
}

// ---- readings -----------------------------------------------------------------------------------

ReadingShape ShapeOfState(const ModelGripper&) { return ReadingShape(); }
ReadingShape ShapeOfPair(const ModelGripper&) { return ReadingShape(2); }

/// GetConfig() only copies, but is not declared const.
ModelGripper::config_t ConfigOf(const ModelGripper& gripper) {
  return const_cast<ModelGripper&>(gripper).GetConfig();
}

template <auto state>
bool CopyState(const ModelGripper& gripper, size_t, int32_t* to) {
  *to = static_cast<int32_t>(ConfigOf(gripper).*state);
  return true;
}

template <double ModelGripper::config_t::*place>
bool CopyPlace(const ModelGripper& gripper, size_t, double* to) {
  *to = ConfigOf(gripper).*place;
  return true;
}

template <Model* (ModelGripper::config_t::*pair)[2]>
bool CopyPair(const ModelGripper& gripper, size_t length, bool* to) {
  const ModelGripper::config_t config = ConfigOf(gripper);
  for (size_t i = 0; i < length; i++) to[i] = (config.*pair)[i] != nullptr;
  return true;
}

bool CopyGripped(const ModelGripper& gripper, size_t, bool* to) {
  *to = ConfigOf(gripper).gripped != nullptr;
  return true;
}

}  // namespace

ModelType GripperType() {
  return ModelTypeOf<ModelGripper>("gripper")
      .Updates(ModelType::kParallel | ModelType::kRequestsSensed)
      .Senses(Describe)
      .Measurable()
      .Reads(MakeReading("paddles", "", "0 open, 1 closed, 2 opening, 3 closing.", ShapeOfState,
                         CopyState<&ModelGripper::config_t::paddles>))
      .Reads(MakeReading("paddle_position", "", "Position of the fingers: 0 open, 1 closed.",
                         ShapeOfState, CopyPlace<&ModelGripper::config_t::paddle_position>))
      .Reads(MakeReading("lift", "", "0 down, 1 up, 2 going up, 3 going down.", ShapeOfState,
                         CopyState<&ModelGripper::config_t::lift>))
      .Reads(MakeReading("lift_position", "", "Position of the lift: 0 down, 1 up.", ShapeOfState,
                         CopyPlace<&ModelGripper::config_t::lift_position>))
      .Reads(MakeReading("beams", "", "Whether the inner and the outer beam are broken.",
                         ShapeOfPair, CopyPair<&ModelGripper::config_t::beam>))
      .Reads(MakeReading("contacts", "", "Whether something touches the left and the right finger.",
                         ShapeOfPair, CopyPair<&ModelGripper::config_t::contact>))
      .Reads(MakeReading("gripped", "", "Whether the gripper holds something.", ShapeOfState,
                         CopyGripped));
}

ModelGripper::ModelGripper(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      config_(),
      command_(CMD_NOOP),
      drop_due_(false),
      shape_due_(false),
      body_made_(0),
      hits_(),
      hit_ids_() {
  config_.paddle_size = Size(0.66, 0.1, 0.4);
  config_.close_limit = 1.0;
  config_.break_beam_inset[0] = 0.75 * config_.paddle_size.x;
  config_.break_beam_inset[1] = 0.25 * config_.paddle_size.x;
  geom.size = Size(0.2, 0.3, 0.2);
  color = Color(0.3, 0.3, 0.3);
  has_default_block = false;  // blocks of the world file are added to the gripper's own
  BuildBody();
  blockgroup->Fit(geom.size);
}

ModelGripper::~ModelGripper() { host().FinishRaysOf(this); }

// ---- world file ---------------------------------------------------------------------------------

void ModelGripper::Load() {
  if (wf) {
    const DeletionWatch watch(*this);
    if (config_.gripped) Drop();  // loaded again
    if (watch.gone()) return;
    LoadConfig();
    const bool no_body = wf->ReadInt(wf_entity, "noblocks", 0);
    if (no_body && HasBody()) ClearBlocks();
    ShapeBody();
  }
  Model::Load();
}

void ModelGripper::LoadConfig() {
  Size& size = config_.paddle_size;
  wf->ReadTuple(wf_entity, "paddle_size", 0, 3, "fff", &size.x, &size.y, &size.z);
  CheckNotNegative(*wf, wf_entity, "paddle_size", std::min({size.x, size.y, size.z}));
  config_.break_beam_inset[0] = 0.75 * size.x;
  config_.break_beam_inset[1] = 0.25 * size.x;
  config_.autosnatch = wf->ReadInt(wf_entity, "autosnatch", config_.autosnatch);

  char *paddles = nullptr, *lift = nullptr;
  if (wf->ReadTuple(wf_entity, "paddle_state", 0, 2, "ss", &paddles, &lift) == 0) return;
  const std::string paddle_text = paddles, lift_text = lift;
  std::free(paddles);
  std::free(lift);
  if (paddle_text == "open" || paddle_text == "closed") {
    config_.paddles = paddle_text == "open" ? PADDLE_OPEN : PADDLE_CLOSED;
    config_.paddle_position = config_.paddles == PADDLE_OPEN ? 0.0 : 1.0;
  } else {
    wf->Warn(
        wf_entity, "paddle_state",
        "found paddles " + messages::Quoted(paddle_text) + ", expected \"open\" or \"closed\"");
  }
  if (lift_text == "up" || lift_text == "down") {
    config_.lift = lift_text == "up" ? LIFT_UP : LIFT_DOWN;
    config_.lift_position = config_.lift == LIFT_UP ? 1.0 : 0.0;
  } else {
    wf->Warn(wf_entity, "paddle_state",
             "found lift " + messages::Quoted(lift_text) + ", expected \"up\" or \"down\"");
  }
}

void ModelGripper::Save() {
  if (!SaveCommon()) return;
  const Size& size = config_.paddle_size;
  wf->WriteTuple(wf_entity, "paddle_size", 0, 3, "fff", size.x, size.y, size.z);
  wf->WriteTuple(wf_entity, "paddle_state", 0, 2, "ss",
                 config_.paddles == PADDLE_CLOSED ? "closed" : "open",
                 config_.lift == LIFT_UP ? "up" : "down");
}

void ModelGripper::SetConfig(config_t& newcfg) {
  const Size& size = newcfg.paddle_size;
  for (const double number :
       {size.x, size.y, size.z, newcfg.paddle_position, newcfg.lift_position, newcfg.close_limit,
        newcfg.break_beam_inset[0], newcfg.break_beam_inset[1]}) {
    if (std::isfinite(number)) continue;
    WarnAbout(*this, "refused a configuration that is not finite");
    return;
  }
  const config_t old = config_;
  config_ = newcfg;
  config_.gripped = old.gripped;
  config_.paddles_stalled = old.paddles_stalled;
  std::copy(old.beam, old.beam + 2, config_.beam);
  std::copy(old.contact, old.contact + 2, config_.contact);
  ShapeBody();
  Map();
}

void ModelGripper::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  config_t& c = config_;
  StateChoice paddles(&c.paddles, PADDLE_CLOSING);
  StateChoice lift(&c.lift, LIFT_DOWNING);
  StateChoice command(&command_, CMD_DOWN);
  exchange(c.paddle_size, paddles, lift, c.paddle_position, c.lift_position, c.gripped,
           c.paddles_stalled, c.close_limit, c.autosnatch, c.break_beam_inset);
  for (size_t i = 0; i < 2; i++) {
    exchange.Reference(c.beam[i], hit_ids_[i]);
    exchange.Reference(c.contact[i], hit_ids_[kFirstContact + i]);
  }
  bool has_body = HasBody();
  exchange(command, drop_due_, shape_due_, has_body);
  if (exchange.restoring()) body_made_ = blockgroup->times_cleared() - (has_body ? 0 : 1);
}

// ---- body ---------------------------------------------------------------------------------------

/// Builds the body in the unit cube, to be fitted.
void ModelGripper::BuildBody() {
  blockgroup->Clear();
  for (size_t i = 0; i < 3; i++) blockgroup->AddRectangle(0, 0, 1, 1, Bounds(0, 1));
  body_made_ = blockgroup->times_cleared();
  ShapeBody();
}

/// False if the blocks have been cleared by a client.
bool ModelGripper::HasBody() const { return blockgroup->times_cleared() == body_made_; }

/// Box of a finger in the unit cube.
bounds3d_t ModelGripper::Finger(bool left) const {
  const Size& size = config_.paddle_size;
  const double from_edge = config_.paddle_position * (0.5 - size.y);
  const double y = left ? from_edge : 1.0 - from_edge - size.y;
  const double z = config_.lift_position * (1.0 - size.z);
  return bounds3d_t(Bounds(1.0 - size.x, 1.0), Bounds(y, y + size.y), Bounds(z, z + size.z));
}

/// Shapes the gripper's own blocks for the current positions, within the box that they fill now.
/// Call Map() afterwards.
void ModelGripper::ShapeBody() {
  shape_due_ = false;
  if (!HasBody()) return;
  const auto& blocks = blockgroup->blocks();
  STAGE_ASSERT(blocks.size() > kRight);
  bounds3d_t box(Extent(*blocks[kBase], &point_t::x), Extent(*blocks[kBase], &point_t::y),
                 blocks[kBase]->z_range());
  for (const size_t finger : {kLeft, kRight}) {
    const Bounds x = Extent(*blocks[finger], &point_t::x);
    box.x = Bounds(std::min(box.x.min, x.min), std::max(box.x.max, x.max));
  }
  const auto change = [&](size_t index, const bounds3d_t& unit) {
    blockgroup->ChangeRectangle(
        index, bounds3d_t(Along(box.x, unit.x), Along(box.y, unit.y), Along(box.z, unit.z)));
  };
  change(kBase, bounds3d_t(Bounds(0, 1.0 - config_.paddle_size.x), Bounds(0, 1), Bounds(0, 1)));
  change(kLeft, Finger(true));
  change(kRight, Finger(false));
}

// ---- updating -----------------------------------------------------------------------------------

void ModelGripper::Update() {
  GatherSerially();
  host().sensed.push_back(this);
  Model::Update();
}

void ModelGripper::Gather(sensing::FanList* fans) {
  ObeyCommand();
  MovePaddles();
  MoveLift();
  AddRays(fans);
}

void ModelGripper::ObeyCommand() {
  switch (command_) {
    case CMD_CLOSE:
      if (config_.paddles != PADDLE_CLOSED) config_.paddles = PADDLE_CLOSING;
      break;
    case CMD_OPEN:
      if (config_.paddles != PADDLE_OPEN) config_.paddles = PADDLE_OPENING;
      break;
    case CMD_UP:
      if (config_.lift != LIFT_UP) config_.lift = LIFT_UPPING;
      break;
    case CMD_DOWN:
      if (config_.lift != LIFT_DOWN) config_.lift = LIFT_DOWNING;
      break;
    case CMD_NOOP:
      break;
  }
}

void ModelGripper::MovePaddles() {
  double& position = config_.paddle_position;
  if (config_.paddles == PADDLE_OPENING) {
    position -= kStep;
    if (position < kRounding) {
      position = 0.0;
      config_.paddles = PADDLE_OPEN;
    }
    drop_due_ = config_.gripped && (position == 0.0 || position < config_.close_limit);
    shape_due_ = true;
  } else if (config_.paddles == PADDLE_CLOSING) {
    position += kStep;
    if (position > config_.close_limit - kRounding) {
      position = config_.close_limit;
      config_.paddles = PADDLE_CLOSED;
    }
    shape_due_ = true;
  }
}

void ModelGripper::MoveLift() {
  double& position = config_.lift_position;
  if (config_.lift == LIFT_UPPING) {
    position += kStep;
    if (position > 1.0 - kRounding) {
      position = 1.0;
      config_.lift = LIFT_UP;
    }
    shape_due_ = true;
  } else if (config_.lift == LIFT_DOWNING) {
    position -= kStep;
    if (position < kRounding) {
      position = 0.0;
      config_.lift = LIFT_DOWN;
    }
    shape_due_ = true;
  }
}

void ModelGripper::AddRays(sensing::FanList* fans) {
  const Size& body = geom.size;
  const Size& paddle = config_.paddle_size;
  const double side = (1.0 - config_.paddle_position) * (body.y / 2.0 - body.y * paddle.y);
  // A beam ends one cell short of the other finger, because the cell of the finger also contains
  // what it presses against.
  const double beam = 2.0 * side - 1.0 / scene().cells_per_metre;
  for (uint32_t i = 0; i < 2; i++)
    AddRay(i, Pose(body.x * (1.0 - config_.break_beam_inset[i]) - body.x / 2.0, side, 0, -M_PI / 2),
           beam, fans);
  const double start = (1.0 - paddle.x) * body.x - body.x / 2.0;
  AddRay(kFirstContact, Pose(start, side, 0, 0), paddle.x * body.x, fans);
  AddRay(kFirstContact + 1, Pose(start, -side, 0, 0), paddle.x * body.x, fans);
}

void ModelGripper::AddRay(uint32_t tag, const Pose& local, double length, sensing::FanList* fans) {
  sensing::Fan fan;
  fan.predicate = StopsGripper;
  fan.finder = this;
  fan.sink = this;
  fan.tag = tag;
  PlaceFan(&fan, LocalToGlobal(local), length, RayModel::kCell);  // contact is defined by cells
  fan.record.first_direction = sensing::DirectionTables::kAhead;
  // Without self-mask: what the gripper's own robot carries breaks beams too.
  fans->Add(fan, 1, false);
}

void ModelGripper::ReceiveHits(uint32_t tag, const sensing::RayHits& hits) {
  STAGE_ASSERT(tag < std::size(hits_) && hits.count == 1);
  hits_[tag] = hits.intervals[0].model;
  hit_ids_[tag] = hits_[tag] ? hits_[tag]->GetId() : 0;
}

// ---- moving after sensing -----------------------------------------------------------------------

void ModelGripper::Sensed() {
  if (shape_due_) {
    ShapeBody();
    Map();
  }
  const bool drop = drop_due_ && config_.gripped;
  drop_due_ = false;
  std::copy(hits_, hits_ + 2, config_.beam);
  std::copy(hits_ + kFirstContact, hits_ + kFirstContact + 2, config_.contact);
  config_.paddles_stalled = config_.contact[0] || config_.contact[1];
  if (config_.autosnatch) {
    if (config_.beam[0] || config_.beam[1])
      command_ = CMD_CLOSE;
    else if (!config_.gripped || drop)  // a held object may lie outside of the beams
      command_ = CMD_OPEN;
  }
  // Called last: their callbacks may delete the gripper and the object.
  if (drop)
    Drop();
  else if (config_.paddles == PADDLE_CLOSING && !config_.gripped)
    Grip();
}

/// Returns the object that touches a finger, left first; ignores the gripper's own robot.
Model* ModelGripper::Grippable() const {
  for (Model* thing : config_.contact)
    // A callback may have deleted the object since the rays were traced.
    if (thing && IsIn(host(), thing) && !IsAntecedent(thing)) return thing;
  return nullptr;
}

/// Makes the object a child at the gripper's own position.
void ModelGripper::Grip() {
  Model* thing = Grippable();
  if (!thing) return;
  const DeletionWatch here(*this), there(*thing);
  // Treats the fraction py / 2 as metres, as Stage always has.
  const double width = geom.size.y - config_.paddle_size.y / 2.0;
  const double close_limit = std::max(0.0, 1.0 - thing->GetGeom().size.y / width);
  const Pose place(0, 0, stack_children ? -geom.size.z : 0.0, 0);
  if (thing->Parent() != this) thing->SetParent(this);
  if (here.gone() || there.gone() || thing->Parent() != this) return;
  config_.gripped = thing;
  config_.close_limit = close_limit;
  thing->SetPose(place);
}

void ModelGripper::Drop() {
  Model* thing = config_.gripped;
  if (!thing) return;
  const DeletionWatch there(*thing);
  const Pose place = GetGlobalPose();
  thing->SetParent(nullptr);  // calls RemoveChild()
  if (!there.gone()) thing->SetPose(place);
}

void ModelGripper::RemoveChild(Model* mod) {
  Model::RemoveChild(mod);
  if (mod != config_.gripped) return;
  config_.gripped = nullptr;
  config_.close_limit = 1.0;
}

}  // namespace Stg
