// SPDX-License-Identifier: GPL-2.0-or-later
//
// Geometry of two convex pieces: how far apart they are, where they touch, and how much of their
// motions they can make before they come too near.

#ifndef STAGE_MOTION_SEPARATION_HH
#define STAGE_MOTION_SEPARATION_HH

#include <cstdint>

#include "motion/vector.hh"

namespace Stg::motion {

// Distances between outlines, in metres. No motion brings outlines nearer to each other than kHard;
// bodies that are in contact are kept kSkin apart; outlines nearer than kTouch are in contact. The
// difference between kSkin and kHard takes up the errors of the contact forces, which take the
// paths of turning corners for straight lines.
constexpr double kHard = 2e-5;
constexpr double kSkin = 4e-4;
constexpr double kTouch = 8e-4;

/// A convex polygon in the world, with everything within `radius` of it.
struct Hull {
  const Vector* corners;
  uint32_t count;
  double radius;
};

struct Separation {
  Vector normal;  // unit vector from a to b
  double gap;     // width of the empty strip between a and b across the normal; negative: overlap
  uint32_t a, b;  // the corners that are nearest along the normal
};

/// The separation of two hulls. The gap is the true width across the normal that is found, whether
/// or not the search for the best normal has converged. `guess` is any unit vector; the search is
/// shortest with the normal of a moment ago.
Separation Separate(const Hull& a, const Hull& b, Vector guess);

/// The width of the strip between a and b across a normal.
double GapAcross(const Hull& a, const Hull& b, Vector normal);

/// Up to two points at which two hulls are in contact.
struct Manifold {
  Vector normal;
  uint32_t count = 0;
  Vector on_a[2], on_b[2];
  double gap[2];
};
Manifold FindManifold(const Hull& a, const Hull& b, const Separation& separation);

/// A motion: a displacement, and a turn about the centre at constant rate meanwhile.
struct Motion {
  double x = 0.0, y = 0.0, turn = 0.0;
};

/// A piece and the motion that it is about to make.
struct Moving {
  Hull hull;
  double core;  // greatest distance of a corner from the centre
  Vector center;
  Motion motion;
};

/// The part, from 0 to 1, of their motions that a and b can make at once without coming nearer than
/// kHard, or than they are. `normal` is a guess.
double SafePart(const Moving& a, const Moving& b, Vector normal);

}  // namespace Stg::motion

#endif
