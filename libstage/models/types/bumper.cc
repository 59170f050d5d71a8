// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/bumper.hh"

#include <algorithm>
#include <cstdio>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "messages/log.hh"
#include "models/bumper_touch.hh"
#include "models/host.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kWatts = 0.1;
constexpr int kMaxBumpers = 10000;

bool StopsBumper(Model* candidate, const Model* finder, const void*) {
  return !candidate->IsRelated(finder);
}

void Describe(const ModelBumper& bumper, SensorExtent* extent) {
  extent->rays = extent->parts = bumper.bumper_count;
}

ReadingShape LinesOf(const ModelBumper& bumper) { return ReadingShape(bumper.bumper_count); }

bool CopyHits(const ModelBumper& bumper, size_t length, bool* to) {
  if (!bumper.samples) return false;
  for (size_t i = 0; i < length; i++) to[i] = bumper.samples[i].hit;
  return true;
}

}  // namespace

ModelType BumperType() {
  return ModelTypeOf<ModelBumper>("bumper")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel | ModelType::kIgnoresOwnTree | ModelType::kReadsContacts)
      .Senses(Describe)
      .Measurable()
      .Reads(
          MakeReading("hit", "", "True for each line that touches something.", LinesOf, CopyHits));
}

ModelBumper::ModelBumper(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_), bumper_count(0), bumpers(nullptr), samples(nullptr) {}

ModelBumper::~ModelBumper() { host().FinishRaysOf(this); }

void ModelBumper::Load() {
  if (!LoadCommon() || !wf->PropertyExists(wf_entity, "bcount")) return;
  const int count = wf->ReadInt(wf_entity, "bcount", 0);
  if (count < 0 || count > kMaxBumpers)
    wf->Fail(wf_entity, "bcount",
             "found " + std::to_string(count) + " bumpers, expected a number from 1 to " +
                 std::to_string(kMaxBumpers));
  host().memory.Take(*wf, wf_entity, "bcount", static_cast<size_t>(count), MemoryBudget::kBumper,
                     "bumpers");
  if (count == 0)
    wf->Warn(wf_entity, "bcount", "found 0 bumpers, expected 1 or more; there are none");

  const auto read_length = [this](const std::string& name, double value) {
    const double length = wf->ReadLength(wf_entity, name.c_str(), value);
    if (length < 0)
      wf->Fail(wf_entity, name.c_str(), "found a negative length, expected 0 or more");
    return length;
  };
  const double length = read_length("blength", 0);
  samples = nullptr;
  configs_.assign(static_cast<size_t>(count), BumperConfig());
  for (size_t i = 0; i < configs_.size(); i++) {
    const std::string index = "[" + std::to_string(i) + "]";
    configs_[i].pose.Load(wf, wf_entity, ("bpose" + index).c_str());
    configs_[i].length = read_length("blength" + index, length);
  }
  bumper_count = static_cast<uint32_t>(count);
  bumpers = count > 0 ? configs_.data() : nullptr;
}

void ModelBumper::Print(char* prefix) const {
  std::printf("%s%s bumpers:", prefix ? prefix : "", Printable(token).c_str());
  for (uint32_t i = 0; i < bumper_count; i++) std::printf(" %d", samples && samples[i].hit ? 1 : 0);
  std::printf("\n");
}

void ModelBumper::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange.Expect(bumper_count, "the number of a bumper's sensors");
  for (uint32_t i = 0; i < bumper_count; i++) exchange(bumpers[i].pose, bumpers[i].length);
  bool has_samples = samples != nullptr;
  exchange(has_samples);
  if (has_samples && exchange.restoring()) MakeSamples();
  for (size_t i = 0; has_samples && i < results_.size(); i++) {
    exchange.Reference(results_[i].hit, hit_ids_[i]);
    exchange(results_[i].hit_point);
  }
  if (exchange.restoring()) samples = has_samples ? results_.data() : nullptr;
}

void ModelBumper::Startup() {
  watts = kWatts;
  Model::Startup();
}

void ModelBumper::Shutdown() {
  watts = 0;
  samples = nullptr;
  Model::Shutdown();
}

void ModelBumper::Update() {
  GatherSerially();
  Model::Update();
}

void ModelBumper::MakeSamples() {
  results_.assign(configs_.size(), BumperSample());
  hit_ids_.assign(configs_.size(), 0);
  lines_.resize(configs_.size());
}

void ModelBumper::Gather(sensing::FanList* fans) {
  bumper_count = std::min(bumper_count, static_cast<uint32_t>(configs_.size()));
  if (bumper_count == 0) return;
  if (!samples) {
    MakeSamples();
    samples = results_.data();
  }
  const Pose frame = GetGlobalPose() + geom.pose;
  for (uint32_t i = 0; i < bumper_count; i++) AddLine(i, frame, fans);
  FindTouched();
}

/// Looks for contacts of outlines at the lines.
void ModelBumper::FindTouched() {
  touched_.clear();
  ForEachContact([this](const ContactPoint& contact) {
    touched_.resize(lines_.size(), {nullptr, point_t()});
    for (size_t i = 0; i < bumper_count; i++) {
      const Line& line = lines_[i];
      if (touched_[i].model == nullptr &&
          IsAtLine(line.start, {line.sine, line.cosine}, bumpers[i].length, contact.point))
        touched_[i] = {contact.b, contact.point};
    }
  });
}

void ModelBumper::AddLine(uint32_t index, const Pose& frame, sensing::FanList* fans) {
  STAGE_ASSERT(index < configs_.size() && index < lines_.size());
  const BumperConfig& config = configs_[index];
  Pose start = frame + Pose(config.pose.x, config.pose.y, 0, config.pose.a);
  start.a = normalize(start.a + M_PI / 2);
  const SineCosine along = SinCos(start.a);
  start.x -= config.length / 2 * along.cosine;
  start.y -= config.length / 2 * along.sine;
  lines_[index] = {point_t(start.x, start.y), along.cosine, along.sine};

  sensing::Fan fan;
  fan.predicate = StopsBumper;
  fan.finder = this;
  fan.sink = this;
  fan.tag = index;
  fan.z_test = false;
  PlaceFan(&fan, start, config.length, RayModel::kCell);  // contact is defined by cells
  fan.record.first_direction = sensing::DirectionTables::kAhead;
  fans->Add(fan, 1);
}

void ModelBumper::ReceiveHits(uint32_t tag, const sensing::RayHits& hits) {
  // The bumper may have been shut down since the rays were added.
  if (!samples || tag >= results_.size()) return;
  STAGE_ASSERT(hits.count == 1);
  BumperSample& sample = results_[tag];
  sample.hit = hits.intervals[0].model;
  if (!sample.hit && tag < touched_.size() && touched_[tag].model) {
    sample.hit = touched_[tag].model;
    sample.hit_point = touched_[tag].point;
    hit_ids_[tag] = sample.hit->GetId();
    return;
  }
  if (!sample.hit) return;
  hit_ids_[tag] = sample.hit->GetId();
  const Line& line = lines_[tag];
  const double range = hits.ranges[0];
  sample.hit_point = point_t(line.start.x + range * line.cosine, line.start.y + range * line.sine);
}

}  // namespace Stg
