// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in kinds of metrics. Poses are global, in metres.

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "models/model.hh"
#include "models/position.hh"
#include "world/metric_list.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double Distance(const Pose& a, const Pose& b) {
  return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y));
}

double ReadPositive(const MetricOrder& order, const char* name, double value) {
  const double read = order.file->ReadLength(order.entity, name, value);
  if (!(read > 0))
    order.file->Fail(order.entity, name, "found 0 or less, expected a length greater than 0");
  return read;
}

/// A metric over a list of models.
class OfModels : public Metric {
 public:
  explicit OfModels(const MetricOrder& order) : models_(order.models) {}

 protected:
  size_t count() const { return models_.size(); }
  /// Calls f(index, model) for the models that still exist.
  template <typename F>
  void ForEach(const World& world, F f) const {
    for (size_t i = 0; i < models_.size(); i++)
      if (const Model* const model = world.FindModel(models_[i])) f(i, *model);
  }

 private:
  std::vector<uint32_t> models_;
};

/// Speed in metres per second; infinite for models that are not driven or are carried by others.
double SpeedOf(const Model& model) {
  const auto* const driven = dynamic_cast<const ModelPosition*>(&model);
  if (!driven || model.Parent()) return std::numeric_limits<double>::infinity();
  const Velocity velocity = driven->GetVelocity();
  return std::sqrt(velocity.x * velocity.x + velocity.y * velocity.y);
}

/// Mean distance driven in metres. Jumps, as when a client sets the pose, do not count.
class DistanceDriven : public OfModels {
 public:
  explicit DistanceDriven(const MetricOrder& order) : OfModels(order), last_(count()) {}
  void Start(World& world) override {
    sum_ = 0;
    ForEach(world, [&](size_t i, const Model& model) {
      last_[i] = {model.GetGlobalPose(), SpeedOf(model)};
    });
  }
  void Step(World& world) override {
    const double seconds = static_cast<double>(world.sim_interval) / 1e6;
    ForEach(world, [&](size_t i, const Model& model) {
      const Moment now = {model.GetGlobalPose(), SpeedOf(model)};
      const double moved = Distance(last_[i].pose, now.pose);
      // The speed may change before or after the move; 1e-6 is a rounding tolerance.
      if (moved <= std::max(last_[i].speed, now.speed) * seconds * (1 + 1e-6)) sum_ += moved;
      last_[i] = now;
    });
  }
  double Value() const override { return count() > 0 ? sum_ / static_cast<double>(count()) : 0; }

 private:
  struct Moment {
    Pose pose;
    double speed;
  };
  std::vector<Moment> last_;
  double sum_ = 0;
};

/// Total number of times that a model was stopped by another one.
class Collisions : public OfModels {
 public:
  explicit Collisions(const MetricOrder& order) : OfModels(order), stalled_(count()) {}
  void Start(World&) override {
    stalled_.assign(count(), false);
    begun_ = 0;
  }
  void Step(World& world) override {
    ForEach(world, [&](size_t i, const Model& model) {
      const bool now = model.Stalled();
      begun_ += now && !stalled_[i];
      stalled_[i] = now;
    });
  }
  double Value() const override { return static_cast<double>(begun_); }

 private:
  std::vector<bool> stalled_;
  uint64_t begun_ = 0;
};

/// Visited area in square metres: squares of side `cell` that the origin of a model has been in.
class Coverage : public OfModels {
 public:
  explicit Coverage(const MetricOrder& order)
      : OfModels(order), cell_(ReadPositive(order, "cell", 1)) {}
  void Start(World&) override { seen_.clear(); }
  void Step(World& world) override {
    ForEach(world, [&](size_t, const Model& model) {
      const Pose at = model.GetGlobalPose();
      seen_.insert({Index(at.x), Index(at.y)});
    });
  }
  double Value() const override { return static_cast<double>(seen_.size()) * cell_ * cell_; }

 private:
  int64_t Index(double x) const {
    constexpr double kFar = 1e15;
    return static_cast<int64_t>(std::clamp(std::floor(x / cell_), -kFar, kFar));
  }

  double cell_;
  std::set<std::pair<int64_t, int64_t>> seen_;
};

/// Simulated seconds until all models, or with `first 1` the first one, have come within `radius`
/// of `goal`.
class TimeToGoal : public OfModels {
 public:
  explicit TimeToGoal(const MetricOrder& order)
      : OfModels(order), radius_(ReadPositive(order, "radius", 0.5)) {
    if (order.file->ReadTuple(order.entity, "goal", 0, 2, "ll", &goal_.x, &goal_.y) == 0)
      order.file->Fail(order.entity, "goal", "found no goal, expected goal [X Y]");
    first_ = order.file->ReadInt(order.entity, "first", 0) != 0;
  }
  void Start(World&) override {
    arrived_.assign(count(), false);
    left_ = first_ && count() > 0 ? 1 : count();
    time_ = kNone;
  }
  void Step(World& world) override {
    if (left_ == 0) return;
    ForEach(world, [&](size_t i, const Model& model) {
      if (left_ == 0 || arrived_[i] || Distance(model.GetGlobalPose(), goal_) > radius_) return;
      arrived_[i] = true;
      if (--left_ == 0) time_ = static_cast<double>(world.SimTimeNow()) / 1e6;
    });
  }
  double Value() const override { return time_; }

 private:
  double radius_;
  Pose goal_;
  bool first_;  // only the first model to arrive counts
  std::vector<bool> arrived_;
  size_t left_ = 0;
  double time_ = kNone;
};

/// Smallest distance so far between the origins of two models.
class Nearest : public OfModels {
 public:
  explicit Nearest(const MetricOrder& order) : OfModels(order) { places_.reserve(count()); }
  void Start(World&) override { least_ = std::numeric_limits<double>::infinity(); }
  void Step(World& world) override {
    places_.clear();
    ForEach(world, [&](size_t, const Model& model) { places_.push_back(model.GetGlobalPose()); });
    std::sort(places_.begin(), places_.end(),
              [](const Pose& a, const Pose& b) { return a.x < b.x; });
    for (size_t i = 0; i < places_.size(); i++) {
      for (size_t j = i + 1; j < places_.size(); j++) {
        if (places_[j].x - places_[i].x >= least_) break;  // further ones are more distant
        least_ = std::min(least_, Distance(places_[i], places_[j]));
      }
    }
  }
  double Value() const override { return std::isfinite(least_) ? least_ : kNone; }

 private:
  std::vector<Pose> places_;
  double least_ = std::numeric_limits<double>::infinity();
};

template <typename Kind>
std::unique_ptr<Metric> Make(const MetricOrder& order) {
  return std::unique_ptr<Metric>(new Kind(order));
}

}  // namespace

std::map<std::string, MetricMaker> BuiltInMetrics() {
  return {{"distance", Make<DistanceDriven>},
          {"collisions", Make<Collisions>},
          {"coverage", Make<Coverage>},
          {"time_to_goal", Make<TimeToGoal>},
          {"nearest", Make<Nearest>}};
}

}  // namespace Stg
