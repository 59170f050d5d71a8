/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * How far apart two convex pieces are, and where they touch: the first part of
 * libstage/motion/separation.cc. Compiled after row_crowd.h.
 */
#ifndef STAGE_KERNELS_ROW_SEPARATION_H
#define STAGE_KERNELS_ROW_SEPARATION_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_crowd.h"
namespace Stg {
#endif

/* The memory of the arrays of an island while it is solved. Small islands are in the private memory
 * of a work-item, where accesses of neighbouring work-items fall together. */
#ifndef RAY_IN_OPENCL
#define ROW_ROOM
#elif defined(ROW_SOLVES_LARGE)
#define ROW_ROOM __global
#else
#define ROW_ROOM __private
#endif

#define ROW_FEW_CORNERS 8u

/* See motion::Hull. */
typedef struct {
  ROW_ROOM const row_point_t* corners;
  ray_uint count;
  double radius;
} row_hull_t;

/* See motion::Separation. */
typedef struct {
  row_point_t normal;
  double gap;
  ray_uint a, b;
} row_separation_t;

/* See motion::Manifold. */
typedef struct {
  row_point_t normal;
  ray_uint count;
  row_point_t on_a[2], on_b[2];
  double gap[2];
} row_manifold_t;

/* The one or two points of the difference b - a that the search keeps. */
typedef struct {
  row_point_t p, q;
  int two;
} row_simplex_t;

/* A hull, and copies of its corners if they are few. The loops over copies have a fixed length, so
 * that compilers keep the copies in registers. The first corner fills up the rest, and changes
 * nothing. */
typedef struct {
  const row_hull_t* hull;
  int is_small;
  row_point_t copies[ROW_FEW_CORNERS];
} row_core_t;

RAY_FUNCTION void row_copy_corners(const row_hull_t* hull, row_core_t* core) {
  ray_uint i;
  core->hull = hull;
  core->is_small = hull->count <= ROW_FEW_CORNERS;
  if (core->is_small)
    for (i = 0; i < ROW_FEW_CORNERS; i++) core->copies[i] = hull->corners[i < hull->count ? i : 0];
}

/* The first corner that is farthest along d. */
RAY_FUNCTION ray_uint row_support(const row_core_t* core, row_point_t d) {
  const row_hull_t* const hull = core->hull;
  ray_uint best = 0, i;
  if (core->is_small) {
    double most = row_dot(core->copies[0], d);
    for (i = 1; i < ROW_FEW_CORNERS; i++) {
      const double along = row_dot(core->copies[i], d);
      best = along > most ? i : best;
      most = along > most ? along : most;
    }
  } else {
    double most = row_dot(hull->corners[0], d);
    for (i = 1; i < hull->count; i++) {
      const double along = row_dot(hull->corners[i], d);
      best = along > most ? i : best;
      most = along > most ? along : most;
    }
  }
  return best;
}

/* The separation of the cores, the polygons without their radii, across a given normal. */
RAY_FUNCTION row_separation_t row_cores_across(const row_core_t* a, const row_core_t* b,
                                               row_point_t normal) {
  row_separation_t found;
  found.normal = normal;
  found.a = row_support(a, normal);
  found.b = row_support(b, row_opposite(normal));
  found.gap = row_dot(normal, row_minus(b->hull->corners[found.b], a->hull->corners[found.a]));
  return found;
}

RAY_FUNCTION double row_gap_across(const row_hull_t* a, const row_hull_t* b, row_point_t normal) {
  row_core_t of_a, of_b;
  row_copy_corners(a, &of_a);
  row_copy_corners(b, &of_b);
  return row_cores_across(&of_a, &of_b, normal).gap - a->radius - b->radius;
}

/* The widest strip across the normal of an edge of one of two cores that overlap. */
RAY_FUNCTION void row_try_edge_normals(const row_core_t* a, const row_core_t* b, int of_a,
                                       row_separation_t* best) {
  const row_hull_t* const hull = of_a ? a->hull : b->hull;
  ray_uint i;
  for (i = 0; i < hull->count && hull->count > 1; i++) {
    const row_point_t edge =
        row_minus(hull->corners[i + 1 == hull->count ? 0 : i + 1], hull->corners[i]);
    const double length = row_length(edge);
    row_separation_t found;
    row_point_t outward;
    if (length == 0.0) continue;
    outward = row_times(1.0 / length, row_point(edge.y, -edge.x));
    found = row_cores_across(a, b, of_a ? outward : row_opposite(outward));
    if (found.gap > best->gap) *best = found;
  }
}

/* For cores that overlap: the normal along which they overlap least. */
RAY_LARGE_FUNCTION row_separation_t row_least_overlap(const row_hull_t* a, const row_hull_t* b,
                                                      row_separation_t best) {
  row_core_t of_a, of_b;
  row_copy_corners(a, &of_a);
  row_copy_corners(b, &of_b);
  row_try_edge_normals(&of_a, &of_b, 1, &best);
  row_try_edge_normals(&of_a, &of_b, 0, &best);
  return best;
}

RAY_FUNCTION double row_squared_distance_to_segment(row_point_t p, row_point_t q) {
  const row_point_t edge = row_minus(q, p);
  const double square = row_dot(edge, edge);
  const double t = square > 0.0 ? row_clamp(-row_dot(p, edge) / square, 0.0, 1.0) : 0.0;
  const row_point_t nearest = row_plus(p, row_times(t, edge));
  return row_dot(nearest, nearest);
}

/* Unit vector from the origin to the nearest point, and its distance. Drops a point that does not
 * matter. False if the distance is almost zero. */
RAY_FUNCTION int row_nearest(row_simplex_t* simplex, row_point_t* normal, double* distance) {
  if (simplex->two) {
    const row_point_t p = simplex->p, edge = row_minus(simplex->q, p);
    const double square = row_dot(edge, edge);
    const double t = square > 0.0 ? -row_dot(p, edge) / square : 0.0;
    if (t > 0.0 && t < 1.0) {
      *normal = row_times(1.0 / sqrt(square), row_left(edge));
      if (row_dot(*normal, p) < 0.0) *normal = row_opposite(*normal);
      *distance = row_dot(*normal, p);
      return 1;
    }
    if (t >= 1.0) simplex->p = simplex->q;
    simplex->two = 0;
  }
  *distance = row_length(simplex->p);
  if (*distance < 1e-13) return 0;
  *normal = row_times(1.0 / *distance, simplex->p);
  return 1;
}

/* Adds a point. False if the origin is within the triangle of all three. */
RAY_FUNCTION int row_add_point(row_simplex_t* simplex, row_point_t r) {
  const row_point_t p = simplex->p, q = simplex->q;
  double first, second, third;
  if (!simplex->two) {
    simplex->q = r;
    simplex->two = 1;
    return 1;
  }
  first = row_cross(row_minus(q, p), row_opposite(p));
  second = row_cross(row_minus(r, q), row_opposite(q));
  third = row_cross(row_minus(p, r), row_opposite(r));
  if (first > 0.0 && second > 0.0 && third > 0.0) return 0;
  if (first < 0.0 && second < 0.0 && third < 0.0) return 0;
  if (row_squared_distance_to_segment(p, r) <= row_squared_distance_to_segment(q, r))
    simplex->q = r;
  else
    simplex->p = r;
  return 1;
}

/* See SeparateCores(). */
RAY_LARGE_FUNCTION row_separation_t row_separate_cores(const row_hull_t* a, const row_hull_t* b,
                                                       row_point_t guess) {
  row_core_t of_a, of_b;
  row_separation_t best;
  row_simplex_t simplex;
  int turn;
  row_copy_corners(a, &of_a);
  row_copy_corners(b, &of_b);
  best = row_cores_across(&of_a, &of_b, guess);
  simplex.p = row_minus(b->corners[best.b], a->corners[best.a]);
  simplex.q = row_point(0.0, 0.0);
  simplex.two = 0;
  for (turn = 0; turn < 12; turn++) {
    row_separation_t found;
    row_point_t normal;
    double distance;
    if (!row_nearest(&simplex, &normal, &distance)) return row_least_overlap(a, b, best);
    found = row_cores_across(&of_a, &of_b, normal);
    if (found.gap > best.gap) best = found;
    if (found.gap >= distance - 1e-12) return best;
    if (!row_add_point(&simplex, row_minus(b->corners[found.b], a->corners[found.a])))
      return row_least_overlap(a, b, best);
  }
  return best.gap < 0.0 ? row_least_overlap(a, b, best) : best;
}

/* See motion::Separate(). */
RAY_FUNCTION row_separation_t row_separate(const row_hull_t* a, const row_hull_t* b,
                                           row_point_t guess) {
  row_separation_t found;
  if (a->count == 1 && b->count == 1) {
    const row_point_t difference = row_minus(b->corners[0], a->corners[0]);
    const double distance = row_length(difference);
    found.normal = distance > 1e-13 ? row_times(1.0 / distance, difference) : guess;
    found.gap = distance - a->radius - b->radius;
    found.a = found.b = 0;
    return found;
  }
  found = row_separate_cores(a, b, guess);
  found.gap -= a->radius + b->radius;
  return found;
}

/* The edge at a corner that lies most across n. */
RAY_FUNCTION void row_edge_at(const row_hull_t* hull, ray_uint i, row_point_t n, row_point_t* from,
                              row_point_t* to) {
  row_point_t next, previous, to_next, to_previous;
  *from = *to = hull->corners[i];
  if (hull->count == 1) return;
  next = hull->corners[i + 1 == hull->count ? 0 : i + 1];
  previous = hull->corners[i == 0 ? hull->count - 1 : i - 1];
  to_next = row_minus(next, *from);
  to_previous = row_minus(previous, *from);
  *to = fabs(row_dot(to_next, n)) / row_length(to_next) <=
                fabs(row_dot(to_previous, n)) / row_length(to_previous)
            ? next
            : previous;
}

/* The point of the line from p to q that is `at` along t. */
RAY_FUNCTION row_point_t row_point_at(row_point_t p, row_point_t q, row_point_t t, double at) {
  const double from = row_dot(p, t), length = row_dot(q, t) - from;
  if (!(fabs(length) > 1e-12)) return p;
  return row_plus(p, row_times((at - from) / length, row_minus(q, p)));
}

/* See motion::FindManifold(). */
RAY_FUNCTION row_manifold_t row_find_manifold(const row_hull_t* a, const row_hull_t* b,
                                              const row_separation_t* separation) {
  const row_point_t n = separation->normal, t = row_left(n);
  row_manifold_t manifold;
  row_point_t p, q, u, w, corner_a, corner_b;
  double low, high;
  int end;
  manifold.normal = n;
  manifold.count = 0;
  row_edge_at(a, separation->a, n, &p, &q);
  row_edge_at(b, separation->b, n, &u, &w);
  corner_a = row_plus(p, row_times(a->radius, n));
  corner_b = row_minus(u, row_times(b->radius, n));
  low = row_larger(row_smaller(row_dot(p, t), row_dot(q, t)),
                   row_smaller(row_dot(u, t), row_dot(w, t)));
  high = row_smaller(row_larger(row_dot(p, t), row_dot(q, t)),
                     row_larger(row_dot(u, t), row_dot(w, t)));
  for (end = 0; high - low > 1e-6 && end < 2; end++) {
    const double at = end == 0 ? low : high;
    const row_point_t on_a = row_plus(row_point_at(p, q, t, at), row_times(a->radius, n));
    const row_point_t on_b = row_minus(row_point_at(u, w, t, at), row_times(b->radius, n));
    const double gap = row_dot(n, row_minus(on_b, on_a));
    if (gap >= ROW_TOUCH) continue;
    manifold.on_a[manifold.count] = on_a;
    manifold.on_b[manifold.count] = on_b;
    manifold.gap[manifold.count++] = gap;
  }
  if (manifold.count > 0) return manifold;
  manifold.gap[0] = separation->gap;
  manifold.on_a[0] = b->count == 1 ? row_minus(corner_b, row_times(separation->gap, n)) : corner_a;
  manifold.on_b[0] = a->count == 1 ? row_plus(corner_a, row_times(separation->gap, n)) : corner_b;
  manifold.count = 1;
  return manifold;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
