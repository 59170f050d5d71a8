// SPDX-License-Identifier: GPL-2.0-or-later
//
// Contact forces of an island, and the motions that follow from them.
//
// All forces on a body balance. At each contact, the normal force keeps the outlines apart and
// never pulls, and friction obeys Coulomb's law. The force of the floor on a body is inside its
// limit surface while the body does not slip on its belt. While it slips, the force is on the
// surface, against the slip.
//
// They are found by letting the bodies move in a made-up time. Each has a mass, such that its grip
// changes its motion by a typical motion of the island in one step of that time. Friction with
// the floor brings it to rest on its belt. Each step is solved by a sweep of projected Gauss-Seidel
// over the contacts, as in engines for dynamics. Where nothing changes any more, all forces
// balance, and the masses have no influence on the result. A body that touches nothing pushable
// needs no such time: its motion is the nearest to what is wanted that its contacts allow, found by
// sweeps alone.

#include "messages/assert.hh"
#include "motion/island.hh"

namespace Stg::motion {
namespace {

double Speed(const Motion& motion, Vector n, double arm) {
  return n.x * motion.x + n.y * motion.y + motion.turn * arm;
}

}  // namespace

/// Adds a force to a body, and what it does to its motion.
inline void IslandSolver::Apply(Body* body, Vector direction, double arm, double amount) {
  body->force.x += amount * direction.x;
  body->force.y += amount * direction.y;
  body->force.turn += amount * arm;
  body->motion.x += amount * body->mass * direction.x;
  body->motion.y += amount * body->mass * direction.y;
  body->motion.turn += amount * body->inertia * arm;
}

IslandSolver::Response IslandSolver::ResponseTo(const Body& body, const double arm[2]) {
  return {body.mass + body.inertia * arm[0] * arm[0], body.mass + body.inertia * arm[0] * arm[1],
          body.mass + body.inertia * arm[1] * arm[1]};
}

/// The forces f >= 0 with K f >= wanted where each that is positive gives its wanted speed exactly.
/// All four cases are tried, so the order of the points does not matter.
void IslandSolver::SolveTwo(const Response& k, const double wanted[2], double force[2]) {
  const double determinant = k.first * k.second - k.both * k.both;
  force[0] = force[1] = 0.0;
  if (wanted[0] <= 0.0 && wanted[1] <= 0.0) return;
  if (determinant > 1e-9 * k.first * k.second) {
    const double first = (k.second * wanted[0] - k.both * wanted[1]) / determinant;
    const double second = (k.first * wanted[1] - k.both * wanted[0]) / determinant;
    if (first >= 0.0 && second >= 0.0) {
      force[0] = first;
      force[1] = second;
      return;
    }
  }
  const double first = wanted[0] / k.first, second = wanted[1] / k.second;
  if (first > 0.0 && k.both * first >= wanted[1])
    force[0] = first;
  else
    force[1] = Most(second, 0.0);
}

void IslandSolver::AddTouch(const Pair& pair, const Separation& separation) {
  const Body& a = bodies_[pair.a];
  const bool wall = pair.b == Nearby::kNone;
  const Manifold manifold = FindManifold(HullAt(pair.hull_a), HullAt(pair.hull_b), separation);
  Touch touch{};
  touch.a = pair.a;
  touch.b = pair.b;
  touch.kind = pair.kind;
  touch.count = manifold.count;
  touch.normal = manifold.normal;
  touch.friction = pair.friction;
  Vector middle_a, middle_b;
  for (uint32_t k = 0; k < manifold.count; k++) {
    // Bodies that overlap are pushed apart slowly, because the way may be long.
    touch.room[k] = Most(manifold.gap[k], 0.0) - kSkin;
    const Vector on_a = manifold.on_a[k] - a.position;
    touch.arm_a[k] = Cross(on_a, manifold.normal);
    middle_a = middle_a + (1.0 / manifold.count) * on_a;
    if (wall) continue;
    const Vector on_b = manifold.on_b[k] - bodies_[pair.b].position;
    touch.arm_b[k] = Cross(on_b, manifold.normal);
    middle_b = middle_b + (1.0 / manifold.count) * on_b;
  }
  touch.slide_arm_a = Cross(middle_a, Left(manifold.normal));
  touch.slide_arm_b = Cross(middle_b, Left(manifold.normal));
  touch.of_a = ResponseTo(a, touch.arm_a);
  touch.slide_of_a = a.mass + a.inertia * touch.slide_arm_a * touch.slide_arm_a;
  if (pair.kind != Kind::kFixed) {
    const Body& b = bodies_[pair.b];
    touch.of_b = ResponseTo(b, touch.arm_b);
    touch.slide_of_b = b.mass + b.inertia * touch.slide_arm_b * touch.slide_arm_b;
  }
  touches_.push_back(touch);
  if (pair.kind == Kind::kForce) bodies_[pair.a].pushes = bodies_[pair.b].pushes = true;
}

/// Normal forces of a wall, or of bodies that push each other.
void IslandSolver::SolvePush(Touch* touch) {
  Body& a = bodies_[touch->a];
  Body* b = touch->kind == Kind::kForce ? &bodies_[touch->b] : nullptr;
  const Response &of_a = touch->of_a, &of_b = touch->of_b;  // the latter is 0 if b is fixed
  const Response response{of_a.first + of_b.first, of_a.both + of_b.both,
                          of_a.second + of_b.second};
  double wanted[2], force[2] = {0.0, 0.0};
  for (uint32_t k = 0; k < touch->count; k++) {
    wanted[k] = Speed(a.motion, touch->normal, touch->arm_a[k]) - touch->room[k];
    if (b != nullptr) wanted[k] -= Speed(b->motion, touch->normal, touch->arm_b[k]);
  }
  if (touch->count == 1) {
    force[0] = Most(wanted[0] / response.first + touch->push_a[0], 0.0);
  } else {
    wanted[0] += response.first * touch->push_a[0] + response.both * touch->push_a[1];
    wanted[1] += response.both * touch->push_a[0] + response.second * touch->push_a[1];
    SolveTwo(response, wanted, force);
  }
  for (uint32_t k = 0; k < touch->count; k++) {
    const double change = force[k] - touch->push_a[k];
    if (change == 0.0) continue;
    touch->push_a[k] = force[k];
    Apply(&a, touch->normal, touch->arm_a[k], -change);
    if (b != nullptr) Apply(b, touch->normal, touch->arm_b[k], change);
  }
}

/// Normal forces between bodies that stop at each other. Each is stopped by a front at which both
/// agree. The front is where it hinders neither if possible. Otherwise it stands, or moves with the
/// slower of two that go the same way; so neither pushes the other.
void IslandSolver::SolveSplit(Touch* touch) {
  Body &a = bodies_[touch->a], &b = bodies_[touch->b];
  const Response &of_a = touch->of_a, &of_b = touch->of_b;
  const double *push_a = touch->push_a, *push_b = touch->push_b;
  double wanted_a[2], wanted_b[2], force_a[2] = {0.0, 0.0}, force_b[2] = {0.0, 0.0};
  for (uint32_t k = 0; k < touch->count; k++) {
    const double own_a = k == 0 ? of_a.first : of_a.second;
    const double own_b = k == 0 ? of_b.first : of_b.second;
    double free_a = Speed(a.motion, touch->normal, touch->arm_a[k]) + own_a * push_a[k];
    double free_b = Speed(b.motion, touch->normal, touch->arm_b[k]) - own_b * push_b[k];
    if (touch->count == 2) {
      free_a += of_a.both * push_a[1 - k];
      free_b -= of_b.both * push_b[1 - k];
    }
    const double room = touch->room[k], with_b = free_b + room;
    const double front = Clamp(0.5 * room, Least(free_a, with_b), Most(free_a, with_b));
    wanted_a[k] = free_a - front;
    wanted_b[k] = front - room - free_b;
  }
  if (touch->count == 1) {
    force_a[0] = Most(wanted_a[0] / of_a.first, 0.0);
    force_b[0] = Most(wanted_b[0] / of_b.first, 0.0);
  } else {
    SolveTwo(of_a, wanted_a, force_a);
    SolveTwo(of_b, wanted_b, force_b);
  }
  for (uint32_t k = 0; k < touch->count; k++) {
    if (force_a[k] != push_a[k]) Apply(&a, touch->normal, touch->arm_a[k], push_a[k] - force_a[k]);
    if (force_b[k] != push_b[k]) Apply(&b, touch->normal, touch->arm_b[k], force_b[k] - push_b[k]);
    touch->push_a[k] = force_a[k];
    touch->push_b[k] = force_b[k];
  }
}

/// Friction, which brings the motions along the tangent to the same speed as far as its limit lets
/// it. Between bodies that cannot be pushed, neither carries the other along.
void IslandSolver::SolveFriction(Touch* touch) {
  Body& a = bodies_[touch->a];
  const Vector t = Left(touch->normal);
  const double limit_a = touch->friction * (touch->push_a[0] + touch->push_a[1]);
  const double limit_b = touch->friction * (touch->push_b[0] + touch->push_b[1]);
  if (limit_a == 0.0 && limit_b == 0.0 && touch->rub_a == 0.0 && touch->rub_b == 0.0) return;
  const double own_a = touch->slide_of_a, own_b = touch->slide_of_b;
  const double speed_a = Speed(a.motion, t, touch->slide_arm_a);
  // Friction drives a by -rub_a along the tangent, b by +rub_a, or +rub_b if split.
  const auto set = [&](Body* body, double arm, double sign, double target, double* rub) {
    const double change = target - *rub;
    if (change == 0.0) return;
    *rub = target;
    Apply(body, t, arm, sign * change);
  };
  if (touch->kind == Kind::kFixed) {
    const double wanted = touch->rub_a + speed_a / own_a;
    set(&a, touch->slide_arm_a, -1.0, Clamp(wanted, -limit_a, limit_a), &touch->rub_a);
    return;
  }
  Body& b = bodies_[touch->b];
  const double speed_b = Speed(b.motion, t, touch->slide_arm_b);
  if (touch->kind == Kind::kForce) {
    const double wanted = touch->rub_a + (speed_a - speed_b) / (own_a + own_b);
    const double target = Clamp(wanted, -limit_a, limit_a);
    double unused = touch->rub_a;
    set(&b, touch->slide_arm_b, 1.0, target, &unused);
    set(&a, touch->slide_arm_a, -1.0, target, &touch->rub_a);
    return;
  }
  const double free_a = speed_a + own_a * touch->rub_a, free_b = speed_b - own_b * touch->rub_b;
  const double common = Clamp(0.0, Least(free_a, free_b), Most(free_a, free_b));
  set(&a, touch->slide_arm_a, -1.0, Clamp((free_a - common) / own_a, -limit_a, limit_a),
      &touch->rub_a);
  set(&b, touch->slide_arm_b, 1.0, Clamp((common - free_b) / own_b, -limit_b, limit_b),
      &touch->rub_b);
}

void IslandSolver::SolveTouch(Touch* touch) {
  if (touch->kind == Kind::kSplit)
    SolveSplit(touch);
  else
    SolvePush(touch);
  if (touch->friction > 0.0) SolveFriction(touch);
}

/// The floor's force: it stops the slip on the belt, as far as the limit surface lets it.
void IslandSolver::SolveFloor(Body* body) {
  const Motion &floor = body->floor, &wanted = body->wanted;
  Motion& motion = body->motion;
  const double x = floor.x - (motion.x - wanted.x) / body->mass;
  const double y = floor.y - (motion.y - wanted.y) / body->mass;
  const double torque = floor.turn - (motion.turn - wanted.turn) / body->inertia;
  const double leverage = torque / body->arm;
  const double force = std::sqrt(x * x + y * y + leverage * leverage);
  const double part = force > body->grip ? body->grip / force : 1.0;
  const Motion now{part * x, part * y, part * torque};
  motion.x += body->mass * (now.x - floor.x);
  motion.y += body->mass * (now.y - floor.y);
  motion.turn += body->inertia * (now.turn - floor.turn);
  body->floor = now;
}

void IslandSolver::SetMasses() {
  typical_ = 1e-30;  // positive even if what is wanted is too small for squares
  for (size_t i = 0; i < members_; i++)
    typical_ = Most(typical_, Distance(bodies_[i].wanted, {}, bodies_[i].arm));
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    body.motion = body.wanted;
    body.floor = body.force = {};
    body.mass = typical_ / body.grip;
    body.inertia = body.mass / (body.arm * body.arm);
  }
}

