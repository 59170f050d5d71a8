// SPDX-License-Identifier: GPL-2.0-or-later
//
// Belief: what a robot knows of the world around it, which is not a simulation. BeliefEngine:
// chooses what to do next by simulating futures that agree with the belief. Part of <stage.hh>.

#ifndef STAGE_WHATIF_BELIEF_HH
#define STAGE_WHATIF_BELIEF_HH

#include <stddef.h>
#include <stdint.h>

#include <iosfwd>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "whatif/consequence_engine.hh"

namespace Stg {

/// Covariance of x, y (metres or m/s) and heading or turn rate (radians or rad/s), by row.
struct Covariance {
  double values[9];

  /// Independent errors with these standard deviations.
  explicit Covariance(double x = 0, double y = 0, double a = 0);
};

/// Somebody before a step of a sample, for a BehaviourRule.
struct Moment {
  Sample sample;
  double time;           ///< s, since the beginning of the sample
  const Sighting* seen;  ///< of the robot, and of all others in the order of their ids
  size_t own;            ///< place in `seen` of the one who is to be moved
  uint64_t id;           ///< of the one who is to be moved
};

/// Moves others in futures, as one hypothesis of how they behave. Samples that have such a
/// behaviour are simulated in lockstep, which takes more time.
class BehaviourRule {
 public:
  virtual ~BehaviourRule() {}
  /// Writes a velocity for each moment, in the frame of the world file, which is held during the
  /// step that begins. Called once in each step with all samples, by the thread that decides.
  /// `others`: how many follow the robot in Moment::seen.
  virtual void Move(const Moment* moments, size_t count, size_t others, Velocity* velocities) = 0;
};

/// A way in which somebody may behave.
struct Behaviour {
  enum Kind {
    kStand,
    kGoOn,         ///< with its present velocity
    kGoTo,         ///< straight to a goal, and stop there
    kSocialForce,  ///< to a goal as a pedestrian, see the controller stage/pedestrian
    kOrca,         ///< to a goal by reciprocal collision avoidance, see stage/orca
    kController,   ///< as a batch controller does, see docs/controllers.md
    kRule          ///< as a function of one's own does
  };

  Kind kind;
  double weight;  ///< of its probability, above 0; those of all behaviours need not add up to 1
  double x, y;    ///< goal, m; not finite without one
  double speed;   ///< m/s, on the way to the goal; 0: that of the present velocity
  std::string controller;  ///< with its arguments, as the property `ctrl` of a world file
  std::shared_ptr<BehaviourRule> rule;

  Behaviour(Kind of = kGoOn, double w = 1)
      : kind(of), weight(w), x(kNoGoal), y(kNoGoal), speed(0) {}
  Behaviour(Kind of, double to_x, double to_y, double v = 0, double w = 1)
      : kind(of), weight(w), x(to_x), y(to_y), speed(v) {}
  explicit Behaviour(const std::string& by, double w = 1)
      : kind(kController), weight(w), x(kNoGoal), y(kNoGoal), speed(0), controller(by) {}
  explicit Behaviour(const std::shared_ptr<BehaviourRule>& by, double w = 1)
      : kind(kRule), weight(w), x(kNoGoal), y(kNoGoal), speed(0), rule(by) {}

 private:
  static constexpr double kNoGoal = std::numeric_limits<double>::quiet_NaN();
};

/// Others of a size, which are discs.
struct OtherKind {
  double radius, height;  ///< m
  /// Further properties and children in the language of world files, such as a ranger: social
  /// forces, reciprocal avoidance and controllers see walls by them.
  std::string body;
  uint32_t room;  ///< for others from the start; doubled when there are more

  explicit OtherKind(double r = 0.25, double h = 1.7, uint32_t n = 8)
      : radius(r), height(h), room(n) {}
};

/// Somebody or something that moves and is tracked.
struct TrackedOther {
  uint64_t id;  ///< as the tracker numbers it
  Pose pose;    ///< in the frame of the world file
  Covariance pose_covariance;
  Velocity velocity;  ///< in the frame of the world file, not of the other
  Covariance velocity_covariance;
  std::vector<Behaviour> behaviours;  ///< hypotheses; none: it goes on
  uint32_t kind;                      ///< index of Belief::Options::kinds

  explicit TrackedOther(uint64_t number = 0) : id(number), kind(0) {}
};

/// The belief of a robot: a world file for what is known for sure, and measurements, which are
/// changed in place 10 to 50 times a second. No change reads a file, and none allocates memory but
/// to make room for more others than ever before, and for a controller when it is named first. Only
/// one thread may use a belief at a time.
///
/// Functions return false, after a message, and change nothing if a number makes no sense.
class Belief {
 public:
  struct Options {
    std::vector<OtherKind> kinds;  ///< of others; at least one
    /// Cells of an occupancy grid, in addition to the walls of the world file; 0: there is none.
    uint32_t columns, rows;
    double resolution;   ///< m, side of a cell
    Pose origin;         ///< of the outer corner of the first cell, in the frame of the world file
    double wall_height;  ///< m, of occupied cells
    /// Cells near the place of a tracked other, up to its radius and the side of a cell, count as
    /// free: grids that are made from a robot's own sensors show others as obstacles.
    bool others_clear_cells;
    /// Contents of picture files by their names in the world file, as RunOptions::pictures has
    /// them.
    std::shared_ptr<const std::map<std::string, std::string>> pictures;

