// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/belief.hh"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/position.hh"
#include "models/property_checks.hh"
#include "whatif/belief_impl.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

bool Refuse(const std::string& line) {
  messages::Report(LogLevel::kError, "stage: " + line);
  return false;
}

/// Says what is wrong with the options, in words that follow "stage: "; "" if nothing is.
std::string WhyNot(const Belief::Options& options) {
  constexpr uint32_t kMostCells = 10000;  // on a side
  const auto is_length = [](double metres) { return metres > 0 && metres < 1e6; };
  if (!is_length(options.wall_height) || !is_length(options.resolution))
    return "found a height or a resolution of a grid that is no length, expected metres";
  if (options.kinds.empty()) return "found no kind of others, expected at least one";
  for (const OtherKind& kind : options.kinds) {
    if (!is_length(kind.radius) || !is_length(kind.height))
      return "found a radius or a height of others that is no length, expected metres";
    if (kind.room > 100000) return "found room for too many others, expected at most 100000";
  }
  if ((options.columns == 0) != (options.rows == 0) || options.columns > kMostCells ||
      options.rows > kMostCells)
    return "found a grid of " + std::to_string(options.columns) + " by " +
           std::to_string(options.rows) + " cells, expected 1 to 10000 on both sides, or none";
  return IsFinite(options.origin) ? "" : "found an origin of a grid that is not finite";
}

/// Says what is wrong with a behaviour, in words that follow "found"; "" if nothing is.
std::string WhyNot(const Behaviour& behaviour) {
  const auto is_size = [](double number) { return number >= 0 && std::isfinite(number); };
  if (!is_size(behaviour.weight) || behaviour.weight == 0)
    return "a weight of " + worldfile::FloatText(behaviour.weight) +
           ", expected a number above 0, for a behaviour";
  const bool has_goal = behaviour.kind == Behaviour::kGoTo ||
                        behaviour.kind == Behaviour::kSocialForce ||
                        behaviour.kind == Behaviour::kOrca;
  if (has_goal && !(std::isfinite(behaviour.x) && std::isfinite(behaviour.y)))
    return "no goal, expected x and y in metres, for a behaviour";
  if (!is_size(behaviour.speed))
    return "a speed of " + worldfile::FloatText(behaviour.speed) +
           ", expected m/s from 0 on, for a behaviour";
  if (behaviour.kind == Behaviour::kController &&
      (behaviour.controller.empty() ||
       behaviour.controller.find_first_of("\"\n") != std::string::npos))
    return "no controller, expected its name and arguments, for a behaviour";
  if (behaviour.kind == Behaviour::kRule && !behaviour.rule)
    return "no rule, expected an object, for a behaviour";
  return "";
}

/// Unlike World::GetModel(), without a warning.
const Model* FindModel(const World& world, const std::string& name) {
  for (const Model* const model : world.GetAllModels())
    if (model->TokenStr() == name) return model;
  return nullptr;
}

}  // namespace

Covariance::Covariance(double x, double y, double a) : values() {
  values[0] = x * x;
  values[4] = y * y;
  values[8] = a * a;
}

/// The algorithm of Cholesky. A row of zeros, for a number that is known exactly, stays one.
bool whatif::CovarianceFactor::Set(const Covariance& covariance) {
  constexpr double kRounding = 1e-9;
  const double* const m = covariance.values;
  double scale = 0;
  for (int i = 0; i < 9; i++) {
    if (!std::isfinite(m[i])) return false;
    scale = std::max(scale, std::fabs(m[i]));
  }
  const double slack = kRounding * scale;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < i; j++)
      if (std::fabs(m[3 * i + j] - m[3 * j + i]) > slack) return false;
  double l[3][3] = {};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j <= i; j++) {
      double rest = m[3 * i + j];
      for (int k = 0; k < j; k++) rest -= l[i][k] * l[j][k];
      if (i == j) {
        if (rest < -slack) return false;
        l[i][i] = std::sqrt(std::max(0.0, rest));
      } else if (l[j][j] > 0) {
        l[i][j] = rest / l[j][j];
      } else if (std::fabs(rest) > slack) {
        return false;
      }
    }
  const double found[] = {l[0][0], l[1][0], l[1][1], l[2][0], l[2][1], l[2][2]};
  std::ranges::copy(found, values);
  return true;
}