void IslandSolver::SolveForces(const Effort& effort) {
  if (touches_.empty()) return;
  bool pushing = false;
  for (const Touch& touch : touches_) pushing |= touch.kind == Kind::kForce;
  const int most = pushing ? effort.push_sweeps : effort.sweeps;
  before_.resize(members_);
  for (int sweep = 0; sweep < most; sweep++)
    if (Sweep(sweep) < kConverged) break;
}

/// A step of the made-up time. Returns the greatest change of a motion that a force has made.
double IslandSolver::Sweep(int number) {
  double change = 0.0;
  const auto note_change = [&](size_t i) {
    change = Most(change, Distance(bodies_[i].motion, before_[i], bodies_[i].arm));
    before_[i] = bodies_[i].motion;
  };
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    before_[i] = body.motion;
    if (!body.pushes || number == 0) continue;
    body.motion.x += body.mass * (body.force.x + body.floor.x);
    body.motion.y += body.mass * (body.force.y + body.floor.y);
    body.motion.turn += body.inertia * (body.force.turn + body.floor.turn);
    note_change(i);
  }
  for (size_t k = 0; k < touches_.size(); k++)
    SolveTouch(&touches_[number % 2 == 0 ? k : touches_.size() - 1 - k]);
  for (size_t i = 0; i < members_; i++) {
    note_change(i);
    if (!bodies_[i].pushes) continue;
    SolveFloor(&bodies_[i]);
    note_change(i);
  }
  return change;
}

}  // namespace Stg::motion
