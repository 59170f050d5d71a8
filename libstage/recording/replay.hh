// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shows a log again, in a world that was loaded from the files in it, without controllers: after
// each step, models are where they were at that time, and range sensors have the readings that they
// had.

#ifndef STAGE_RECORDING_REPLAY_HH
#define STAGE_RECORDING_REPLAY_HH

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "recording/mcap_reader.hh"
#include "recording/ros_messages.hh"
#include "recording/world_files.hh"
#include "world/world_handle.hh"

namespace Stg {
class World;
}

namespace Stg::recording {

class Replay {
 public:
  /// Throws std::runtime_error, one line that names the file, if it is damaged, or no log of a
  /// Stage run, or if there is nothing in it yet.
  explicit Replay(const std::string& file);
  ~Replay();
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  bool ends_early() const { return log_.ends_early(); }
  /// To be loaded, without controllers, with these settings and that seed.
  const std::vector<WorldFile>& files() const { return files_; }
  const std::vector<std::string>& settings() const { return settings_; }
  uint64_t seed() const { return seed_; }
  usec_t start() const { return start_; }
  usec_t end() const { return end_; }

  /// To be called when the world is loaded. Shows how things were at the start; from then on each
  /// step shows what it changed. The world has to live until it is unloaded or this is deleted.
  void Attach(World* world);
  /// Shows that time, or the nearest one that the log knows. Nothing if the world was unloaded.
  void GoTo(usec_t time);

 private:
  struct Target;

  [[noreturn]] void Fail(const std::string& what) const;
  void FindFirstPoses();
  void FindTargets();
  void Arm();
  void AfterStep();
  bool IsThere() const;
  void ShowUntil(usec_t time);
  void ReadOn(usec_t time);
  void ShowPoses();
  void Place(const ModelPose& pose);
  void ClearScans();

  const std::string name_;
  McapReader log_;
  std::vector<WorldFile> files_;
  std::vector<std::string> settings_;
  uint64_t seed_ = 1;
  usec_t start_ = 0, end_ = 0;
  int poses_channel_ = -1;
  std::vector<ModelPose> first_poses_, poses_;
  std::map<uint16_t, Target> targets_;  // of scans, by channel
  World* world_ = nullptr;
  WorldHandle handle_;  // of it
  uint64_t life_ = 0;
  // How far the log was read: the next record of a chunk that is unpacked.
  size_t next_chunk_ = 0, at_ = 0;
  Buffer records_;
  std::shared_ptr<Replay*> self_;  // for calls that outlive this
};

}  // namespace Stg::recording

#endif