bool whatif::BeliefContent::Moving::Set(const Pose& new_pose, const Covariance& pose_covariance,
                                        const Velocity& new_velocity,
                                        const Covariance& velocity_covariance,
                                        const std::string& whose) {
  if (!IsFinite(new_pose) || !IsFinite(new_velocity))
    return Refuse("found a pose or a velocity of " + whose +
                  " that is not finite, expected metres, radians, and these per second");
  Moving changed{new_pose, new_velocity, {}, {}};
  if (!changed.pose_errors.Set(pose_covariance) ||
      !changed.velocity_errors.Set(velocity_covariance))
    return Refuse("found a covariance of " + whose +
                  " that is not symmetric and positive semidefinite");
  *this = changed;
  return true;
}

/// A point in the frame of the grid, in cells.
void whatif::BeliefContent::ToCells(double x, double y, double* column, double* row) const {
  const SineCosine turn = SinCos(options.origin.a);
  const double dx = x - options.origin.x, dy = y - options.origin.y;
  *column = (dx * turn.cosine + dy * turn.sine) / options.resolution;
  *row = (dy * turn.cosine - dx * turn.sine) / options.resolution;
}

bool whatif::BeliefContent::IsOccupied(double x, double y) const {
  double column, row;
  ToCells(x, y, &column, &row);
  if (!(column >= 0 && column < options.columns && row >= 0 && row < options.rows)) return false;
  return cells_that_count()[static_cast<size_t>(row) * options.columns +
                            static_cast<size_t>(column)] != 0;
}

void whatif::BeliefContent::ClearCells() {
  if (!options.others_clear_cells) return;
  cleared_cells = cells;
  for (size_t other = 0; other < others.size(); other++) {
    double column, row;
    ToCells(moving[other].pose.x, moving[other].pose.y, &column, &row);
    const double reach = RadiusOf(other) / options.resolution + 1;
    const auto first = [&](double place) {
      return static_cast<size_t>(std::max(0.0, place - reach));
    };
    const auto end = [&](double place, uint32_t count) {
      return static_cast<size_t>(constrain(place + reach + 1, 0, count));
    };
    for (size_t r = first(row); r < end(row, options.rows); r++)
      for (size_t c = first(column); c < end(column, options.columns); c++)
        if (Hypotenuse(static_cast<double>(c) + 0.5 - column, static_cast<double>(r) + 0.5 - row) <
            reach)
          cleared_cells[r * options.columns + c] = 0;
  }
}

// ---- groups of others ---------------------------------------------------------------------------

std::string_view whatif::BeliefContent::ControllerOf(const Behaviour& behaviour) {
  if (behaviour.kind == Behaviour::kRule) return "";
  if (behaviour.kind == Behaviour::kController) return behaviour.controller;
  return kBehaviours;
}

size_t whatif::BeliefContent::GroupOf(uint32_t kind, const Behaviour& behaviour) const {
  const std::string_view controller = ControllerOf(behaviour);
  const auto is_wanted = [&](const Group& group) {
    return group.kind == kind && group.controller == controller;
  };
  return static_cast<size_t>(std::ranges::find_if(groups, is_wanted) - groups.begin());
}

bool whatif::BeliefContent::AddGroups(const TrackedOther& other) {
  constexpr uint32_t kFirstRoom = 4;
  for (const Behaviour& behaviour : other.behaviours) {
    if (GroupOf(other.kind, behaviour) < groups.size()) continue;
    const Group group = {other.kind, std::string(ControllerOf(behaviour)), kFirstRoom, 0};
    if (!group.controller.empty() && !MakeWorld({group})) return false;
    groups.push_back(group);
  }
  return true;
}

void whatif::BeliefContent::Count(const TrackedOther& other, bool joins) {
  ForEachGroup(other, [&](size_t index) {
    Group& group = groups[index];
    if (group.used == (joins ? 0 : 1)) version_of_groups++;
    joins ? group.used++ : group.used--;
    if (group.used <= group.room) return;
    group.room *= 2;
    version_of_groups++;
  });
}

// ---- interface ----------------------------------------------------------------------------------

Belief::Impl::Impl(const std::string& world_file, const std::string& name, const Options& wanted) {
  options = wanted;
  file = world_file;
  robot_name = name;
  for (uint32_t kind = 0; kind < options.kinds.size(); kind++)
    groups.push_back({kind, kBehaviours, std::max(1u, options.kinds[kind].room), 0});
}

Belief::Belief(const std::string& world_file, const std::string& robot, const Options& options)
    : impl_(new Impl(world_file, robot, options)) {
  std::ifstream input(world_file, std::ios::binary);
  Read(input);
}

Belief::Belief(std::istream& text, const std::string& file, const std::string& robot,
               const Options& options)
    : impl_(new Impl(file, robot, options)) {
  Read(text);
}

