// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/recorder.hh"

#include <fnmatch.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "messages/report.hh"
#include "recording/activity.hh"
#include "recording/fields.hh"
#include "recording/log_writer.hh"
#include "recording/moved_models.hh"
#include "recording/occupancy_map.hh"
#include "recording/robots.hh"
#include "recording/ros_names.hh"
#include "recording/world_files.hh"
#include "stage_config.hh"
#include "world/around_step.hh"
#include "world/engine.hh"
#include "world/world.hh"
#include "world/world_handle.hh"

namespace Stg::recording {

namespace {

const std::string kMap = kMapFrame;

/// A robot's true and estimated pose at the time when a model of its tree updated.
struct RobotState {
  usec_t time = 0;
  Pose estimate, truth;
};

/// Returns the newest instant of a robot. A robot without subscribers does not sense, so its
/// current pose counts.
RobotState RobotStateOf(const ModelPosition& position, usec_t now) {
  if (position.HasSubscribers())
    return {position.GetSensedTime(), position.est_pose, position.GetSensedPose()};
  const Pose pose = position.GetGlobalPose();
  const bool gps = position.GetLocalizationMode() == ModelPosition::LOCALIZATION_GPS;
  return {now, gps ? pose : position.est_pose, pose};
}

struct LoggedScan {
  LoggedScan(const ScanSource& of, usec_t interval, RangeConvention ranges, usec_t now)
      : source(of), maker(of.frame, interval, ranges), written(now) {}
  ScanSource source;
  ScanMaker maker;
  int channel = -1;
  usec_t written;          // the last update that was written
  usec_t updated = 0;      // the update that the current readings belong to
  RobotState robot_state;  // the robot's instant at that update
  Pose mount;              // sensor pose on the robot at that update

  void ContinueFrom(const LoggedScan& before) {
    written = before.written;
    updated = before.updated;
    robot_state = before.robot_state;
    mount = before.mount;
  }
};

struct LoggedSensor {
  SensorSource source;
  usec_t written;  // the update that was written last
  int channel = -1;
};

/// Mean time between updates, which only happen in steps.
usec_t TimeBetweenUpdates(const Model& model) {
  return std::max(model.GetUpdateInterval(), model.GetWorld()->sim_interval);
}

struct LoggedRobot {
  LoggedRobot(const Robot& of, RangeConvention ranges, usec_t now)
      : robot(of),
        id(of.model->GetId()),
        odometry(of.odom_frame, of.footprint_frame),
        truth(kMapFrame, of.footprint_frame) {
    for (const ScanSource& scan : of.scans)
      scans.emplace_back(scan, TimeBetweenUpdates(*scan.ranger), ranges, now);
    for (const SensorSource& sensor : of.sensors) sensors.push_back({sensor, now});
  }
  /// Takes over what was already written for this robot.
  void ContinueFrom(const LoggedRobot& before) {
    activity = before.activity;
    odometry.ContinueFrom(before.odometry);
    origin = before.origin;
    is_new = before.is_new;
    robot_state = before.robot_state;
    for (size_t i = 0; i < std::min(scans.size(), before.scans.size()); i++)
      if (scans[i].source.topic == before.scans[i].source.topic)
        scans[i].ContinueFrom(before.scans[i]);
    for (size_t i = 0; i < std::min(sensors.size(), before.sensors.size()); i++)
      if (sensors[i].source.topic == before.sensors[i].source.topic)
        sensors[i].written = before.sensors[i].written;
  }
  /// True if frames and sensors are those of `other`.
  bool HasFramesOf(const LoggedRobot& other) const {
    return id == other.id && robot.base_frame == other.robot.base_frame &&
           std::ranges::equal(scans, other.scans, [](const LoggedScan& a, const LoggedScan& b) {
             return a.source.frame == b.source.frame;
           });
  }
  Robot robot;
  uint32_t id;  // of its model
  Activity activity;
  OdometryMaker odometry, truth;
  std::vector<LoggedScan> scans;
  std::vector<LoggedSensor> sensors;
  int odometry_channel = -1, truth_channel = -1;
  RobotState robot_state;  // to be written, or the last one written
  bool is_new = true;      // nothing was written yet
  bool is_due = false;     // to be written in this step
  Pose origin;             // of the odometry frame, in world coordinates
};

struct LoggedField {
  FieldSource source;
  uint32_t id;  // of the model
  usec_t next;  // when values are due
};

/// Returns the origin of a robot's odometry frame; with GPS localization it is the world's.
Pose OriginOf(const ModelPosition& position) {
  return position.GetLocalizationMode() == ModelPosition::LOCALIZATION_GPS ? Pose()
                                                                           : position.est_origin;
}

OdometryMaker::Errors OdometryErrorsOf(const ModelPosition& position) {
  if (position.GetLocalizationMode() == ModelPosition::LOCALIZATION_GPS) return {};
  return {position.GetOdomError(), position.GetOdomCovariance(),
          position.GetOdomVelocityCovariance()};
}

}  // namespace

class Recorder::Impl : public std::enable_shared_from_this<Impl> {
 public:
  explicit Impl(const LogOptions& options)
      : options_(options), log_(options.file, options.compression) {}

