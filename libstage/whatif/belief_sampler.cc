// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/belief_sampler.hh"

#include <algorithm>

#include "geometry/trigonometry.hh"
#include "kernels/row_behaviour.h"
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
    case Behaviour::kController:  // of that name: there are no arguments
    case Behaviour::kRule:        // has no controller
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
  static const Behaviour goes_on;  // needs no other group than BeliefContent::ForEachGroup() says
  const double place = random->Uniform();
  if (behaviours.empty()) return goes_on;
  double sum = 0, all = 0;
  for (const Behaviour& each : behaviours) all += each.weight;
  for (const Behaviour& each : behaviours)
    if ((sum += each.weight) > place * all) return each;
  return behaviours.back();
}

}  // namespace

bool DrawnOthers::HasRules() const {
  return std::ranges::any_of(
      others, [](const Drawn& each) { return each.behaviour->kind == Behaviour::kRule; });
}

BeliefSampler::BeliefSampler(const rows::Scene& scene, uint32_t robot, std::vector<Group> groups)
    : robot_(robot), groups_(std::move(groups)), memory_(scene.movers.size(), kNoMemory) {
  for (const rows::ControlGroup& group : scene.controls.groups)
    for (size_t i = 0; i < group.controls.size(); i++)
      if (group.memory_size == ROW_BEHAVIOUR_SIZE)
        memory_[group.controls[i].mover] = group.first_memory + i * group.memory_size;
}

const BeliefSampler::Group* BeliefSampler::Find(uint32_t kind,
                                                const std::string& controller) const {
  for (const Group& group : groups_)
    if (group.kind == kind && group.controller == controller) return &group;
  return nullptr;
}

bool BeliefSampler::Fits(const BeliefContent& belief) const {
  return std::ranges::all_of(belief.groups, [&](const BeliefContent::Group& wanted) {
    const Group* const group = Find(wanted.kind, wanted.controller);
    return wanted.used == 0 || (group && group->slots.size() >= wanted.used);
  });
}

void BeliefSampler::Assign(const BeliefContent& belief) {
  const size_t groups = belief.groups.size();
  wanted_.clear();
  for (const BeliefContent::Group& group : belief.groups)
    wanted_.push_back(Find(group.kind, group.controller));
  taken_.assign(groups, 0);
  slots_.assign(belief.others.size() * groups, UINT32_MAX);
  for (size_t i = 0; i < belief.others.size(); i++)
    belief.ForEachGroup(belief.others[i],
                        [&](size_t group) { slots_[i * groups + group] = taken_[group]++; });
}

void BeliefSampler::Draw(const BeliefContent& belief, uint64_t seed, uint32_t number,
                         rows::Rows* to, DrawnOthers* drawn) const {
  const uint64_t of_sample = MixSeeds(seed, number);
  to->Reset(0, of_sample);
  RandomStream random(MixSeeds(of_sample, 0));
  Pose pose = belief.robot.pose;
  Velocity velocity = belief.robot.velocity;
  AddErrors(belief.robot.pose_errors, &random, &pose);
  AddErrors(belief.robot.velocity_errors, &random, &velocity);
  to->PlaceMover(0, robot_, pose);
  Drive({velocity.x, velocity.y, velocity.a}, robot_, &to->columns);
  drawn->others.clear();
  for (size_t i = 0; i < belief.others.size(); i++) {
    RandomStream of_other(MixSeeds(of_sample, belief.others[i].id + 1));
    const Behaviour& behaviour = Choose(belief.others[i].behaviours, &of_other);
    drawn->others.push_back(
        {belief.others[i].id, &behaviour, DrawOther(belief, i, behaviour, &of_other, to)});
  }
}

/// Draws the place of an other in row 0 again while it is in an obstacle or in the robot, but not
/// for ever: what is believed may be like that. Returns false if no free place was found.
bool BeliefSampler::Place(const BeliefContent& belief, size_t other, uint32_t mover,
                          RandomStream* random, rows::Rows* to) const {
  constexpr int kAttempts = 16;
  const BeliefContent::Moving& moving = belief.moving[other];
  for (int attempt = 0; attempt <= kAttempts; attempt++) {
    Pose pose = moving.pose;
    if (attempt < kAttempts) AddErrors(moving.pose_errors, random, &pose);
    to->PlaceMover(0, mover, pose);
    if (IsFree(belief, other, mover, to)) return true;
  }
  return PlaceBesideRobot(belief, other, mover, to);
}