/// Reads the world file and finds the robot in it.
void Belief::Read(std::istream& text) {
  const std::string& file = impl_->file;
  const std::string& robot = impl_->robot_name;
  if (const std::string error = WhyNot(impl_->options); !error.empty()) {
    Refuse(error);
    return;
  }
  impl_->cells.assign(size_t{impl_->options.columns} * impl_->options.rows, 0);
  std::ostringstream content;
  content << text.rdbuf();
  if (!text) {
    Refuse(messages::Quoted(file) + " cannot be read, expected a world file");
    return;
  }
  impl_->text = content.str();
  const std::unique_ptr<World> world = impl_->Load(impl_->text);
  if (!world) return;
  impl_->unit_length = world->GetWorldFile()->unit_length;
  impl_->unit_angle = world->GetWorldFile()->unit_angle;
  const Model* const model = FindModel(*world, robot);
  if (!dynamic_cast<const ModelPosition*>(model)) {
    Refuse(messages::Quoted(file) + " has no position model " + messages::Quoted(robot) +
           ", expected the robot that decides");
    return;
  }
  impl_->robot.pose = model->GetGlobalPose();
  impl_->robot.Set(impl_->robot.pose, Covariance(), Velocity(), Covariance(), "the robot");
  impl_->ready = impl_->MakeWorld(impl_->groups) != nullptr;
}

Belief::~Belief() = default;

bool Belief::IsReady() const { return impl_->ready; }

bool Belief::SetRobot(const Pose& pose, const Velocity& velocity, const Covariance& pose_covariance,
                      const Covariance& velocity_covariance) {
  return impl_->robot.Set(pose, pose_covariance, velocity, velocity_covariance, "the robot");
}

bool Belief::SetGrid(const uint8_t* cells, size_t count) {
  if (count != impl_->cells.size() || count == 0)
    return Refuse("found " + std::to_string(count) + " cells of a grid, expected " +
                  std::to_string(impl_->cells.size()) + ", as the options say");
  if (std::equal(cells, cells + count, impl_->cells.begin())) return true;
  std::copy(cells, cells + count, impl_->cells.begin());
  impl_->version_of_cells++;
  return true;
}

bool Belief::SetDelay(double seconds) {
  constexpr double kMost = 10;
  if (!(seconds >= 0 && seconds <= kMost))
    return Refuse("found a delay of " + worldfile::FloatText(seconds) + " s, expected 0 to 10");
  impl_->delay = seconds;
  return true;
}

bool Belief::SetOther(const TrackedOther& other) {
  const std::string whose = "other " + std::to_string(other.id);
  if (other.kind >= impl_->options.kinds.size())
    return Refuse("found the kind " + std::to_string(other.kind) + " of " + whose +
                  ", expected less than " + std::to_string(impl_->options.kinds.size()));
  for (const Behaviour& behaviour : other.behaviours)
    if (const std::string error = WhyNot(behaviour); !error.empty())
      return Refuse("found " + error + " of " + whose);
  Impl::Moving moving;
  if (!moving.Set(other.pose, other.pose_covariance, other.velocity, other.velocity_covariance,
                  whose) ||
      !impl_->AddGroups(other))
    return false;
  std::vector<TrackedOther>& others = impl_->others;
  const auto place = std::ranges::lower_bound(others, other.id, {}, &TrackedOther::id);
  const auto moving_place = impl_->moving.begin() + (place - others.begin());
  if (place != others.end() && place->id == other.id) {
    impl_->Count(*place, false);
    impl_->Count(other, true);
    *place = other;
    *moving_place = moving;
    return true;
  }
  impl_->Count(other, true);
  others.insert(place, other);
  impl_->moving.insert(moving_place, moving);
  return true;
}

bool Belief::RemoveOther(uint64_t id) {
  std::vector<TrackedOther>& others = impl_->others;
  const auto place = std::ranges::lower_bound(others, id, {}, &TrackedOther::id);
  if (place == others.end() || place->id != id) return false;
  impl_->Count(*place, false);
  impl_->moving.erase(impl_->moving.begin() + (place - others.begin()));
  others.erase(place);
  return true;
}

void Belief::ClearOthers() {
  for (const TrackedOther& other : impl_->others) impl_->Count(other, false);
  impl_->others.clear();
  impl_->moving.clear();
}

const Pose& Belief::robot_pose() const { return impl_->robot.pose; }

const Velocity& Belief::robot_velocity() const { return impl_->robot.velocity; }

double Belief::delay() const { return impl_->delay; }

const std::vector<TrackedOther>& Belief::others() const { return impl_->others; }

const Belief::Options& Belief::options() const { return impl_->options; }

}  // namespace Stg
