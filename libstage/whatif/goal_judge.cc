// SPDX-License-Identifier: GPL-2.0-or-later

#include "geometry/trigonometry.hh"
#include "whatif/belief.hh"

namespace Stg {

GoalJudge::GoalJudge(double x, double y, double radius, double penalty, double tolerance)
    : x_(x), y_(y), radius_(radius), penalty_(penalty), tolerance_(tolerance) {}

void GoalJudge::BeginDecision(const DecisionTask& task) {
  share_ = 1 / static_cast<double>(task.steps > 0 ? task.steps : 1);
  other_radii_ = task.other_radii;
}

bool GoalJudge::WatchSample(const Sighting* watched, const Sample&, SampleResult* result) {
  const Pose& robot = watched[0].pose;
  const double distance = Hypotenuse(x_ - robot.x, y_ - robot.y);
  result->score -= distance * share_;
  // A robot that stands is not stalled if somebody runs into it, but the other one is.
  constexpr double kNear = 0.02;  // m
  bool touches = watched[0].stalled;
  for (size_t i = 0; i < other_radii_.size() && !touches; i++) {
    const Sighting& other = watched[1 + i];
    touches = other.stalled && Hypotenuse(other.pose.x - robot.x, other.pose.y - robot.y) <
                                   radius_ + other_radii_[i] + kNear;
  }
  if (touches) {
    result->collided = true;
    result->score -= penalty_;
  }
  return touches || distance < tolerance_;
}

}  // namespace Stg
