// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/separation.hh"

#include <initializer_list>

#include "geometry/trigonometry.hh"

namespace Stg::motion {
namespace {

/// The number of corners of a hull. `count` is this number if it is known when this is compiled, or
/// 0. Results are equal.
template <uint32_t count>
inline uint32_t CountOf(const Hull& hull) {
  return count > 0 ? count : hull.count;
}

/// Calls f<count_a, count_b>(). Most contacts are those of discs with edges of walls, for which it
/// is compiled apart.
template <typename F>
inline auto WithCounts(const Hull& a, const Hull& b, F f) {
  if (a.count == 1 && b.count == 2) return f.template operator()<1, 2>();
  return f.template operator()<0, 0>();
}

/// The first corner that is farthest along d.
template <uint32_t count>
inline uint32_t Support(const Hull& hull, Vector d) {
  uint32_t best = 0;
  double most = Dot(hull.corners[0], d);
  for (uint32_t i = 1; i < CountOf<count>(hull); i++) {
    const double along = Dot(hull.corners[i], d);
    if (along > most) {
      most = along;
      best = i;
    }
  }
  return best;
}

/// The separation of the cores, the polygons without their radii, across a given normal.
template <uint32_t count_a = 0, uint32_t count_b = 0>
inline Separation CoresAcross(const Hull& a, const Hull& b, Vector normal) {
  const uint32_t ia = Support<count_a>(a, normal), ib = Support<count_b>(b, -normal);
  return {normal, Dot(normal, b.corners[ib] - a.corners[ia]), ia, ib};
}

/// The widest strip across the normal of an edge of `of`, for cores that overlap.
void TryEdgeNormals(const Hull& a, const Hull& b, bool of_a, Separation* best) {
  const Hull& hull = of_a ? a : b;
  for (uint32_t i = 0; i < hull.count && hull.count > 1; i++) {
    const Vector edge = hull.corners[i + 1 == hull.count ? 0 : i + 1] - hull.corners[i];
    const double length = Length(edge);
    if (length == 0.0) continue;
    const Vector outward = (1.0 / length) * Vector{edge.y, -edge.x};
    const Separation found = CoresAcross(a, b, of_a ? outward : -outward);
    if (found.gap > best->gap) *best = found;
  }
}

/// For cores that overlap: the normal along which they overlap least.
Separation LeastOverlap(const Hull& a, const Hull& b, const Separation& guess) {
  Separation best = guess;
  TryEdgeNormals(a, b, true, &best);
  TryEdgeNormals(a, b, false, &best);
  return best;
}

double SquaredDistanceToSegment(Vector p, Vector q) {
  const Vector edge = q - p;
  const double square = Dot(edge, edge);
  const double t = square > 0.0 ? Clamp(-Dot(p, edge) / square, 0.0, 1.0) : 0.0;
  const Vector nearest = p + t * edge;
  return Dot(nearest, nearest);
}

/// The one or two points of the difference b - a that the search keeps.
struct Simplex {
  Vector p, q;
  bool two = false;

  /// Unit vector from the origin to the nearest point, and its distance. Drops a point that does
  /// not matter. False if the distance is almost zero.
  bool Nearest(Vector* normal, double* distance) {
    if (two) {
      const Vector edge = q - p;
      const double square = Dot(edge, edge);
      const double t = square > 0.0 ? -Dot(p, edge) / square : 0.0;
      if (t > 0.0 && t < 1.0) {
        *normal = (1.0 / std::sqrt(square)) * Left(edge);
        if (Dot(*normal, p) < 0.0) *normal = -*normal;
        *distance = Dot(*normal, p);
        return true;
      }
      if (t >= 1.0) p = q;
      two = false;
    }
    *distance = Length(p);
    if (*distance < 1e-13) return false;
    *normal = (1.0 / *distance) * p;
    return true;
  }

