// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/belief.hh"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
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

/// A picture with one black pixel, because one without any is an error.
std::string FirstPicture(const Belief::Options& options) {
  std::string pixels(size_t{options.columns} * options.rows, '0');
  pixels[0] = '1';
  std::string picture =
      "P1\n" + std::to_string(options.columns) + " " + std::to_string(options.rows) + "\n";
  for (size_t i = 0; i < pixels.size(); i++) {
    picture += pixels[i];
    if (i % 64 == 63) picture += '\n';
  }
  return picture;
}

/// Says what is wrong with the options, in words that follow "stage: "; "" if nothing is.
std::string WhyNot(const Belief::Options& options) {
  constexpr uint32_t kMostCells = 10000;  // on a side
  const auto is_length = [](double metres) { return metres > 0 && metres < 1e6; };
  if (!is_length(options.other_radius) || !is_length(options.other_height) ||
      !is_length(options.wall_height) || !is_length(options.resolution))
    return "found a radius, a height or a resolution of a belief that is no length, expected "
           "metres";
  if (options.room > 100000) return "found room for too many others, expected at most 100000";
  if ((options.columns == 0) != (options.rows == 0) || options.columns > kMostCells ||
      options.rows > kMostCells)
    return "found a grid of " + std::to_string(options.columns) + " by " +
           std::to_string(options.rows) + " cells, expected 1 to 10000 on both sides, or none";
  return IsFinite(options.origin) ? "" : "found an origin of a grid that is not finite";
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

std::unique_ptr<World> whatif::BeliefContent::Load(const std::string& content) const {
  RunOptions run;
  if (HasGrid())
    run.pictures = std::make_shared<const std::map<std::string, std::string>>(
        std::map<std::string, std::string>{
            {std::string(kMapName) + ".pbm", FirstPicture(options)}});
  run.listed = false;
  run.threads = 1;
  auto world = std::make_unique<World>(run);
  std::istringstream input(content);
  return world->Load(input, file) ? std::move(world) : nullptr;
}

std::unique_ptr<World> whatif::BeliefContent::MakeWorld(uint32_t count) const {
  constexpr double kFarAway = -10000;                 // m: beyond the reach of sensors
  constexpr double kFastest = 10, kFastestTurn = 10;  // m/s, rad/s
  const double width = 2 * options.other_radius;
  const std::string side = Metres(width), speed = "-" + Metres(kFastest) + " " + Metres(kFastest);
  const std::string turn = Radians(kFastestTurn);
  std::string all = text + "\n";
  for (uint32_t i = 0; i < count; i++)
    all += "position( name \"" + NameOf(i) + "\" alwayson 1 pose [ " + Metres(kFarAway) + " " +
           Metres(i * (width + 1)) + " 0 0 ] size [ " + side + " " + side + " " +
           Metres(options.other_height) +
           " ] round 1 drive \"omni\" localization \"gps\" mass 70\n  velocity_bounds [ " + speed +
           " " + speed + " 0 0 -" + turn + " " + turn + " ] ctrl \"stage/behaviour\" )\n";
  return Load(HasGrid() ? all + MapText() : all);
}

/// A model for the grid.
std::string whatif::BeliefContent::MapText() const {
  const double across = options.columns * options.resolution;
  const double along = options.rows * options.resolution;
  const Pose& origin = options.origin;
  const std::string name = kMapName;
  return "model( name \"" + name + "\" pose [ " + Metres(origin.x) + " " + Metres(origin.y) +
         " 0 " + Radians(origin.a) + " ] origin [ " + Metres(across / 2) + " " + Metres(along / 2) +
         " 0 0 ] size [ " + Metres(across) + " " + Metres(along) + " " +
         Metres(options.wall_height) + " ] bitmap \"" + name +
         ".pbm\" bitmap_frame \"picture\" )\n";
}

std::string whatif::BeliefContent::Metres(double value) const {
  return worldfile::TextInUnit(value, unit_length);
}

std::string whatif::BeliefContent::Radians(double value) const {
  return worldfile::TextInUnit(value, unit_angle);
}

bool whatif::BeliefContent::IsOccupied(double x, double y) const {
  const SineCosine turn = SinCos(options.origin.a);
  const double dx = x - options.origin.x, dy = y - options.origin.y;
  const double column = (dx * turn.cosine + dy * turn.sine) / options.resolution;
  const double row = (dy * turn.cosine - dx * turn.sine) / options.resolution;
  if (!(column >= 0 && column < options.columns && row >= 0 && row < options.rows)) return false;
  return cells[static_cast<size_t>(row) * options.columns + static_cast<size_t>(column)] != 0;
}

Belief::Belief(const std::string& world_file, const std::string& robot, const Options& options)
    : impl_(new Impl) {
  impl_->options = options;
  impl_->file = world_file;
  impl_->robot_name = robot;
  impl_->room = std::max(1u, options.room);
  if (const std::string error = WhyNot(options); !error.empty()) {
    Refuse(error);
    return;
  }
  impl_->cells.assign(size_t{options.columns} * options.rows, 0);
  std::ifstream input(world_file, std::ios::binary);
  std::ostringstream content;
  content << input.rdbuf();
  if (!input) {
    Refuse(messages::Quoted(world_file) + " cannot be read, expected a world file");
    return;
  }
  impl_->text = content.str();
  const std::unique_ptr<World> world = impl_->Load(impl_->text);
  if (!world) return;
  impl_->unit_length = world->GetWorldFile()->unit_length;
  impl_->unit_angle = world->GetWorldFile()->unit_angle;
  const Model* const model = world->GetModel(robot);
  if (!dynamic_cast<const ModelPosition*>(model)) {
    Refuse(messages::Quoted(world_file) + " has no position model " + messages::Quoted(robot) +
           ", expected the robot that decides");
    return;
  }
  impl_->robot.pose = model->GetGlobalPose();
  impl_->robot.Set(impl_->robot.pose, Covariance(), Velocity(), Covariance(), "the robot");
  impl_->ready = impl_->MakeWorld(impl_->room) != nullptr;
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
  for (const Behaviour& behaviour : other.behaviours) {
    if (!(behaviour.weight > 0 && std::isfinite(behaviour.weight)))
      return Refuse("found a weight of " + worldfile::FloatText(behaviour.weight) +
                    " for a behaviour of " + whose + ", expected a number above 0");
    if (!std::isfinite(behaviour.x) || !std::isfinite(behaviour.y) || !(behaviour.speed >= 0) ||
        !std::isfinite(behaviour.speed))
      return Refuse("found a goal or a speed of " + whose +
                    " that makes no sense, expected metres, and m/s from 0 on");
  }
  Impl::Moving moving;
  if (!moving.Set(other.pose, other.pose_covariance, other.velocity, other.velocity_covariance,
                  whose))
    return false;
  std::vector<TrackedOther>& others = impl_->others;
  const auto place = std::ranges::lower_bound(others, other.id, {}, &TrackedOther::id);
  const auto moving_place = impl_->moving.begin() + (place - others.begin());
  if (place != others.end() && place->id == other.id) {
    *place = other;
    *moving_place = moving;
    return true;
  }
  others.insert(place, other);
  impl_->moving.insert(moving_place, moving);
  while (impl_->room < others.size()) impl_->room *= 2;
  return true;
}

bool Belief::RemoveOther(uint64_t id) {
  std::vector<TrackedOther>& others = impl_->others;
  const auto place = std::ranges::lower_bound(others, id, {}, &TrackedOther::id);
  if (place == others.end() || place->id != id) return false;
  impl_->moving.erase(impl_->moving.begin() + (place - others.begin()));
  others.erase(place);
  return true;
}

void Belief::ClearOthers() {
  impl_->others.clear();
  impl_->moving.clear();
}

const Pose& Belief::robot_pose() const { return impl_->robot.pose; }

const Velocity& Belief::robot_velocity() const { return impl_->robot.velocity; }

double Belief::delay() const { return impl_->delay; }

const std::vector<TrackedOther>& Belief::others() const { return impl_->others; }

const Belief::Options& Belief::options() const { return impl_->options; }

}  // namespace Stg
