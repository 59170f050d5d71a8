// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replays a log in a world that was loaded from the log's files, without controllers. After each
// step, models have their logged poses, range sensors their logged readings and fields their logged
// values.

#ifndef STAGE_RECORDING_REPLAY_HH
#define STAGE_RECORDING_REPLAY_HH

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "recording/mcap_reader.hh"
#include "recording/ros_messages.hh"
#include "recording/world_files.hh"
#include "world/world_handle.hh"

namespace Stg {
class Model;
class ModelField;
class World;
}  // namespace Stg

namespace Stg::recording {

class Replay {
 public:
  /// Throws std::runtime_error with one line that names the file, if it is damaged, empty, or not
  /// the log of a Stage run.
  explicit Replay(const std::string& file);
  ~Replay();
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  bool ends_early() const { return log_.ends_early(); }
  /// The world to load without controllers: its files, settings and seed.
  const std::vector<WorldFile>& files() const { return files_; }
  const std::vector<std::string>& settings() const { return settings_; }
  uint64_t seed() const { return seed_; }
  usec_t start() const { return start_; }
  usec_t end() const { return end_; }

  /// Call when the world is loaded. Shows the state at the start; each step then shows its changes.
  /// The world must live until it is unloaded or this object is deleted.
  void Attach(World* world);
  /// Shows the state at this time, or at the nearest logged time. Does nothing if the world was
  /// unloaded.
  void SeekTo(usec_t time);

 private:
  struct Target;

  [[noreturn]] void Fail(const std::string& what) const;
  void FindFirstPoses();
  void FindTargets();
  void FindFields();
  void Arm();
  void AfterStep();
  bool IsAttached() const;
  void ShowUntil(usec_t time);
  void ReadUntil(usec_t time);
  void ShowPoses();
  void Place(const ModelPose& pose);
  void TakePoses(std::string_view message);
  void TakeScan(std::string_view message, const Target& target);
  Pose PoseBefore(const Model& model) const;
  void ClearScans();

  const std::string name_;
  McapReader log_;
  std::vector<WorldFile> files_;
  std::vector<std::string> settings_;
  uint64_t seed_ = 1;
  usec_t start_ = 0, end_ = 0;
  int poses_channel_ = -1;
  std::vector<ModelPose> first_poses_, poses_;
  bool has_poses_ = false;                     // poses_ has been read
  std::unordered_map<uint32_t, Pose> before_;  // local poses at the moment before poses_
  std::map<uint16_t, Target> targets_;         // scans by channel
  std::map<uint16_t, ModelField*> fields_;     // by channel
  usec_t lead_time_ = 0;  // by how much reading starts earlier than the time that is shown
  std::vector<double> values_;
  World* world_ = nullptr;
  WorldHandle handle_;  // of world_
  uint64_t epoch_ = 0;
  // Read position: the next record in a decompressed chunk.
  size_t next_chunk_ = 0, at_ = 0;
  Buffer records_;
  std::shared_ptr<Replay*> self_;  // for callbacks that may outlive this object
};

}  // namespace Stg::recording

#endif