  /// Adds a point. False if the origin is within the triangle of all three.
  bool Add(Vector r) {
    if (!two) {
      q = r;
      two = true;
      return true;
    }
    const double first = Cross(q - p, -p), second = Cross(r - q, -q), third = Cross(p - r, -r);
    if (first > 0.0 && second > 0.0 && third > 0.0) return false;
    if (first < 0.0 && second < 0.0 && third < 0.0) return false;
    if (SquaredDistanceToSegment(p, r) <= SquaredDistanceToSegment(q, r))
      q = r;
    else
      p = r;
    return true;
  }
};

/// The algorithm of Gilbert, Johnson and Keerthi (1988), which keeps the widest strip.
template <uint32_t count_a, uint32_t count_b>
Separation SeparateCores(const Hull& a, const Hull& b, Vector guess) {
  constexpr int kTurns = 12;
  constexpr double kExact = 1e-12;
  Separation best = CoresAcross<count_a, count_b>(a, b, guess);
  Simplex simplex;
  simplex.p = b.corners[best.b] - a.corners[best.a];
  for (int turn = 0; turn < kTurns; turn++) {
    Vector normal;
    double distance;
    if (!simplex.Nearest(&normal, &distance)) return LeastOverlap(a, b, best);
    const Separation found = CoresAcross<count_a, count_b>(a, b, normal);
    if (found.gap > best.gap) best = found;
    if (found.gap >= distance - kExact) return best;
    if (!simplex.Add(b.corners[found.b] - a.corners[found.a])) return LeastOverlap(a, b, best);
  }
  return best.gap < 0.0 ? LeastOverlap(a, b, best) : best;
}

/// The edge at a corner that lies most across n.
void EdgeAt(const Hull& hull, uint32_t i, Vector n, Vector* from, Vector* to) {
  *from = *to = hull.corners[i];
  if (hull.count == 1) return;
  const Vector next = hull.corners[i + 1 == hull.count ? 0 : i + 1];
  const Vector previous = hull.corners[i == 0 ? hull.count - 1 : i - 1];
  const Vector to_next = next - *from, to_previous = previous - *from;
  const double along_next = std::fabs(Dot(to_next, n)) / Length(to_next);
  const double along_previous = std::fabs(Dot(to_previous, n)) / Length(to_previous);
  *to = along_next <= along_previous ? next : previous;
}

/// The point of the line from p to q that is `at` along t.
Vector PointAt(Vector p, Vector q, Vector t, double at) {
  const double from = Dot(p, t), length = Dot(q, t) - from;
  return std::fabs(length) > 1e-12 ? p + ((at - from) / length) * (q - p) : p;
}

// ------------------------------------------------------------------------- safe parts of motions

/// A bound of the room between a line and corners, as a function of the part t of the motion that
/// is made. A corner at p has the room p.n + t * rate(p) - curve * t^2 / 2 at least: the rate is
/// that of its path now, and `curve` bounds how fast the path bends. A minimum of concave functions
/// is concave, so between two times with enough room there is enough.
template <uint32_t count>
struct Front {
  const Hull* hull;
  Vector normal, velocity, center;
  double spin, curve, line;

  double Room(double t) const {
    const double along = Dot(normal, velocity);
    double least = 1e300;
    for (uint32_t i = 0; i < CountOf<count>(*hull); i++) {
      const Vector arm = hull->corners[i] - center;
      least = Least(least, Dot(normal, hull->corners[i]) + t * (along + spin * Cross(arm, normal)));
    }
    return least - line - 0.5 * curve * t * t;
  }
};

/// The largest time up to `rest` with room that a few bisections and secants find.
template <typename RoomAt>
double LastTimeWithRoom(RoomAt room, double rest, double room_now) {
  double low = 0.0, high = rest, at_low = room_now, at_high = room(rest);
  if (at_high >= 0.0) return rest;
  for (int i = 0; i < 5 && low == 0.0; i++) {
    const double t = 0.5 * high, at = room(t);
    if (at >= 0.0) {
      low = t;
      at_low = at;
    } else {
      high = t;
      at_high = at;
    }
  }
  for (int i = 0; i < 2 && at_low > 0.0; i++) {
    const double t = low + 0.999 * (high - low) * at_low / (at_low - at_high), at = room(t);
    if (at < 0.0) break;
    low = t;
    at_low = at;
  }
  return low;
}

/// Two pieces on their way, with the strip between them.
template <uint32_t count_a, uint32_t count_b>
struct Advance {
  const Moving &a, &b;
  Separation strip;
  double hard;  // the gap that must remain
  double rest;  // the part of the motions that is still to be made

