// SPDX-License-Identifier: GPL-2.0-or-later

#include "crowd.hh"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "array_groups.hh"
#include "messages/assert.hh"
#include "rows/robot_view.hh"
#include "world/engine.hh"
#include "worlds/pool_access.hh"

namespace Stg::python {

namespace {

/// The id of a world in the pool.
uint32_t IdOf(size_t world) { return static_cast<uint32_t>(world); }

/// The scene of the row in which the state of the world is or will be; null if it is in a World
/// object.
const rows::Scene* SceneAt(const Source& source, size_t world) {
  return source.pool() ? PoolAccess::SceneOf(*source.pool(), IdOf(world)) : nullptr;
}

size_t VariantAt(const Source* source, size_t world) {
  const WorldPool* const pool = source ? source->pool() : nullptr;
  return pool ? pool->Variant(IdOf(world)) : 0;
}

/// Writes x, y and heading of what `get` returns.
template <auto get, class Robot>
void FillPlane(const Robot* robot, double* row) {
  if (!robot) return static_cast<void>(std::fill(row, row + 3, kNaN));
  const Pose pose = std::invoke(get, robot);
  row[0] = pose.x;
  row[1] = pose.y;
  row[2] = pose.a;
}

/// Writes a covariance matrix row by row.
template <auto get, class Robot>
void FillCovariance(const Robot* robot, double* matrix) {
  const PoseCovariance covariance = robot ? std::invoke(get, robot) : PoseCovariance();
  for (int row = 0; row < 3; row++)
    for (int column = 0; column < 3; column++)
      *matrix++ = robot ? covariance.At(row, column) : kNaN;
}

template <class Robot>
void FillSensedTime(const Robot* robot, double* time) {
  *time = robot ? static_cast<double>(robot->GetSensedTime()) / 1e6 : kNaN;
}

template <class Robot>
void FillStalled(const Robot* robot, bool* row) {
  *row = robot && robot->Stalled();
}

/// The element of a column with the bits of a robot's row of an array.
template <auto column>
const void* InColumn(const rows::Columns& columns, size_t mover) {
  return &(columns.*column)[mover];
}
static_assert(sizeof(rows::Planar) == 3 * sizeof(double) && sizeof(bool) == sizeof(uint8_t));

void FillEnergy(const ModelPosition* robot, double* row) {
  const PowerPack* const pack = robot ? robot->FindPowerPack() : nullptr;
  *row = pack ? pack->GetStored() : kNaN;
}

void FillStored(const rows::RobotView* robot, double* row) {
  *row = robot ? robot->GetStored() : kNaN;
}

/// The arrays of numbers of robots; the columns are the arguments of RobotArray.
struct BodyArrayKind {
  const char* name;
  size_t width;
  RobotArray<double>::Fills fills;
  bool runs;
};
constexpr BodyArrayKind kBodyArrays[] = {
    {"pose",
     3,
     {FillPlane<&ModelPosition::GetGlobalPose>, FillPlane<&rows::RobotView::GetGlobalPose>,
      InColumn<&rows::Columns::pose>},
     false},
    {"velocity",
     3,
     {FillPlane<&ModelPosition::GetVelocity>, FillPlane<&rows::RobotView::GetVelocity>,
      InColumn<&rows::Columns::velocity>},
     false},
    {"actual_velocity",
     3,
     {FillPlane<&ModelPosition::GetActualVelocity>, FillPlane<&rows::RobotView::GetActualVelocity>},
     false},
    {"estimate",
     3,
     {FillPlane<&ModelPosition::est_pose>, FillPlane<&rows::RobotView::GetEstimate>},
     true},
    {"estimated_velocity",
     3,
     {FillPlane<&ModelPosition::GetEstimatedVelocity>,
      FillPlane<&rows::RobotView::GetEstimatedVelocity>},
     true},
    {"estimate_covariance",
     9,
     {FillCovariance<&ModelPosition::GetOdomCovariance>,
      FillCovariance<&rows::RobotView::GetOdomCovariance>},
     true},
    {"estimated_velocity_covariance",
     9,
     {FillCovariance<&ModelPosition::GetOdomVelocityCovariance>,
      FillCovariance<&rows::RobotView::GetOdomVelocityCovariance>},
     true},
    {"sensed_pose",
     3,
     {FillPlane<&ModelPosition::GetSensedPose>, FillPlane<&rows::RobotView::GetSensedPose>},
     true},
    {"sensed_time", 0, {FillSensedTime<ModelPosition>, FillSensedTime<rows::RobotView>}, true},
    {"energy", 0, {FillEnergy, FillStored}, false}};

void FillTime(World* world, double* time) {
  *time = world ? static_cast<double>(world->SimTimeNow()) / 1e6 : kNaN;
}

void FillTimeOfRow(const RowOfCrowd& row, double* time) {
  *time = static_cast<double>(row.rows.columns.time[row.row]) / 1e6;
}

void FillEnded(World* world, bool* ended) { *ended = !world || world->TestQuit(); }

void FillEndedOfRow(const RowOfCrowd&, bool* ended) { *ended = false; }

}  // namespace

Crowd::Crowd(std::weak_ptr<Source> source, std::vector<Robots> robots, size_t worlds, bool single)
    : source_(std::move(source)), robots_(std::move(robots)), single_(single), members_(worlds) {}

/// Flushes pending commands: they stay in force after the array is garbage-collected.
Crowd::~Crowd() {
  if (!commands_.exists()) return;
  if (const std::shared_ptr<Source> source = source_.lock()) source->OnCrowdDestroyed(this);
}

/// The members of a world, looked up again if its models have changed; a null `source` has none.
const Members& Crowd::MembersOf(const Source* source, size_t index) {
  STAGE_ASSERT(index < members_.size());
  Members& members = members_[index];
  World* const world = source ? source->WorldAt(index) : nullptr;
  const uint64_t changes = world ? world->host().topology_version : 0;
  const WorldPool* const pool = source ? source->pool() : nullptr;
  const uint64_t times_made = pool ? pool->times_made(IdOf(index)) : 0;
  if (world && world == members.world && changes == members.topology_version &&
      times_made == members.times_made)
    return members;
  members.world = world;
  members.times_made = times_made;
  members.topology_version = changes;
  members.robots.clear();
  for (const ModelKey& key : robots_[VariantAt(source, index)])
    members.robots.push_back(world ? dynamic_cast<ModelPosition*>(source->Find(index, key))
                                   : nullptr);
  STAGE_ASSERT(members.robots.size() == size());
  for (const Named& named : groups_) named.group->Find(index, members);
  return members;
}

void Crowd::Gather(const Source& source, size_t world) {
  if (GatherRow(source, world, groups_)) return;
  const Members& members = MembersOf(&source, world);
  for (const Named& named : groups_) FillGroup(named.group.get(), world, members);
}

/// Fills a group for one world, on the world's workers, whose caches hold the robots' data.
void Crowd::FillGroup(ArrayGroup* group, size_t world, const Members& members) {
  constexpr size_t kTooFew = 200, kGrain = 32;
  group->Prepare(world, members);
  const size_t count = members.robots.size();
  if (!members.world || count < kTooFew) return group->Fill(world, members, 0, count);
  members.world->engine().workers()->Run(count, kGrain, [&](size_t begin, size_t end, unsigned) {
    group->Fill(world, members, begin, end);
  });
}

/// Fills a group for all worlds, after a lookup of their robots.
void Crowd::FillGroup(const Source& source, ArrayGroup* group) {
  const auto found =
      std::ranges::find(groups_, group, [](const Named& n) { return n.group.get(); });
  STAGE_ASSERT(found != groups_.end());
  for (size_t world = 0; world < worlds(); world++) {
    if (GatherRow(source, world, std::span(found, 1))) continue;
    const Members& members = MembersOf(&source, world);
    group->Find(world, members);
    FillGroup(group, world, members);
  }
}

/// The members of worlds of all kinds that there are now.
std::vector<Members> Crowd::Examples(const Source& source) {
  std::vector<Members> examples;
  const rows::Scene* last = nullptr;
  for (size_t world = 0; world < worlds(); world++) {
    const rows::Scene* const scene = SceneAt(source, world);
    if (!scene) {
      examples.push_back(MembersOf(&source, world));
    } else if (scene != last) {
      last = scene;
      examples.emplace_back();
      for (const ModelPosition* robot : RobotsIn(*last, VariantAt(&source, world)).models)
        examples.back().robots.push_back(const_cast<ModelPosition*>(robot));
    }
  }
  return examples;
}

/// Adds the members of worlds of all variants, in which those of this time may be reset.
void Crowd::AddVariants(const WorldPool& pool, std::vector<std::shared_ptr<const World>>* worlds,
                        std::vector<Members>* examples) const {
  for (uint32_t variant = 0; pool.CountVariants() > 1 && variant < robots_.size(); variant++) {
    worlds->push_back(PoolAccess::Example(pool, variant));
    examples->emplace_back();
    for (const ModelKey& key : robots_[variant])
      examples->back().robots.push_back(
          dynamic_cast<ModelPosition*>(worlds->back()->FindModel(key.id)));
  }
}

std::string Crowd::WhyNoRoom(const World& world, const Robots& robots) const {
  Members members;
  for (const ModelKey& key : robots)
    members.robots.push_back(dynamic_cast<ModelPosition*>(world.FindModel(key.id)));
  for (const Named& named : groups_)
    if (std::string why = named.group->WhyNoRoom(members); !why.empty()) return why;
  return "";
}

void Crowd::SetRobots(size_t variant, const Robots& robots) {
  STAGE_ASSERT(variant <= robots_.size() && robots.size() == size());
  if (variant == robots_.size()) robots_.emplace_back();
  robots_[variant] = robots;
  row_robots_.Clear();
  for (const Named& named : groups_) named.group->ForgetScenes();
}

// ---- rows ---------------------------------------------------------------------------------------

const RowRobots& Crowd::RobotsIn(const rows::Scene& scene, size_t variant) {
  return row_robots_.Get(scene, [&] {
    RowRobots robots{&scene, {}, {}, true, true};
    for (const ModelKey& key : robots_[variant]) {
      const auto mover = std::ranges::find_if(scene.movers, [&](const rows::Mover& m) {
        return m.robot && m.robot->GetId() == key.id;
      });
      const bool is_one = mover != scene.movers.end();
      robots.models.push_back(
          dynamic_cast<const ModelPosition*>(scene.prototype->FindModel(key.id)));
      robots.movers.push_back(is_one ? static_cast<uint32_t>(mover - scene.movers.begin())
                                     : RowRobots::kNone);
      if (!is_one || robots.movers.back() != robots.movers[0] + robots.movers.size() - 1)
        robots.follow_each_other = false;
      if (robots.models.back() && !robots.models.back()->HasSubscribers()) robots.run = false;
    }
    return robots;
  });
}

/// Fills these groups for a world in a row. Returns false if it is not in a row, or if a group can
/// only be filled from a World.
bool Crowd::GatherRow(const Source& source, size_t world, std::span<const Named> groups) {
  const rows::Scene* scene = SceneAt(source, world);
  if (!scene) return false;
  const size_t variant = VariantAt(&source, world);
  const RowRobots* robots = &RobotsIn(*scene, variant);
  for (size_t i = 0; i < groups.size();) {
    const RowPlan& plan = groups[i].group->PlanFor(*robots);
    if (!plan.possible) return false;
    i = plan.needs.empty() ? i + 1 : 0;
    if (plan.needs.empty()) continue;
    PoolAccess::Subscribe(*source.pool(), IdOf(world), plan.needs);
    scene = SceneAt(source, world);
    if (!scene) return false;
    robots = &RobotsIn(*scene, variant);
  }
  const PoolRow row = PoolAccess::RowToRead(*source.pool(), IdOf(world));
  if (!row) return false;
  STAGE_ASSERT(&row.rows->scene() == robots->scene);
  const RowOfCrowd of{*row.rows, row.row, *robots};
  for (const Named& named : groups) named.group->FillFromRow(world, of);
  return true;
}

namespace {

/// True if a robot gets no command from these numbers.
bool IsNoCommand(const double* numbers) {
  return std::isnan(numbers[0]) || std::isnan(numbers[1]) || std::isnan(numbers[2]);
}

}  // namespace

/// Command() for a world in a row. Returns false if it is not in a row.
bool Crowd::CommandRow(const Source& source, size_t world) {
  const rows::Scene* const scene = SceneAt(source, world);
  if (!scene) return false;
  const size_t variant = VariantAt(&source, world);
  const RowRobots* robots = &RobotsIn(*scene, variant);
  std::vector<uint32_t> needs;
  for (size_t i = 0; !robots->run && i < size(); i++) {
    if (IsNoCommand(commands_.Row<double>(world, i)) || !robots->models[i]) continue;
    if (!robots->models[i]->HasSubscribers()) needs.push_back(robots->models[i]->GetId());
  }
  if (!needs.empty()) PoolAccess::Subscribe(*source.pool(), IdOf(world), needs);
  const PoolRow row = PoolAccess::RowToChange(*source.pool(), IdOf(world));
  if (!row) return false;
  if (&row.rows->scene() != robots->scene) robots = &RobotsIn(row.rows->scene(), variant);
  rows::Columns& columns = row.rows->columns;
  const size_t first = row.row * row.rows->scene().movers.size();
  for (size_t i = 0; i < size(); i++) {
    const double* const command = commands_.Row<double>(world, i);
    if (IsNoCommand(command) || robots->movers[i] == RowRobots::kNone) continue;
    columns.mode[first + robots->movers[i]] = DriveInput::kVelocity;
    columns.command[first + robots->movers[i]] = {command[0], command[1], command[2]};
  }
  return true;
}

/// Teleport() for a world in a row. Returns false if it is not in a row.
bool Crowd::TeleportRow(const Source& source, size_t world, const double* poses,
                        const bool* which) {
  const PoolRow row =
      source.pool() ? PoolAccess::RowToChange(*source.pool(), IdOf(world)) : PoolRow();
  if (!row) return false;
  const RowRobots& robots = RobotsIn(row.rows->scene(), VariantAt(&source, world));
  for (size_t i = 0; i < size(); i++) {
    if (robots.movers[i] == RowRobots::kNone || (which && !which[i])) continue;
    const double* const to = poses + 3 * i;
    PoolAccess::Place(*source.pool(), IdOf(world), robots.movers[i], {to[0], to[1], to[2]});
  }
  return true;
}

// ---- worlds -------------------------------------------------------------------------------------

void Crowd::Command(const Source& source, size_t world) {
  if (!commands_.exists() || CommandRow(source, world)) return;
  const Members& members = MembersOf(&source, world);
  for (size_t i = 0; i < members.robots.size(); i++) {
    ModelPosition* const robot = members.robots[i];
    const double* const row = commands_.Row<double>(world, i);
    if (!robot || IsNoCommand(row)) continue;
    EnsureSubscribed(robot);
    robot->SetSpeed(row[0], row[1], row[2]);
  }
}

void Crowd::ClearCommands(size_t world) {
  if (!commands_.exists()) return;
  double* const rows = commands_.Row<double>(world, 0);
  std::fill(rows, rows + 3 * size(), 0.0);
}

void Crowd::SetCommands(size_t world, const double* rows) {
  std::copy(rows, rows + 3 * size(), commands_.Row<double>(world, 0));
}

void Crowd::Teleport(const Source& source, size_t world, const double* poses, const bool* which) {
  if (TeleportRow(source, world, poses, which)) return;
  const Members& members = MembersOf(&source, world);
  for (size_t i = 0; i < members.robots.size(); i++) {
    ModelPosition* const robot = members.robots[i];
    if (!robot || (which && !which[i])) continue;
    const double* const to = poses + 3 * i;
    robot->SetGlobalPose(Pose(to[0], to[1], robot->GetGlobalPose().z, to[2]));
  }
}

std::vector<ModelRadio*> Crowd::RadiosOf(const Source& source, size_t world, size_t index) {
  const ModelType& type = SensorTypeOf("radio");
  std::vector<ModelRadio*> radios;
  bool any = false;
  for (ModelPosition* robot : RobotsOf(source, world)) {
    size_t n = index;
    Model* const found = robot ? FindInTree(type, robot, &n) : nullptr;
    radios.push_back(static_cast<ModelRadio*>(found));
    any = any || found;
  }
  if (!any) throw Failure{Kind::kGone, "no robot has a radio number " + std::to_string(index)};
  return radios;
}

// ---- views --------------------------------------------------------------------------------------

nb::object Crowd::View(const Array& array, bool writable) {
  return ViewOf(array, shared_from_this(), writable, single_);
}

/// The group called `name`; creates and fills it if it does not exist.
template <typename T, typename... Arguments>
T& Crowd::GroupOf(const Source& source, const std::string& name, Arguments... arguments) {
  for (const Named& named : groups_)
    if (named.name == name) return static_cast<T&>(*named.group);
  std::vector<Members> examples = Examples(source);
  std::vector<std::shared_ptr<const World>> example_worlds;
  if (source.pool()) AddVariants(*source.pool(), &example_worlds, &examples);
  auto group = std::make_unique<T>(examples, worlds(), arguments...);
  T& made = *group;
  groups_.push_back({name, std::move(group)});
  FillGroup(source, &made);
  return made;
}

/// Keeps the source alive and holds a Use of it. Throws Failure if the source is closed.
class Crowd::SourceLock {
 public:
  explicit SourceLock(const Crowd& crowd) : source_(crowd.source_.lock()) {
    if (source_) use_.emplace(source_.get());
    if (!source_ || !source_->is_open())
      throw Failure{Kind::kGone, "the world of these robots is gone"};
  }
  const Source& source() const { return *source_; }

