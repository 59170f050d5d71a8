// SPDX-License-Identifier: GPL-2.0-or-later
//
// The motion of the bodies of one island.
//
// All bodies follow one rule: each stands on a belt that moves with its wanted motion, and slips on
// the belt when a force exceeds its limit surface. Pushable things have a belt that stands. Of all
// motions that the contacts allow, that of least dissipation is made. Where two bodies touch and
// neither can be pushed, both just stop at each other.
//
// Safety does not depend on the convergence of the forces: bodies make only that part of their
// motions with which no pair comes too near, as SafePart() tells.

#ifndef STAGE_MOTION_ISLAND_HH
#define STAGE_MOTION_ISLAND_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "motion/columns.hh"
#include "motion/nearby.hh"
#include "motion/separation.hh"
#include "motion/shape.hh"
#include "motion/walls.hh"

namespace Stg::motion {

/// A place where two bodies, or a body and a wall, are in contact at the end of a step.
struct Contact {
  uint32_t a, b;  // rows of bodies, a < b; if `wall` is set, b is the number of an outline
  bool wall;
  Vector point;   // halfway between the outlines
  Vector normal;  // unit vector from a to b
  double gap;     // m
};

/// Motions that change by less than this, in metres, have converged.
constexpr double kConverged = 1e-7;

/// A norm of a difference of motions, in metres.
inline double Distance(const Motion& a, const Motion& b, double arm) {
  const double x = a.x - b.x, y = a.y - b.y, turn = arm * (a.turn - b.turn);
  return std::sqrt(x * x + y * y + turn * turn);
}

/// A budget of computing, the same on all machines.
struct Effort {
  int passes = 4;         // contacts are found and solved anew
  int sweeps = 16;        // over the contacts, if nothing can be pushed
  int push_sweeps = 400;  // otherwise; they end when nothing changes
  int joint_rounds = 6;   // of lowering the parts that bodies make at once
};

/// Solves islands, one after the other. Each thread needs one of its own.
class IslandSolver {
 public:
  /// Moves the bodies of an island. Changes the rows of its members alone. Appends what is in
  /// contact at the end to `contacts`, unless that is null.
  void Solve(const Shapes& shapes, const Walls& walls, const Nearby& nearby, const Island& island,
             const Effort& effort, Columns* columns, std::vector<Contact>* contacts);

  /// Appends what is in contact in an island at the present poses.
  void FindContacts(const Shapes& shapes, const Walls& walls, const Nearby& nearby,
                    const Island& island, const Columns& columns, std::vector<Contact>* contacts);

 private:
  enum class Kind : uint8_t {
    kFixed,  // b is a wall, or a body that stands
    kSplit,  // neither can be pushed
    kForce,  // one pushes the other
  };

  struct alignas(64) Body {
    // These members are used by sweeps and lie in one line of the cache.
    Motion motion;         // in this pass
    Motion force;          // sum of the forces of all contacts
    double mass, inertia;  // inverse, of the iteration; see SolveForces()

    uint32_t row, first_corner;
    Vector position;
    double heading;
    double turned;  // since the begin of the step
    Motion wanted;  // in this pass
    Motion rest;    // not yet made
    Motion floor;   // force of the floor
    double grip, arm, core;
    double left;  // of its reach
    double bold;  // the part of the rest that is wanted in this pass
    double part, next_part;
    bool pushable, pushes;  // it can be pushed; it touches what can be pushed, or can be pushed
    bool dirty, next_dirty;
    bool moved;    // in an earlier pass
    bool arrived;  // where it would be without contacts
  };

  struct HullPlace {
    uint32_t first_corner, count;
    double radius, core;
  };

  /// A piece of a body near a piece of another, or near the edge of a wall.
  struct Pair {
    uint32_t a, b;  // in bodies_; kNone: a wall
    HullPlace hull_a, hull_b;
    Vector normal;
    double friction;
    uint32_t edge;  // of the wall
    Kind kind;
  };

  /// The response of a body's speed at two points to forces there: a symmetric matrix.
  struct Response {
    double first, both, second;
  };

  /// The forces between two pieces: at one or two points along the normal, and one of friction, as
  /// both points lie on one line of action.
  struct Touch {
    uint32_t a, b;
    Kind kind;
    uint32_t count;
    Vector normal;
    double friction;
    double room[2];
    double arm_a[2], arm_b[2];        // of the normal forces
    double slide_arm_a, slide_arm_b;  // of friction
    Response of_a, of_b;              // to normal forces
    double slide_of_a, slide_of_b;    // to friction
    double push_a[2], push_b[2];      // forces; those on b are separate in kSplit only
    double rub_a, rub_b;
  };

  void Load(const Shapes& shapes, const Walls& walls, const Nearby& nearby, const Island& island,
            const Columns& columns);
  uint32_t AddBody(uint32_t row, double reach, const Shapes& shapes, const Columns& columns);
  void AddPairs(uint32_t a, uint32_t b, const Shapes& shapes, const Columns& columns);
  void AddWallPairs(uint32_t a, uint32_t edge, const Shapes& shapes, const Walls& walls,
                    const Columns& columns);
  void AddPairIfNear(Pair* pair);
  void PlaceCorners(Body* body, const Shapes& shapes, const Columns& columns);
  bool SetWanted();
  void FindTouches(const Walls& walls);
  void AddTouch(const Pair& pair, const Separation& separation);
  bool BeyondEnd(const WallEdge& edge, const Separation& separation) const;
  static Response ResponseTo(const Body& body, const double arm[2]);
  static void Apply(Body* body, Vector direction, double arm, double amount);
  static void SolveTwo(const Response& response, const double wanted[2], double force[2]);
  void SetMasses();
  void SolveForces(const Effort& effort);
  double Sweep(int number);
  void SolveTouch(Touch* touch);
  void SolvePush(Touch* touch);
  void SolveSplit(Touch* touch);
  void SolveFriction(Touch* touch);
  void SolveFloor(Body* body);
  void CutMotions();
  void MoveTogether(int rounds, const Shapes& shapes, const Columns& columns);
  void Move(Body* body, const Columns& columns);
  bool LowerParts(bool to_zero);
  Moving MovingOf(uint32_t body, const HullPlace& place) const;
  Hull HullAt(const HullPlace& place) const;
  bool NoteRest();
  void Store(Columns* columns) const;
  void TellContacts(const Walls& walls, std::vector<Contact>* contacts) const;

  Vector origin_;             // of the coordinates below
  std::vector<Body> bodies_;  // the members, then what stands near them
  size_t members_ = 0;
  std::vector<Vector> corners_;
  std::vector<Pair> pairs_;
  std::vector<Touch> touches_;
  std::vector<uint32_t> standing_;  // index in bodies_ by row; kNone elsewhere
  std::vector<Motion> before_;
  double typical_ = 0.0;  // the greatest motion that is wanted in this pass, in metres
};

}  // namespace Stg::motion

#endif