  Vector VelocityA() const { return {a.motion.x, a.motion.y}; }
  Vector VelocityB() const { return {b.motion.x, b.motion.y}; }

  /// With a strip that stands in the world.
  double InWorld() const {
    const double edge = hard + a.hull.radius + b.hull.radius;
    const Front<count_b> front_b{&b.hull,  strip.normal,  VelocityB(),
                                 b.center, b.motion.turn, b.core * b.motion.turn * b.motion.turn,
                                 0.0};
    const Front<count_a> front_a{&a.hull,  -strip.normal, VelocityA(),
                                 a.center, a.motion.turn, a.core * a.motion.turn * a.motion.turn,
                                 0.0};
    return LastTimeWithRoom([&](double t) { return front_a.Room(t) + front_b.Room(t) - edge; },
                            rest, strip.gap - hard);
  }

  /// With a strip that turns with `host`, where the corners of `guest` move. In the axes of the
  /// world, a point of the guest moves against the host's frame with its own velocity less that of
  /// the host's point there. The path of the guest's centre, at the distance r, bends by w^2 r + 2
  /// w v at most, and its corners by their arm times the square of the difference of the turns.
  double With(const Moving& host, const Moving& guest, Vector normal, uint32_t corner) const {
    const Vector v = Vector{guest.motion.x, guest.motion.y} - Vector{host.motion.x, host.motion.y};
    const Vector r = guest.center - host.center;
    const double speed = Length(v), w = std::fabs(host.motion.turn);
    const double difference = guest.motion.turn - host.motion.turn;
    const double curve =
        w * w * (Length(r) + speed) + 2.0 * w * speed + guest.core * difference * difference;
    const double line =
        Dot(normal, host.hull.corners[corner]) + hard + a.hull.radius + b.hull.radius;
    const Front<0> front{
        &guest.hull, normal, v - host.motion.turn * Left(r), guest.center, difference, curve, line};
    return LastTimeWithRoom([&](double t) { return front.Room(t); }, rest, strip.gap - hard);
  }

  double Part() const {
    double part = InWorld();
    if (part < rest && a.motion.turn != 0.0) part = Most(part, With(a, b, strip.normal, strip.a));
    if (part < rest && b.motion.turn != 0.0) part = Most(part, With(b, a, -strip.normal, strip.b));
    return part;
  }
};

/// The gap that must remain between outlines that have a gap now. Rounding must not hold what
/// overlaps and goes along the edge of the other.
double GapToKeep(double gap) { return gap < 0.0 ? gap - 1e-12 : Least(kHard, gap); }

/// Two discs whose centres go straight: the time at which they come too near is a root.
double SafePartOfDiscs(const Moving& a, const Moving& b) {
  const Vector p = b.hull.corners[0] - a.hull.corners[0];
  const Vector v = Vector{b.motion.x, b.motion.y} - Vector{a.motion.x, a.motion.y};
  const double radii = a.hull.radius + b.hull.radius, gap = Length(p) - radii;
  const double least = radii + GapToKeep(gap);
  const double approach = -Dot(p, v), square = Dot(v, v);
  if (approach <= 0.0) return 1.0;
  const double room = Dot(p, p) - least * least;
  if (room <= 0.0) return 0.0;
  const double discriminant = approach * approach - square * room;
  if (discriminant <= 0.0) return 1.0;
  const double t = room / (approach + std::sqrt(discriminant));
  return t < 1.0 ? (1.0 - 1e-12) * t : 1.0;
}

/// Room for the corners of a piece that has made a part of its motion.
class MovedCorners {
 public:
  /// Moves the piece, whose corners then are here. False if they are too many.
  bool Move(double part, Moving* piece) {
    const Motion& motion = piece->motion;
    if (piece->hull.count > kMost) return false;
    const SineCosine turn = SinCos(part * motion.turn);
    const Vector center = piece->center + part * Vector{motion.x, motion.y};
    for (uint32_t i = 0; i < piece->hull.count; i++)
      corners_[i] = center + Rotate(piece->hull.corners[i] - piece->center, turn.sine, turn.cosine);
    piece->center = center;
    piece->hull.corners = corners_;
    return true;
  }

