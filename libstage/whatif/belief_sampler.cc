// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/belief_sampler.hh"

#include <algorithm>

#include "geometry/trigonometry.hh"
#include "kernels/row_behaviour.h"
#include "messages/assert.hh"
#include "models/noise.hh"
#include "motion/drive.hh"
#include "rows/planar.hh"

namespace Stg::whatif {

namespace {

/// Adds errors with these covariances.
void AddErrors(const CovarianceFactor& factor, RandomStream* random, Pose* to) {
  const double x = NormalError(random), y = NormalError(random), a = NormalError(random);
  const double* const l = factor.values;
  to->x += l[0] * x;
  to->y += l[1] * x + l[2] * y;
  to->a = normalize(to->a + l[3] * x + l[4] * y + l[5] * a);
}

/// Velocity in the frame of a disc with this heading, which it keeps.
rows::Planar InFrame(const Velocity& velocity, double heading) {
  const SineCosine turn = SinCos(heading);
  return {velocity.x * turn.cosine + velocity.y * turn.sine,
          velocity.y * turn.cosine - velocity.x * turn.sine, 0};
}

/// Makes a mover drive with a velocity in its own frame, as it does already.
void Drive(const rows::Planar& velocity, size_t mover, rows::Columns* columns) {
  columns->mode[mover] = DriveInput::kVelocity;
  columns->command[mover] = columns->velocity[mover] = velocity;
}

double KindOf(Behaviour::Kind kind) {
  switch (kind) {
    case Behaviour::kStand:
      return ROW_STANDS;
    case Behaviour::kGoOn:
      return ROW_GOES_ON;
    case Behaviour::kGoTo:
      return ROW_GOES_STRAIGHT;
    case Behaviour::kSocialForce:
      return ROW_WALKS;
    case Behaviour::kOrca:
      return ROW_EVADES;
  }
  return ROW_STANDS;
}

const Behaviour& Choose(const std::vector<Behaviour>& behaviours, RandomStream* random) {
  static const Behaviour goes_on;
  const double place = random->Uniform();
  if (behaviours.empty()) return goes_on;
  double sum = 0, all = 0;
  for (const Behaviour& each : behaviours) all += each.weight;
  for (const Behaviour& each : behaviours)
    if ((sum += each.weight) > place * all) return each;
  return behaviours.back();
}

}  // namespace

void BeliefSampler::Draw(const BeliefContent& belief, uint64_t seed, uint32_t number,
                         rows::Rows* to) const {
  const uint64_t of_sample = MixSeeds(seed, number);
  to->Reset(0, of_sample);
  RandomStream random(MixSeeds(of_sample, 0));
  Pose pose = belief.robot.pose;
  Velocity velocity = belief.robot.velocity;
  AddErrors(belief.robot.pose_errors, &random, &pose);
  AddErrors(belief.robot.velocity_errors, &random, &velocity);
  to->PlaceMover(0, robot_, pose);
  Drive({velocity.x, velocity.y, velocity.a}, robot_, &to->columns);
  for (size_t i = 0; i < belief.others.size(); i++) {
    RandomStream of_other(MixSeeds(of_sample, belief.others[i].id + 1));
    DrawOther(belief, i, &of_other, to);
  }
}

/// Draws again while somebody would be in an obstacle or in the robot, but not for ever: what is
/// believed may be like that.
void BeliefSampler::DrawOther(const BeliefContent& belief, size_t other, RandomStream* random,
                              rows::Rows* to) const {
  constexpr int kAttempts = 16;
  const BeliefContent::Moving& moving = belief.moving[other];
  const uint32_t mover = others_[other];
  const Behaviour& behaviour = Choose(belief.others[other].behaviours, random);
  Velocity velocity = moving.velocity;
  AddErrors(moving.velocity_errors, random, &velocity);
  Pose pose;
  for (int attempt = 0; attempt <= kAttempts; attempt++) {
    pose = moving.pose;
    if (attempt < kAttempts) AddErrors(moving.pose_errors, random, &pose);
    to->PlaceMover(0, mover, pose);
    if (IsFree(belief, mover, to)) break;
  }
  if (behaviour.kind == Behaviour::kStand) velocity = Velocity();
  Drive(InFrame(velocity, pose.a), mover, &to->columns);
  double* const memory = MemoryOf(mover, to);
  memory[ROW_BEHAVIOUR_KIND] = KindOf(behaviour.kind);
  memory[ROW_BEHAVIOUR_X] = behaviour.x;
  memory[ROW_BEHAVIOUR_Y] = behaviour.y;
  memory[ROW_BEHAVIOUR_SPEED] =
      behaviour.speed > 0 ? behaviour.speed : Hypotenuse(velocity.x, velocity.y);
  memory[ROW_BEHAVIOUR_VX] = memory[ROW_BEHAVIOUR_WALK_X] = velocity.x;
  memory[ROW_BEHAVIOUR_VY] = memory[ROW_BEHAVIOUR_WALK_Y] = velocity.y;
  memory[ROW_BEHAVIOUR_RATE] = 0;
}

/// The numbers of the controller of somebody, see kernels/row_behaviour.h.
double* BeliefSampler::MemoryOf(uint32_t mover, rows::Rows* rows) const {
  for (const rows::ControlGroup& group : rows->scene().controls.groups) {
    const auto control = std::ranges::find(group.controls, mover, &rows::Control::mover);
    if (control == group.controls.end()) continue;
    STAGE_ASSERT(group.memory_size == ROW_BEHAVIOUR_SIZE);
    const auto place = static_cast<size_t>(control - group.controls.begin());
    return &rows->columns.memory[group.first_memory + place * group.memory_size];
  }
  STAGE_ASSERT(false);
  return nullptr;
}

bool BeliefSampler::IsInObstacle(const BeliefContent& belief, uint32_t mover, rows::Rows* rows) {
  const rows::Planar& here = rows->columns.pose[mover];
  return belief.IsOccupied(here.x, here.y) || rows->IsInObstacle(0, mover);
}

bool BeliefSampler::IsFree(const BeliefContent& belief, uint32_t mover, rows::Rows* rows) const {
  if (IsInObstacle(belief, mover, rows)) return false;
  const rows::Planar& here = rows->columns.pose[mover];
  const rows::Planar& robot = rows->columns.pose[robot_];
  const double x = here.x - robot.x, y = here.y - robot.y;
  const Size size = rows->scene().movers[robot_].model->GetGeom().size;
  const double least = belief.options.other_radius + std::min(size.x, size.y) / 2;
  return x * x + y * y >= least * least;
}

std::string BeliefSampler::WhyNotFree(const BeliefContent& belief, rows::Rows* rows) const {
  rows->Reset(0, 1);
  rows->PlaceMover(0, robot_, belief.robot.pose);
  if (!IsInObstacle(belief, robot_, rows)) return "";
  return "the robot is believed to be in an obstacle, at " + std::to_string(belief.robot.pose.x) +
         " " + std::to_string(belief.robot.pose.y);
}

}  // namespace Stg::whatif