/// Bodies do not overlap, so somebody who is believed to be in the robot is beside it: as near as
/// possible to where he is believed to be. Returns false if there is no free place beside it.
bool BeliefSampler::PlaceBesideRobot(const BeliefContent& belief, size_t other, uint32_t mover,
                                     rows::Rows* to) const {
  constexpr int kDirections = 24;
  const Pose& believed = belief.moving[other].pose;
  const rows::Planar robot = to->columns.pose[robot_];
  const double distance = LeastDistance(belief, other, *to) * (1 + 1e-12);
  const double x = believed.x - robot.x, y = believed.y - robot.y;
  if (Hypotenuse(x, y) >= distance) return false;
  const double direction = x == 0 && y == 0 ? robot.a : ArcTangent(y, x);
  for (int i = 0; i < kDirections; i++) {
    const int turns = i % 2 == 0 ? i / 2 : -(i + 1) / 2;
    const SineCosine turn = SinCos(direction + turns * (2 * M_PI / kDirections));
    to->PlaceMover(
        0, mover,
        {robot.x + distance * turn.cosine, robot.y + distance * turn.sine, believed.z, believed.a});
    if (IsFree(belief, other, mover, to)) return true;
  }
  to->PlaceMover(0, mover, believed);
  return false;
}

/// Somebody who has no free place stands, because he could not move, which takes long to find.
BeliefSlot BeliefSampler::DrawOther(const BeliefContent& belief, size_t other,
                                    const Behaviour& behaviour, RandomStream* random,
                                    rows::Rows* to) const {
  const BeliefContent::Moving& moving = belief.moving[other];
  const size_t group = belief.GroupOf(belief.others[other].kind, behaviour);
  const uint32_t taken = slots_[other * belief.groups.size() + group];
  const BeliefSlot& slot = wanted_[group]->slots[taken];
  Velocity velocity = moving.velocity;
  AddErrors(moving.velocity_errors, random, &velocity);
  const bool is_free = Place(belief, other, slot.mover, random, to);
  static const Behaviour standing(Behaviour::kStand);
  const bool stands = behaviour.kind == Behaviour::kStand || !is_free;
  if (stands) velocity = Velocity();
  Drive(InFrame(velocity, to->columns.pose[slot.mover].a), slot.mover, &to->columns);
  if (wanted_[group]->controller == BeliefContent::kBehaviours)
    SetMemory(stands ? standing : behaviour, velocity, &to->columns.memory[memory_[slot.mover]]);
  return slot;
}

/// Writes the numbers of stage/behaviour, see kernels/row_behaviour.h.
void BeliefSampler::SetMemory(const Behaviour& behaviour, const Velocity& velocity,
                              double* memory) const {
  memory[ROW_BEHAVIOUR_KIND] = KindOf(behaviour.kind);
  memory[ROW_BEHAVIOUR_X] = behaviour.x;
  memory[ROW_BEHAVIOUR_Y] = behaviour.y;
  memory[ROW_BEHAVIOUR_SPEED] =
      behaviour.speed > 0 ? behaviour.speed : Hypotenuse(velocity.x, velocity.y);
  memory[ROW_BEHAVIOUR_VX] = memory[ROW_BEHAVIOUR_WALK_X] = velocity.x;
  memory[ROW_BEHAVIOUR_VY] = memory[ROW_BEHAVIOUR_WALK_Y] = velocity.y;
  memory[ROW_BEHAVIOUR_RATE] = 0;
}

bool BeliefSampler::IsInObstacle(const BeliefContent& belief, uint32_t mover, rows::Rows* rows) {
  const rows::Planar& here = rows->columns.pose[mover];
  return belief.IsOccupied(here.x, here.y) || rows->IsInObstacle(0, mover);
}

bool BeliefSampler::IsFree(const BeliefContent& belief, size_t other, uint32_t mover,
                           rows::Rows* rows) const {
  if (IsInObstacle(belief, mover, rows)) return false;
  const rows::Planar& here = rows->columns.pose[mover];
  const rows::Planar& robot = rows->columns.pose[robot_];
  const double x = here.x - robot.x, y = here.y - robot.y;
  const double least = LeastDistance(belief, other, *rows);
  return x * x + y * y >= least * least;
}

double BeliefSampler::LeastDistance(const BeliefContent& belief, size_t other,
                                    const rows::Rows& rows) const {
  const Size size = rows.scene().movers[robot_].model->GetGeom().size;
  return belief.RadiusOf(other) + std::min(size.x, size.y) / 2;
}

std::string BeliefSampler::WhyNotFree(const BeliefContent& belief, rows::Rows* rows) const {
  rows->Reset(0, 1);
  rows->PlaceMover(0, robot_, belief.robot.pose);
  if (!IsInObstacle(belief, robot_, rows)) return "";
  return "the robot is believed to be in an obstacle, at " + std::to_string(belief.robot.pose.x) +
         " " + std::to_string(belief.robot.pose.y);
}

}  // namespace Stg::whatif
