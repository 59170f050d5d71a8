// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/wifi.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/line_in_bodies.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kWatts = 2.5;
constexpr size_t kMaxNameLength = 31;
constexpr double kMinDistance = 0.01;  // metres; avoids the logarithm of 0

// Free-space path loss in dB for kilometres and megahertz: 20 log10(4 pi 10^9 / c).
constexpr double kFriis = 32.44177;
constexpr double kItuIndoor = -28.0;
constexpr double kDecibelsPerMetre = 100.0;  // of obstacle, times wall_factor

/// The result is equal on every processor, because only additions, multiplications and divisions
/// are used: the artanh series for a mantissa in [sqrt(1/2), sqrt(2)).
double Log10(double x) {
  if (!(x > 0)) return std::numeric_limits<double>::quiet_NaN();
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);
  if (mantissa < M_SQRT1_2) {
    mantissa *= 2.0;
    exponent--;
  }
  const double s = (mantissa - 1.0) / (mantissa + 1.0);
  double sum = 0;
  for (int k = 23; k >= 1; k -= 2) sum = sum * s * s + 1.0 / k;
  return (exponent * M_LN2 + 2.0 * s * sum) / M_LN10;
}

void Describe(const ModelWifi& wifi, SensorExtent* extent) {
  extent->rays_vary = wifi.propagation == ModelWifi::PROPAGATION_RAYTRACE;
}

// ---- readings -----------------------------------------------------------------------------------

const std::vector<ModelWifi::Neighbor>& Reached(const ModelWifi& wifi) {
  return wifi.GetNeighbors();
}

ReadingShape ShapeOfCount(const ModelWifi&) { return ReadingShape(); }

bool CopyCount(const ModelWifi& wifi, size_t, int32_t* to) {
  *to = static_cast<int32_t>(wifi.GetNeighbors().size());
  return true;
}

void PutPosition(const ModelWifi::Neighbor& device, double* to) {
  to[0] = device.pose.x;
  to[1] = device.pose.y;
}
void PutPower(const ModelWifi::Neighbor& device, double* to) { *to = device.db; }
void PutFrequency(const ModelWifi::Neighbor& device, double* to) { *to = device.freq; }

}  // namespace

ModelType WifiType() {
  return ModelTypeOf<ModelWifi>("wifi")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel | ModelType::kIgnoresOwnTree | ModelType::kRequestsSensed)
      .Senses(Describe)
      .Measurable()
      .Reads(
          MakeReading("count", "", "Number of devices that are reached.", ShapeOfCount, CopyCount))
      .Reads(MakeListReading("position", "m",
                             "Where each device was at the start of the step: x and y.", Reached,
                             PutPosition, 2))
      .Reads(MakeListReading("power", "dBm",
                             "Power of this device's signal there; 1 with simple propagation.",
                             Reached, PutPower))
      .Reads(
          MakeListReading("frequency", "MHz", "Frequency of each device.", Reached, PutFrequency));
}