  void Attach(World* world);
  void Begin(World* world);
  void BeforeStep(World* world);
  void AfterStep(World* world);
  void Finish();
  /// Throws std::runtime_error if anything could not be written.
  void CheckFile() const;

 private:
  void Arm();
  void StepAttached();
  void LookAt(World* world);
  void FindModels();
  void AddFiles();
  void AddMap();
  void FindRobots();
  void FindFields();
  void CheckRobots() const;
  bool IsWanted(const Robot& robot) const;
  void WriteAll();
  void ChooseDueRobots();
  void NoteScans();
  void WriteTransforms();
  void AddTransforms(const LoggedRobot& robot);
  void WriteFixedTransforms();
  void WriteOdometry(LoggedRobot* robot);
  void WriteScans(LoggedRobot* robot);
  bool IsDue(const LoggedScan& scan) const;
  void WriteReadings(LoggedRobot* robot);
  void WriteFields();
  void WritePoses();

  LogOptions options_;
  LogWriter log_;
  World* world_ = nullptr;
  WorldHandle handle_;  // of world_
  uint64_t epoch_ = 0, topology_version_ = 0;
  usec_t now_ = 0, next_ = 0;
  bool attached_ = false, ended_ = false, was_set_back_ = false;
  std::vector<LoggedRobot> robots_;
  std::vector<LoggedField> fields_;
  bool fixed_changed_ = true;  // /tf_static needs to be written
  MovedModels poses_;
  std::vector<Transform> transforms_;
  Buffer message_;
};

// ---- attaching and stepping ---------------------------------------------------------------------

void Recorder::Impl::Attach(World* world) {
  attached_ = true;
  handle_ = WorldHandle(world);
  epoch_ = world->engine().epoch;
  Begin(world);
  Arm();
}

void Recorder::Impl::Begin(World* world) {
  world_ = world;
  now_ = world->SimTimeNow();
  next_ = now_ + options_.every;
  AddFiles();
  FindModels();
  CheckRobots();
  WriteAll();
  AddMap();
}

/// A call that is requested again after each step is not part of the world's state.
void Recorder::Impl::Arm() {
  const auto call = [weak = weak_from_this()](auto what) {
    return [weak, what](World& world) {
      if (const std::shared_ptr<Impl> self = weak.lock()) what(self.get(), &world);
    };
  };
  world_->CallAfterStep(AroundStep{call([](Impl* self, World* world) { self->BeforeStep(world); }),
                                   call([](Impl* self, World*) { self->StepAttached(); })});
}

void Recorder::Impl::StepAttached() {
  if (ended_) return;
  AfterStep(world_);
  if (log_.mcap().problem().empty())
    Arm();
  else
    world_->Quit();
}

/// Looks the models up again if there may be others, or other objects for them.
void Recorder::Impl::LookAt(World* world) {
  if (attached_ && world->engine().topology_version == topology_version_) return;
  world_ = world;
  FindModels();
}

void Recorder::Impl::BeforeStep(World* world) {
  if (world->SimTimeNow() < now_) ended_ = was_set_back_ = true;
  if (ended_) return;
  LookAt(world);
  for (LoggedRobot& robot : robots_)
    if (robot.robot.position) robot.activity.BeforeStep(*robot.robot.position);
}

void Recorder::Impl::AfterStep(World* world) {
  if (ended_) return;
  now_ = world->SimTimeNow();
  LookAt(world);
  NoteScans();
  for (LoggedRobot& robot : robots_)
    if (robot.robot.position) robot.activity.AfterStep(*robot.robot.position, now_);
  if (now_ < next_) return;
  WriteAll();
  while (options_.every > 0 && next_ <= now_) next_ += options_.every;
}

void Recorder::Impl::Finish() {
  const bool is_lost = attached_ && (!handle_ || world_->engine().epoch != epoch_);
  if (is_lost || was_set_back_)
    messages::Warn("the log ends at " + std::to_string(static_cast<double>(now_) / 1e6) +
                   " s, as its world was " +
                   (is_lost ? "unloaded" : "set back to an earlier time"));
  ended_ = true;
  log_.mcap().Finish();
  CheckFile();
}

void Recorder::Impl::CheckFile() const {
  if (const std::string problem = log_.mcap().problem(); !problem.empty())
    throw std::runtime_error(problem);
}

// ---- messages written once ----------------------------------------------------------------------

void Recorder::Impl::AddFiles() {
  const std::vector<WorldFile> files = FilesOf(world_);
  McapWriter::Texts about = {{"version", kVersion},
                             {"seed", std::to_string(world_->seed())},
                             {"interval_us", std::to_string(world_->sim_interval)}};
  if (!files.empty()) about["world"] = files[0].name;
  for (const std::string& setting : world_->options().settings)
    about["settings"] += setting + "\n";  // settings contain no line ends
  log_.mcap().AddMetadata("stage", about);
  for (const WorldFile& file : files)
    log_.mcap().AddAttachment(file.name, "application/octet-stream", file.content);
}

void Recorder::Impl::AddMap() {
  const OccupancyMap map = MakeOccupancyMap(world_->engine().models, 1 / world_->Resolution());
  if (map.cells.empty()) return;
  message_.Clear();
  PutOccupancyGrid(map, now_, &message_);
  log_.Add(log_.Channel("/map", OccupancyGridType, true), now_, message_);
}

bool Recorder::Impl::IsWanted(const Robot& robot) const {
  const std::vector<std::string>& wanted = options_.robots;
  return wanted.empty() || std::ranges::any_of(wanted, [&](const std::string& pattern) {
           return fnmatch(pattern.c_str(), robot.model->Token(), 0) == 0;
         });
}

/// Called again whenever models may have been added or removed.
void Recorder::Impl::FindModels() {
  topology_version_ = world_->engine().topology_version;
  FindRobots();
  FindFields();
}

/// Keeps the progress of robots that remain.
void Recorder::Impl::FindRobots() {
  WorldEngine& engine = world_->engine();
  const std::vector<LoggedRobot> before = std::exchange(robots_, {});
  std::unordered_map<std::string, const LoggedRobot*> known;
  for (const LoggedRobot& robot : before) known[robot.robot.base_frame] = &robot;
  for (const Robot& robot : RobotsOf(engine.models)) {
    if (!IsWanted(robot)) continue;
    LoggedRobot& found = robots_.emplace_back(robot, options_.ranges, now_);
    const auto same = known.find(robot.base_frame);
    if (same != known.end() && same->second->id == found.id) found.ContinueFrom(*same->second);
  }
  const auto have_same_frames = [](const LoggedRobot& a, const LoggedRobot& b) {
    return a.HasFramesOf(b);
  };
  fixed_changed_ =
      fixed_changed_ || attached_ || !std::ranges::equal(robots_, before, have_same_frames);
}

/// The values of new fields are due at once.
void Recorder::Impl::FindFields() {
  const std::vector<LoggedField> before = std::exchange(fields_, {});
  for (const FieldSource& source : FieldsOf(world_->engine().models)) {
    const auto known = std::ranges::find_if(before, [&](const LoggedField& field) {
      return field.id == source.field->GetId() && field.source.topic == source.topic;
    });
    fields_.push_back({source, source.field->GetId(), known == before.end() ? now_ : known->next});
  }
}

void Recorder::Impl::CheckRobots() const {
  if (!robots_.empty() || options_.robots.empty()) return;
  throw std::runtime_error(std::string(options_.robots_option) + ": found no robot called " +
                           messages::Quoted(options_.robots[0]) +
                           (options_.robots.size() > 1 ? " or matching the other patterns" : ""));
}

// ---- messages written in every step -------------------------------------------------------------

void Recorder::Impl::WriteAll() {
  message_.Clear();
  PutClock(now_, &message_);
  log_.Add(log_.Channel("/clock", ClockType), now_, message_);
  WritePoses();
  ChooseDueRobots();
  if (fixed_changed_) WriteFixedTransforms();
  WriteTransforms();
  const TouchesByModel touches = robots_.empty() ? TouchesByModel() : FindTouches(world_);
  for (LoggedRobot& robot : robots_) {
    if (robot.is_due) WriteOdometry(&robot);
    robot.activity.WriteCommand(robot.robot, now_, &log_);
    WriteScans(&robot);
    WriteReadings(&robot);
    robot.activity.WriteContacts(robot.robot, touches, now_, &log_);
    robot.activity.WriteBattery(robot.robot, now_, &log_);
  }
  WriteFields();
  log_.mcap().EndStep();
}

void Recorder::Impl::ChooseDueRobots() {
  for (LoggedRobot& robot : robots_) {
    robot.is_due = false;
    const ModelPosition* position = robot.robot.position;
    if (!position) continue;
    const RobotState robot_state = RobotStateOf(*position, now_);
    const bool is_newer = position->HasSubscribers() ? robot_state.time > robot.robot_state.time
                                                     : robot_state.truth != robot.robot_state.truth;
    robot.is_due = robot.is_new || is_newer;
    if (!robot.is_due) continue;
    robot.robot_state = robot_state;
    robot.is_new = false;
    const Pose origin = OriginOf(*position);
    fixed_changed_ = fixed_changed_ || origin != robot.origin;
    robot.origin = origin;
  }
}

/// Notes where the scans of this step were taken, because they may be written later.
void Recorder::Impl::NoteScans() {
  for (LoggedRobot& robot : robots_)
    for (LoggedScan& scan : robot.scans) {
      if (scan.source.ranger->GetLastUpdate() != now_) continue;
      scan.updated = now_;
      if (robot.robot.position) scan.robot_state = RobotStateOf(*robot.robot.position, now_);
      if (scan.source.moves) scan.mount = MountOf(scan.source, *robot.robot.model);
    }
}

bool Recorder::Impl::IsDue(const LoggedScan& scan) const {
  return scan.updated > scan.written &&
         scan.source.sensor < scan.source.ranger->GetSensors().size() &&
         !scan.source.ranger->GetSensors()[scan.source.sensor].ranges.empty();
}

void Recorder::Impl::WriteTransforms() {
  transforms_.clear();
  for (const LoggedRobot& robot : robots_) AddTransforms(robot);
  if (transforms_.empty()) return;
  message_.Clear();
  PutTransforms(transforms_, &message_);
  log_.Add(log_.Channel("/tf", TransformsType), now_, message_);
}

/// Adds transforms for the robot's newest instant and for each older scan that is written now.
void Recorder::Impl::AddTransforms(const LoggedRobot& robot) {
  const Robot& names = robot.robot;
  std::set<usec_t> written;
  const auto add = [&](const RobotState& robot_state) {
    if (names.position && written.insert(robot_state.time).second)
      transforms_.push_back(
          {&names.odom_frame, &names.footprint_frame, robot_state.estimate, robot_state.time});
  };
  if (robot.is_due)
    add(robot.robot_state);
  else
    written.insert(robot.robot_state.time);
  for (const LoggedScan& scan : robot.scans) {
    if (!IsDue(scan)) continue;
    add(scan.robot_state);
    if (scan.source.moves)
      transforms_.push_back({&names.base_frame, &scan.source.frame, scan.mount, scan.updated});
  }
}

void Recorder::Impl::WriteFixedTransforms() {
  fixed_changed_ = false;
  transforms_.clear();
  for (const LoggedRobot& robot : robots_) {
    const Robot& names = robot.robot;
    if (names.position)
      transforms_.push_back({&kMap, &names.odom_frame, robot.origin, now_});
    else
      transforms_.push_back({&kMap, &names.footprint_frame, names.model->GetGlobalPose(), now_});
    transforms_.push_back({&names.footprint_frame, &names.base_frame, Pose(), now_});
    for (const LoggedScan& scan : robot.scans)
      if (!scan.source.moves)
        transforms_.push_back(
            {&names.base_frame, &scan.source.frame, MountOf(scan.source, *names.model), now_});
  }
  message_.Clear();
  PutTransforms(transforms_, &message_);
  log_.Add(log_.Channel("/tf_static", TransformsType, true), now_, message_);
}

void Recorder::Impl::WriteOdometry(LoggedRobot* robot) {
  const usec_t time = robot->robot_state.time;
  const auto write = [&](const char* name, int* channel, OdometryMaker* maker, const Pose& pose,
                         const Velocity& velocity, const OdometryMaker::Errors& errors) {
    if (*channel < 0) *channel = log_.Channel(robot->robot.topics + name, OdometryType);
    uint8_t* space =
        log_.mcap().AddMessage(static_cast<uint16_t>(*channel), Nanoseconds(now_), maker->size());
    maker->Write(pose, velocity, errors, time, space);
  };
  const ModelPosition& position = *robot->robot.position;
  write(kOdometryTopic, &robot->odometry_channel, &robot->odometry, robot->robot_state.estimate,
        position.GetEstimatedVelocity(), OdometryErrorsOf(position));
  write(NamingSchemes().front().ground_truth, &robot->truth_channel, &robot->truth,
        robot->robot_state.truth, position.GetActualVelocity(), {});
}

void Recorder::Impl::WriteScans(LoggedRobot* robot) {
  for (LoggedScan& scan : robot->scans) {
    if (!IsDue(scan)) continue;
    if (scan.channel < 0) scan.channel = log_.Channel(scan.source.topic, LaserScanType);
    scan.written = scan.updated;
    const ModelRanger::Sensor& sensor = scan.source.ranger->GetSensors()[scan.source.sensor];
    const size_t size = scan.maker.Prepare(sensor);
    uint8_t* space =
        log_.mcap().AddMessage(static_cast<uint16_t>(scan.channel), Nanoseconds(now_), size);
    scan.maker.Write(sensor, scan.written, space);
  }
}

void Recorder::Impl::WriteReadings(LoggedRobot* robot) {
  for (LoggedSensor& sensor : robot->sensors) {
    const Model& model = *sensor.source.sensor;
    const ModelType& type = *sensor.source.type;
    if (model.GetLastUpdate() <= sensor.written) continue;
    sensor.written = model.GetLastUpdate();
    if (sensor.channel < 0)
      sensor.channel = log_.Channel(sensor.source.topic, [&] { return ReadingsType(type, model); });
    message_.Clear();
    PutReadings(type, model, robot->robot.base_frame, &message_);
    log_.Add(static_cast<uint16_t>(sensor.channel), now_, message_);
  }
}

/// Writes the values at the end of the step.
void Recorder::Impl::WriteFields() {
  for (LoggedField& logged : fields_) {
    if (now_ < logged.next) continue;
    const usec_t interval = logged.source.field->GetLogInterval();
    logged.next = (now_ / interval + 1) * interval;
    message_.Clear();
    PutFieldValues(*logged.source.field, now_, &message_);
    log_.Add(log_.Channel(logged.source.topic, FieldValuesType), now_, message_);
  }
}

void Recorder::Impl::WritePoses() {
  const std::vector<ModelPose>& poses = poses_.FindMoved(world_->engine().models);
  message_.Clear();
  PutModelPoses(poses, now_, &message_);
  log_.Add(log_.Channel("/stage/poses", ModelPosesType), now_, message_);
}

// ---- public interface ---------------------------------------------------------------------------

Recorder::Recorder(const LogOptions& options) : impl_(std::make_shared<Impl>(options)) {}
Recorder::~Recorder() = default;
void Recorder::Attach(World* world) { impl_->Attach(world); }
void Recorder::Begin(World* world) { impl_->Begin(world); }
void Recorder::BeforeStep(World* world) { impl_->BeforeStep(world); }
void Recorder::AfterStep(World* world) {
  impl_->AfterStep(world);
  impl_->CheckFile();
}
void Recorder::Finish() { impl_->Finish(); }

}  // namespace Stg::recording