    Options()
        : kinds(1),
          columns(0),
          rows(0),
          resolution(0.05),
          wall_height(1),
          others_clear_cells(false) {}
  };

  /// Reads a world file with a position model of this name, the robot that will decide.
  Belief(const std::string& world_file, const std::string& robot,
         const Options& options = Options());
  /// Reads the text of a world file. Names of files in it are relative to the folder of `file`,
  /// which need not exist.
  Belief(std::istream& text, const std::string& file, const std::string& robot,
         const Options& options = Options());
  ~Belief();
  Belief(const Belief&) = delete;
  Belief& operator=(const Belief&) = delete;

  /// False if the file cannot be loaded or has no such robot; a message gives the reason.
  bool IsReady() const;

  /// The robot's pose in the frame of the world file, and its velocity in its own frame.
  bool SetRobot(const Pose& pose, const Velocity& velocity = Velocity(),
                const Covariance& pose_covariance = Covariance(),
                const Covariance& velocity_covariance = Covariance());
  /// Replaces the grid: `columns` times `rows` cells, row by row, the lowest first, and in a row
  /// the leftmost first. 0 is free, all others are occupied. Engines see it at their next decision.
  bool SetGrid(const uint8_t* cells, size_t count);
  /// Seconds until the robot obeys a command: it goes on with its present velocity before.
  bool SetDelay(double seconds);
  /// Adds somebody, or changes what is known of the one with this id.
  bool SetOther(const TrackedOther& other);
  /// Forgets somebody. Returns false, without a message, if there is no such id.
  bool RemoveOther(uint64_t id);
  void ClearOthers();

  const Pose& robot_pose() const;
  const Velocity& robot_velocity() const;
  double delay() const;
  const std::vector<TrackedOther>& others() const;
  const Options& options() const;

 private:
  friend class BeliefEngine;
  void Read(std::istream& text);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Something that the robot can do: a sequence of velocities in its own frame.
struct Plan {
  std::string name;
  std::vector<Velocity> commands;  ///< each is held for BeliefQuestion::hold, the last one for good

  Plan() {}
  explicit Plan(const std::string& called, const Velocity& velocity = Velocity())
      : name(called), commands(1, velocity) {}
};

/// A decision to be made. Put the plan that is chosen if nothing is known first.
struct BeliefQuestion {
  std::vector<Plan> plans;
  usec_t horizon;  ///< simulated time to look ahead, with the delay
  usec_t hold;     ///< duration of a command; 0: a step of the world
  uint64_t seed;   ///< equal seeds and beliefs have equal samples

  BeliefQuestion() : horizon(5000000), hold(0), seed(1) {}
};

/// Scores a sample by the mean distance of the robot to a goal during the horizon, in metres and
/// negative, and ends it at the goal, or when the robot touches somebody or something, which costs
/// `penalty`.
class GoalJudge : public Judge {
 public:
  /// `radius`: that of the robot, m, for contacts with others that run into it.
  GoalJudge(double x, double y, double radius, double penalty = 100, double tolerance = 0.2);

  bool NeedsWorld() const override { return false; }
  void BeginDecision(const DecisionTask& task) override;
  bool WatchSample(const Sighting* watched, const Sample& sample, SampleResult* result) override;

 private:
  double x_, y_, radius_, penalty_, tolerance_;
  double share_ = 0;  // of the horizon, that a step is
  std::vector<double> other_radii_;
};

/// Chooses among plans by their consequences in samples of a belief: each sample draws all poses,
/// velocities and behaviours, and is the same for all plans. What is simulated are closed worlds in
/// rows, on the host or on a device, with equal results.
class BeliefEngine {
 public:
  typedef ConsequenceEngine::Options Options;  ///< `watched` and `keep` are those of the engine

  /// The belief must outlive the engine.
  explicit BeliefEngine(Belief* belief, const Options& options = Options());
  ~BeliefEngine();
  BeliefEngine(const BeliefEngine&) = delete;
  BeliefEngine& operator=(const BeliefEngine&) = delete;

  /// False if the belief is not ready, or there is no device as wanted; a message gives the reason.
  bool IsReady() const;
  /// Brings a changed grid into the engine now; otherwise the next decision does. Returns why it
  /// cannot, or "".
  std::string TakeGrid();
  /// The best plan found within the budget. Judges get the sightings of the robot, followed by
  /// those of all others in the order of their ids; none of them may need a World. Decision::error
  /// says why no decision was possible; the first plan is named then.
  Decision Choose(const BeliefQuestion& question, const Budget& budget, Judge* judge);
  /// Repeats a decision about the same belief without a budget, exactly.
  Decision Replay(const BeliefQuestion& question, const Decision& decision, Judge* judge);
  /// Number of Outcome::sightings of each step: of the robot, of the others in the order of their
  /// ids, and of those that there is room for.
  size_t watched() const;
  /// Name of the device that makes whole steps; empty if there is none.
  std::string StepDevice() const;
  /// Number of steps that were made on the device.
  uint64_t steps_on_device() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg

#endif