ModelWifi::ModelWifi(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      propagation(PROPAGATION_NONE),
      ip("192.168.0.1"),
      mac("00:00:00:00:00"),
      essid("any"),
      power(45),
      sensitivity(-75),
      freq(2450),
      range(0),
      plc(30),
      ple(2.5),
      sigma(5),
      wall_factor(1),
      range_db(-50),
      path_count_(0),
      seeded_(false) {
  ClearBlocks();
  geom.size.Zero();
  vis.obstacle_return = false;
  vis.blob_return = false;
  vis.ranger_return = -1.0;
  InsertByAge(&host().radios, this);
}

ModelWifi::~ModelWifi() {
  host().FinishRaysOf(this);
  // The list is sorted by id.
  std::vector<ModelWifi*>& radios = host().radios;
  radios.erase(std::lower_bound(
      radios.begin(), radios.end(), this,
      [](const ModelWifi* a, const ModelWifi* b) { return a->GetId() < b->GetId(); }));
}

// ---- loading ------------------------------------------------------------------------------------

void ModelWifi::LoadName(const char* property, std::string* name) {
  *name = wf->ReadString(wf_entity, property, *name);
  if (name->size() <= kMaxNameLength) return;
  wf->Warn(wf_entity, property, "found more than 31 characters; using the first 31");
  name->resize(kMaxNameLength);
}

void ModelWifi::Load() {
  if (!LoadCommon()) return;
  static const std::pair<const char*, Propagation> kPropagations[] = {
      {"simple", PROPAGATION_SIMPLE},
      {"friis", PROPAGATION_FRIIS},
      {"ITU indoor", PROPAGATION_ITU_INDOOR},
      {"log distance", PROPAGATION_LOG_DISTANCE},
      {"raytrace", PROPAGATION_RAYTRACE}};
  if (wf->PropertyExists(wf_entity, "model")) {
    const std::string name = wf->ReadString(wf_entity, "model", "");
    propagation = PROPAGATION_NONE;
    for (const auto& [known, value] : kPropagations)
      if (name == known) propagation = value;
    if (propagation == PROPAGATION_NONE)
      wf->Warn(wf_entity, "model",
               "found the model " + messages::Quoted(name) +
                   ", expected \"simple\", \"friis\", \"ITU indoor\", \"log distance\" or "
                   "\"raytrace\"; there will be no links");
  }
  LoadName("ip", &ip);
  LoadName("mac", &mac);
  LoadName("essid", &essid);

  const auto read = [this](const char* name, double* value) {
    *value = wf->ReadFloat(wf_entity, name, *value);
  };
  read("power", &power);
  read("sensitivity", &sensitivity);
  read("freq", &freq);
  if (!(freq > 0))
    wf->Fail(wf_entity, "freq", "found a frequency that is not positive, expected MHz");
  range = wf->ReadLength(wf_entity, "range", range);
  if (range < 0) wf->Fail(wf_entity, "range", "found a negative range, expected 0 or more");
  const auto read_not_negative = [&](const char* name, double* value) {
    read(name, value);
    CheckNotNegative(*wf, wf_entity, name, *value);
  };
  read_not_negative("plc", &plc);
  read_not_negative("ple", &ple);
  read_not_negative("sigma", &sigma);
  read_not_negative("wall_factor", &wall_factor);
  read("range_db", &range_db);
}

// ---- updating -----------------------------------------------------------------------------------

void ModelWifi::Startup() {
  watts = kWatts;
  Model::Startup();
}

void ModelWifi::Shutdown() {
  watts = 0;
  neighbors_.clear();
  Model::Shutdown();
}

void ModelWifi::Update() {
  GatherSerially();
  host().sensed.push_back(this);
  Model::Update();
}

void ModelWifi::Gather(sensing::FanList* fans) {
  path_count_ = 0;
  const Pose here = GetGlobalPose();
  here_ = here;
  if (propagation != PROPAGATION_NONE)
    for (const ModelWifi* other : host().radios)
      if (!IsRelated(other)) AddPath(*other, here);
  if (propagation == PROPAGATION_RAYTRACE)
    for (size_t i = 0; i < path_count_; i++) AddRay(static_cast<uint32_t>(i), here, fans);
}

/// Path loss in dB without obstacles.
double ModelWifi::Loss(double distance) {
  const double log_distance = Log10(std::max(distance, kMinDistance));
  const double log_frequency = Log10(freq);
  switch (propagation) {
    case PROPAGATION_FRIIS:
      return kFriis + 20.0 * log_frequency + 20.0 * (log_distance - 3.0);
    case PROPAGATION_ITU_INDOOR:
    case PROPAGATION_RAYTRACE:
      return 20.0 * log_frequency + plc * log_distance + kItuIndoor;
    case PROPAGATION_LOG_DISTANCE:
      return kFriis + 20.0 * log_frequency - 60.0 + 10.0 * ple * log_distance +
             sigma * NormalError(&random_);
    case PROPAGATION_SIMPLE:
    case PROPAGATION_NONE:
      break;
  }
  return 0;
}

/// Adds a path to the other device if that may be in reach.
void ModelWifi::AddPath(const ModelWifi& other, const Pose& here) {
  if (!seeded_) {
    random_.Seed(NoiseSeed(token));
    seeded_ = true;
  }
  const Pose there = other.GetGlobalPose();
  const double distance =
      std::sqrt((there.x - here.x) * (there.x - here.x) + (there.y - here.y) * (there.y - here.y));
  const double loss = Loss(distance), budget = power - other.sensitivity;
  const bool near = propagation == PROPAGATION_SIMPLE ? distance <= range : loss <= budget;
  if (!near) return;

  if (path_count_ == paths_.size()) paths_.emplace_back();
  Path& path = paths_[path_count_++];
  path.tree = other.Root();
  path.distance = distance;
  path.loss = loss;
  path.budget = budget;
  path.obstacles.clear();
  path.neighbor.pose = there;
  path.neighbor.essid = other.essid;
  path.neighbor.mac = other.mac;
  path.neighbor.ip = other.ip;
  path.neighbor.freq = other.freq;
}

/// Collects the bodies on the way. Always returns false, so that the ray passes through all.
bool ModelWifi::NoteObstacle(Model* candidate, const Model* finder, const void* arg) {
  const Path& path = *static_cast<const Path*>(arg);
  if (candidate->vis.ranger_return < 0 || candidate->IsRelated(finder) ||
      candidate->Root() == path.tree)
    return false;
  std::vector<const Model*>& known = path.obstacles;
  if (std::find(known.rbegin(), known.rend(), candidate) == known.rend())
    known.push_back(candidate);
  return false;
}

void ModelWifi::AddRay(uint32_t index, const Pose& here, sensing::FanList* fans) {
  const Path& path = paths_[index];
  const Pose& there = path.neighbor.pose;
  sensing::Fan fan;
  fan.predicate = NoteObstacle;
  fan.finder = this;
  fan.arg = &path;
  fan.sink = this;
  fan.tag = index;
  fan.z_test = false;  // the line may rise; heights are checked in ReceiveHits()
  const double heading = ArcTangent(there.y - here.y, there.x - here.x);
  // Cells suffice to find the bodies; their exact geometry is evaluated in ReceiveHits().
  PlaceFan(&fan, Pose(here.x, here.y, here.z, heading), path.distance, RayModel::kCell);
  fan.record.first_direction = sensing::DirectionTables::kAhead;
  fans->Add(fan, 1);
}

void ModelWifi::ReceiveHits(uint32_t tag, const sensing::RayHits&) {
  Path& path = paths_[tag];
  if (path.obstacles.empty()) return;
  static thread_local LineInBodies line;  // static to reuse its memory
  const Pose& there = path.neighbor.pose;
  line.Begin(point3_t(here_.x, here_.y, here_.z), point3_t(there.x, there.y, there.z));
  for (const Model* obstacle : path.obstacles) line.AddBodyOf(*obstacle);
  path.loss += wall_factor * kDecibelsPerMetre * line.FractionInside() * path.distance;
}

void ModelWifi::Sensed() {
  if (subs == 0) return;
  size_t count = 0;
  for (size_t i = 0; i < path_count_; i++) {
    Path& path = paths_[i];
    const bool heard = path.loss <= path.budget && std::isfinite(path.budget - path.loss);
    if (propagation != PROPAGATION_SIMPLE && !heard) continue;
    path.neighbor.db = propagation == PROPAGATION_SIMPLE ? 1.0 : power - path.loss;
    if (count == neighbors_.size()) neighbors_.emplace_back();
    std::swap(neighbors_[count++], path.neighbor);  // swapping lets both keep their memory
  }
  neighbors_.resize(count);
}

void ModelWifi::Neighbor::ExchangeState(StateExchange& exchange) {
  exchange(pose, essid, mac, ip, freq, db);
}

void ModelWifi::Reseed(uint64_t seed) {
  Model::Reseed(seed);
  seeded_ = false;
}

void ModelWifi::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  StateChoice model_of_links(&propagation, PROPAGATION_RAYTRACE);
  exchange(model_of_links, ip, mac, essid, power, sensitivity, freq, range, plc, ple, sigma,
           wall_factor, range_db, neighbors_, random_, seeded_);
}

}  // namespace Stg
