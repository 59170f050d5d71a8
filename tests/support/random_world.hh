// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random worlds with random changes. The same seed gives the same world and the same changes, for
// all options of a run.

#ifndef STAGE_TESTS_SUPPORT_RANDOM_WORLD_HH
#define STAGE_TESTS_SUPPORT_RANDOM_WORLD_HH

#include <cstdint>
#include <string>
#include <vector>

#include "stage.hh"

namespace random_world {

inline constexpr double kUniformReturn = 1;  ///< the default of ranger_return

/// A random world file: robots with rangers among boxes and polygons, with varied sizes, heights,
/// resolutions and positions.
class WorldText {
 public:
  /// The values of ranger_return: any, or one besides -1, so that devices find ranges.
  enum class Returns { kAny, kUniform };
  explicit WorldText(uint64_t seed, Returns returns = Returns::kAny);

  const std::string& text() const { return text_; }
  double resolution() const { return cell_; }
  uint64_t steps() const { return steps_; }
  uint64_t seed() const { return seed_; }
  Returns returns() const { return returns_; }

 private:
  bool Chance(double probability) { return random_.Uniform() < probability; }
  double Return(double value) const {
    return returns_ == Returns::kAny || value < 0 ? value : kUniformReturn;
  }
  uint32_t Below(uint32_t n) { return static_cast<uint32_t>(random_.Next() % n); }
  template <typename T, size_t n>
  T OneOf(const T (&values)[n]) {
    return values[Below(n)];
  }

  std::string Pose(double z);
  std::string LocalPose(double reach, double z);
  double Heading();
  std::string Polygon(double reach);
  std::string Body(double size);
  std::string Obstacle();
  std::string Sensor();
  std::string Ranger(double reach);
  std::string Robot(uint32_t number);

  Stg::RandomStream random_;
  uint64_t seed_;
  Returns returns_;
  double cell_;  // metres
  double centre_x_, centre_y_;
  double half_width_;  // metres
  uint64_t steps_;
  std::string text_;
};

/// Drives a world's robots and changes its models at the end of each step. The changes are
/// determined by the seed, the models' names and the step.
class Driver {
 public:
  /// `cell`: resolution, metres. `early`: some poses are set during the updates, by timed callbacks
  /// and by velocity callbacks.
  Driver(uint64_t seed, double cell, bool early,
         WorldText::Returns returns = WorldText::Returns::kAny)
      : seed_(seed), cell_(cell), early_(early), returns_(returns) {}
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;
  void Attach(Stg::World* world);

 private:
  struct Jump {
    std::string name;
    Stg::Pose home;
    uint64_t until;
  };

  static int UpdateWorld(Stg::World* world, void* driver);
  static int UpdatePosition(Stg::Model* model, void* driver);
  static int JumpEarly(Stg::Model* model, void* driver);
  static int PushSomebody(Stg::Model* model, void* driver);

  bool Chance(double probability) { return random_.Uniform() < probability; }
  size_t Below(size_t n) { return static_cast<size_t>(random_.Next() % n); }
  Stg::Model* Any();
  Stg::Model* AnyAtTop();
  Stg::ModelRanger* AnyRanger();
  void DriveAll();
  void ChangeSomething();
  void Create();
  void Delete();
  void JumpAway();
  void JumpHome();
  void ChangeBody();
  void ChangeVisibility();
  void ChangeSensor();
  void ChangeParent();
  void ChangeSubscription();

  uint64_t seed_;
  double cell_;
  bool early_;
  WorldText::Returns returns_;
  Stg::World* world_ = nullptr;
  Stg::RandomStream random_;
  std::vector<Jump> jumps_;
};

struct Outcome {
  std::vector<uint64_t> hashes;  ///< state hashes at the beginning and after each step
  uint64_t device_steps = 0;
  uint64_t rays = 0;
  uint64_t hits = 0;          ///< occupied cells that were examined
  uint64_t resumed = 0;       ///< rays that continued past the end of their hit list
  uint64_t ranges_given = 0;  ///< rays whose ranges came from a device
};

/// Loads a world with these options and runs it with a Driver.
Outcome RunWorld(const WorldText& world, const Stg::RunOptions& options, bool early = false);
/// Loads a world file with these options and runs it with its own controllers.
Outcome RunFile(const std::string& path, uint64_t steps, const Stg::RunOptions& options);

/// Discards standard output while the object lives.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  int saved_;
};

}  // namespace random_world

#endif