 private:
  static constexpr uint32_t kMost = 32;
  Vector corners_[kMost];
};

bool GoesStraight(const Moving& piece) {
  return piece.hull.count == 1 && (piece.core == 0.0 || piece.motion.turn == 0.0);
}

}  // namespace

double GapAcross(const Hull& a, const Hull& b, Vector normal) {
  const Separation found =
      WithCounts(a, b, [&]<uint32_t m, uint32_t n>() { return CoresAcross<m, n>(a, b, normal); });
  return found.gap - a.radius - b.radius;
}

Separation Separate(const Hull& a, const Hull& b, Vector guess) {
  if (a.count == 1 && b.count == 1) {
    const Vector difference = b.corners[0] - a.corners[0];
    const double distance = Length(difference);
    const Vector normal = distance > 1e-13 ? (1.0 / distance) * difference : guess;
    return {normal, distance - a.radius - b.radius, 0, 0};
  }
  Separation found =
      WithCounts(a, b, [&]<uint32_t m, uint32_t n>() { return SeparateCores<m, n>(a, b, guess); });
  found.gap -= a.radius + b.radius;
  return found;
}

Manifold FindManifold(const Hull& a, const Hull& b, const Separation& separation) {
  Manifold manifold;
  const Vector n = manifold.normal = separation.normal, t = Left(n);
  Vector p, q, u, w;
  EdgeAt(a, separation.a, n, &p, &q);
  EdgeAt(b, separation.b, n, &u, &w);
  const Vector corner_a = p + a.radius * n, corner_b = u - b.radius * n;
  // If edges lie side by side, the contacts are at the ends of their common part.
  const double low = Most(Least(Dot(p, t), Dot(q, t)), Least(Dot(u, t), Dot(w, t)));
  const double high = Least(Most(Dot(p, t), Dot(q, t)), Most(Dot(u, t), Dot(w, t)));
  if (high - low > 1e-6)
    for (const double at : {low, high}) {
      const Vector on_a = PointAt(p, q, t, at) + a.radius * n;
      const Vector on_b = PointAt(u, w, t, at) - b.radius * n;
      const double gap = Dot(n, on_b - on_a);
      if (gap >= kTouch) continue;
      manifold.on_a[manifold.count] = on_a;
      manifold.on_b[manifold.count] = on_b;
      manifold.gap[manifold.count++] = gap;
    }
  if (manifold.count > 0) return manifold;
  const double gap = separation.gap;
  manifold.on_a[0] = b.count == 1 ? corner_b - gap * n : corner_a;
  manifold.on_b[0] = a.count == 1 ? corner_a + gap * n : corner_b;
  manifold.gap[0] = gap;
  manifold.count = 1;
  return manifold;
}

double SafePart(const Moving& start_a, const Moving& start_b, Vector normal) {
  if (GoesStraight(start_a) && GoesStraight(start_b)) return SafePartOfDiscs(start_a, start_b);
  const Vector v =
      Vector{start_a.motion.x, start_a.motion.y} - Vector{start_b.motion.x, start_b.motion.y};
  const double spin =
      std::fabs(start_a.motion.turn) * start_a.core + std::fabs(start_b.motion.turn) * start_b.core;
  // The strip of a moment ago is often wide enough.
  const double guessed = GapAcross(start_a.hull, start_b.hull, normal);
  if (guessed >= kHard && guessed - kHard >= Dot(normal, v) + spin) return 1.0;

  constexpr int kAdvances = 4;
  constexpr double kLeastPart = 1e-3;
  Moving a = start_a, b = start_b;
  MovedCorners moved_a, moved_b;
  double made = 0.0;
  for (int i = 0; i < kAdvances; i++) {
    const Separation strip = Separate(a.hull, b.hull, normal);
    const double rest = 1.0 - made, hard = GapToKeep(strip.gap);
    if (strip.gap - hard >= rest * (Dot(strip.normal, v) + spin)) return 1.0;
    const double part = WithCounts(a.hull, b.hull, [&]<uint32_t m, uint32_t n>() {
      return Advance<m, n>{a, b, strip, hard, rest}.Part();
    });
    if (part >= rest) return 1.0;
    if (part < kLeastPart) break;
    made += part;
    normal = strip.normal;
    if (i + 1 == kAdvances || !moved_a.Move(part, &a) || !moved_b.Move(part, &b)) break;
  }
  return made;
}

}  // namespace Stg::motion