 private:
  const std::shared_ptr<Source> source_;
  std::optional<Source::Use> use_;
};

nb::object Crowd::BodyArray(const std::string& name) {
  const SourceLock hold(*this);
  for (const auto& [known, width, fills, runs] : kBodyArrays)
    if (name == known)
      return View(GroupOf<RobotArray<double>>(hold.source(), name, width, fills, runs).array);
  throw Failure{Kind::kStage, "there is no array called " + name};
}

nb::object Crowd::StalledArray() {
  const SourceLock hold(*this);
  constexpr RobotArray<bool>::Fills kFills{FillStalled<ModelPosition>, FillStalled<rows::RobotView>,
                                           InColumn<&rows::Columns::stalled>};
  return View(GroupOf<RobotArray<bool>>(hold.source(), "stalled", size_t{0}, kFills, false).array);
}

nb::object Crowd::TimeArray() {
  const SourceLock hold(*this);
  return View(GroupOf<WorldArray<double>>(hold.source(), "time", FillTime, FillTimeOfRow).array);
}

nb::object Crowd::EndedArray() {
  const SourceLock hold(*this);
  return View(GroupOf<WorldArray<bool>>(hold.source(), "ended", FillEnded, FillEndedOfRow).array);
}

nb::object Crowd::CommandArray() {
  const SourceLock hold(*this);
  if (!commands_.exists()) commands_.Make<double>({worlds(), size(), 3});
  return View(commands_, true);
}

nb::object Crowd::SensorArray(const std::string& type, size_t index, size_t max_count,
                              const std::string& reading) {
  const SourceLock hold(*this);
  const std::string name = type + " " + std::to_string(index) + " " + std::to_string(max_count);
  SensorArrays& group =
      GroupOf<SensorArrays>(hold.source(), name, &SensorTypeOf(type), index, max_count);
  bool is_new = false;
  const Array& array = group.ArrayOf(reading, &is_new);
  if (is_new) FillGroup(hold.source(), &group);
  return View(array);
}

}  // namespace Stg::python
