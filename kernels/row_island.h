/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * An island while it is solved: its bodies, and the pairs of pieces that may touch. The first part
 * of libstage/motion/island.cc, see IslandSolver. Compiled after row_safe_part.h.
 */
#ifndef STAGE_KERNELS_ROW_ISLAND_H
#define STAGE_KERNELS_ROW_ISLAND_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_safe_part.h"
namespace Stg {
#endif

/* See IslandSolver::Kind. */
enum { ROW_FIXED, ROW_SPLIT, ROW_FORCE };

/* Bits of row_solid_t::flags. */
#define ROW_PUSHES 1u
#define ROW_DIRTY 2u
#define ROW_NEXT_DIRTY 4u
#define ROW_MOVED 8u
#define ROW_ARRIVED 16u

/* A body of an island, see IslandSolver::Body. Those of all members come first, in the order of
 * ROW_MEMBERS, then that of each pair of which one cannot move. */
typedef struct RAY_ALIGNED(16) {
  row_planar_t motion, force;
  double mass, inertia;
  row_planar_t before, wanted, rest, floor;
  row_point_t position;
  double heading, turned;
  double grip, arm, core, left, bold, part, next_part;
  ray_uint toucher, first_corner;
  ray_uint pushable, flags;
  double unused;
} row_solid_t;

/* A piece of a body near a piece of another, or near the edge of a wall, see IslandSolver::Pair. */
typedef struct RAY_ALIGNED(16) {
  ray_uint a, b; /* solids; ROW_NONE: a wall */
  ray_uint edge, kind;
  ray_uint corner_a, count_a, corner_b, count_b; /* indices in the corners of solids */
  double radius_a, core_a, radius_b, core_b;
  row_point_t normal;
  double friction, unused;
  row_point_t ends[2]; /* of the wall's edge */
} row_pair_t;

/* See IslandSolver::Touch. Responses: of the first point, of both, of the second. */
typedef struct RAY_ALIGNED(16) {
  ray_uint a, b, kind, count;
  row_point_t normal;
  double friction;
  double room[2];
  double arm_a[2], arm_b[2];
  double slide_arm_a, slide_arm_b;
  double of_a[3], of_b[3];
  double slide_of_a, slide_of_b;
  double push_a[2], push_b[2];
  double rub_a, rub_b;
  double unused;
} row_touch_t;

/* An island that is being solved, and its arrays. */
typedef struct {
  const row_world_t* w;
  row_island_t island;
  row_point_t origin; /* of coordinates */
  double typical;
  ray_uint members, pair_count, touch_count;
  /* Arrays of the world: */
  RAY_GLOBAL const row_near_t* near;
  RAY_GLOBAL ray_uint* walls;
  /* Arrays of the island: */
  ROW_ROOM row_solid_t* solids;
  ROW_ROOM row_point_t *corners, *moved;
  ROW_ROOM row_pair_t* pairs;
  ROW_ROOM row_touch_t* touches;
} row_solver_t;

/* ---- hulls ---------------------------------------------------------------------------------- */

RAY_FUNCTION row_hull_t row_hull_a(const row_solver_t* s, ROW_ROOM const row_pair_t* pair) {
  row_hull_t hull;
  hull.corners = s->corners + pair->corner_a;
  hull.count = pair->count_a;
  hull.radius = pair->radius_a;
  return hull;
}

RAY_FUNCTION row_hull_t row_hull_b(const row_solver_t* s, ROW_ROOM const row_pair_t* pair) {
  row_hull_t hull;
  hull.corners = pair->b == ROW_NONE ? pair->ends : s->corners + pair->corner_b;
  hull.count = pair->count_b;
  hull.radius = pair->radius_b;
  return hull;
}

/* See Shapes::PlaceCorners(). */
RAY_LARGE_FUNCTION void row_place_solid(const row_solver_t* s, ray_uint index) {
  ROW_ROOM const row_solid_t* const solid = s->solids + index;
  RAY_GLOBAL const row_toucher_t* const toucher = row_toucher(s->w, solid->toucher);
  RAY_GLOBAL const row_point_t* const own =
      ROW_PART(s->w, row_point_t, ROW_TOUCH_CORNERS) + toucher->first_corner;
  ROW_ROOM row_point_t* const to = s->corners + solid->first_corner;
  const row_point_t position = solid->position;
  const row_turn_t turn = row_turn(solid->heading);
  ray_uint i;
  for (i = 0; i < toucher->corners; i++) to[i] = row_plus(position, row_turned(own[i], turn));
}

/* ---- loading -------------------------------------------------------------------------------- */

/* See OriginNear(). */
RAY_FUNCTION double row_origin_near(double position) {
  return fabs(position) < 65536.0 ? 0.0 : 1024.0 * floor(position / 1024.0);
}

/* The grip of a toucher, on which the floor's force depends, and its friction in this world. See
 * Rows::Stepper::SetContactProperties(). */
RAY_FUNCTION double row_grip_of(const row_world_t* w, RAY_GLOBAL const row_toucher_t* toucher) {
  return w->scene->varies_movers ? row_properties(w, toucher->mover)->grip : toucher->grip;
}
RAY_FUNCTION double row_friction_of(const row_world_t* w, RAY_GLOBAL const row_toucher_t* toucher) {
  return w->scene->varies_movers ? row_properties(w, toucher->mover)->friction : toucher->friction;
}

RAY_LARGE_FUNCTION void row_load_solid(const row_solver_t* s, ray_uint index, ray_uint number,
                                       double reach) {
  RAY_GLOBAL const row_toucher_t* const toucher = row_toucher(s->w, number);
  const row_contact_t contact = row_contacts(s->w)[number];
  row_solid_t solid;
  solid.motion = solid.force = row_planar(0, 0, 0);
  solid.before = solid.wanted = solid.floor = solid.motion;
  solid.mass = solid.inertia = 0;
  solid.position = row_minus(row_point(contact.x, contact.y), s->origin);
  solid.heading = contact.heading;
  solid.turned = 0;
  solid.rest = row_planar(contact.target_x - contact.x, contact.target_y - contact.y, contact.turn);
  solid.grip = row_grip_of(s->w, toucher);
  solid.arm = toucher->arm;
  solid.core = toucher->core;
  solid.left = reach;
  solid.bold = 1.0;
  solid.part = solid.next_part = 0;
  solid.toucher = number;
  solid.first_corner = index * s->w->scene->most_corners;
  solid.pushable = toucher->flags & ROW_IS_PUSHABLE;
  solid.flags = 0;
  solid.unused = 0;
  s->solids[index] = solid;
  row_place_solid(s, index);
}

/* See motion::Meet(). */
RAY_FUNCTION int row_heights_meet(double bottom_a, double top_a, double elevation_a,
                                  double bottom_b, double top_b, double elevation_b) {
  return bottom_a + elevation_a <= top_b + elevation_b &&
         bottom_b + elevation_b <= top_a + elevation_a;
}

/* Keeps a pair, which is the first free one, if its pieces can touch within the step. */
RAY_LARGE_FUNCTION void row_keep_if_near(row_solver_t* s) {
  ROW_ROOM row_pair_t* const pair = s->pairs + s->pair_count;
  const double left = pair->b == ROW_NONE ? 0.0 : s->solids[pair->b].left;
  const double reach = s->solids[pair->a].left + left + ROW_TOUCH;
  const row_hull_t a = row_hull_a(s, pair), b = row_hull_b(s, pair);
  const row_separation_t found = row_separate(&a, &b, row_point(1.0, 0.0));
  if (found.gap >= reach) return;
  pair->normal = found.normal;
  s->pair_count++;
}

RAY_FUNCTION void row_set_piece_a(row_pair_t* pair, const row_piece_t* piece, ray_uint corner) {
  pair->corner_a = corner;
  pair->count_a = piece->corners;
  pair->radius_a = piece->radius;
  pair->core_a = piece->core;
}

/* See IslandSolver::AddPairs(). */
RAY_FUNCTION void row_add_pairs(row_solver_t* s, ray_uint a, ray_uint b) {
  RAY_GLOBAL const row_piece_t* const pieces = ROW_PART(s->w, row_piece_t, ROW_PIECES);
  RAY_GLOBAL const row_toucher_t* const of_a = row_toucher(s->w, s->solids[a].toucher);
  RAY_GLOBAL const row_toucher_t* const of_b = row_toucher(s->w, s->solids[b].toucher);
  ray_uint i, k, corner_a = s->solids[a].first_corner;
  row_pair_t pair;
  pair.a = a;
  pair.b = b;
  pair.edge = ROW_NONE;
  pair.friction = 0.5 * (row_friction_of(s->w, of_a) + row_friction_of(s->w, of_b));
  pair.unused = 0;
  pair.kind = b >= s->members                                        ? ROW_FIXED
              : ((of_a->flags | of_b->flags) & ROW_IS_PUSHABLE) != 0 ? ROW_FORCE
                                                                     : ROW_SPLIT;
  pair.normal = pair.ends[0] = pair.ends[1] = row_point(0, 0);
  for (i = 0; i < of_a->pieces; i++) {
    const row_piece_t piece_a = pieces[of_a->first_piece + i];
    row_set_piece_a(&pair, &piece_a, corner_a);
    corner_a += piece_a.corners;
    pair.corner_b = s->solids[b].first_corner;
    for (k = 0; k < of_b->pieces; k++) {
      const row_piece_t piece_b = pieces[of_b->first_piece + k];
      pair.count_b = piece_b.corners;
      pair.radius_b = piece_b.radius;
      pair.core_b = piece_b.core;
      s->pairs[s->pair_count] = pair;
      if (row_heights_meet(piece_a.bottom, piece_a.top, of_a->elevation, piece_b.bottom,
                           piece_b.top, of_b->elevation))
        row_keep_if_near(s);
      pair.corner_b += piece_b.corners;
    }
  }
}

/* See IslandSolver::AddWallPairs(). */
RAY_FUNCTION void row_add_wall_pairs(row_solver_t* s, ray_uint a, ray_uint edge) {
  RAY_GLOBAL const row_toucher_t* const toucher = row_toucher(s->w, s->solids[a].toucher);
  const row_edge_t wall = ROW_PART(s->w, row_edge_t, ROW_EDGES)[edge];
  ray_uint i, corner = s->solids[a].first_corner;
  row_pair_t pair;
  pair.a = a;
  pair.b = ROW_NONE;
  pair.edge = edge;
  pair.friction = 0.5 * (row_friction_of(s->w, toucher) + wall.friction);
  pair.unused = 0;
  pair.kind = ROW_FIXED;
  pair.normal = row_point(0, 0);
  pair.corner_b = 0;
  pair.count_b = 2;
  pair.radius_b = 0;
  pair.core_b = row_length(row_minus(wall.ends[1], wall.ends[0]));
  pair.ends[0] = row_minus(wall.ends[0], s->origin);
  pair.ends[1] = row_minus(wall.ends[1], s->origin);
  for (i = 0; i < toucher->pieces; i++) {
    const row_piece_t piece = ROW_PART(s->w, row_piece_t, ROW_PIECES)[toucher->first_piece + i];
    row_set_piece_a(&pair, &piece, corner);
    corner += piece.corners;
    s->pairs[s->pair_count] = pair;
    if (row_heights_meet(piece.bottom, piece.top, toucher->elevation, wall.bottom, wall.top, 0.0))
      row_keep_if_near(s);
  }
}

/* See IslandSolver::Load(). */
RAY_FUNCTION void row_load_island(row_solver_t* s) {
  RAY_GLOBAL const row_contact_t* const contacts = row_contacts(s->w);
  RAY_GLOBAL const ray_uint* const members =
      ROW_SCRATCH(s->w, ray_uint, ROW_MEMBERS) + s->island.first_member;
  const row_contact_t first = contacts[members[0]];
  ray_uint k, i, solids;
  s->members = solids = s->island.end_member - s->island.first_member;
  s->pair_count = s->touch_count = 0;
  s->origin = row_point(row_origin_near(first.x), row_origin_near(first.y));
  for (k = 0; k < s->members; k++) row_load_solid(s, k, members[k], contacts[members[k]].reach);
  for (k = s->island.first_near; k < s->island.end_near; k++) {
    const row_near_t near = s->near[k];
    const int swaps = contacts[near.a].place == ROW_NONE;
    const ray_uint a = swaps ? near.b : near.a, b = swaps ? near.a : near.b;
    const int stands = contacts[b].place == ROW_NONE;
    const ray_uint solid_b = stands ? solids++ : contacts[b].place;
    if (stands) row_load_solid(s, solid_b, b, 0.0);
    row_add_pairs(s, contacts[a].place, solid_b);
  }
  for (k = 0; k < s->members; k++) {
    RAY_GLOBAL ray_uint* const walls = s->walls + contacts[members[k]].first_wall;
    const ray_uint count = row_find_walls(s->w, members[k], 1, walls);
    for (i = 0; i < count; i++) row_add_wall_pairs(s, k, walls[i]);
  }
}

/* ---- contacts ------------------------------------------------------------------------------- */

/* See IslandSolver::BeyondEnd(). */
RAY_FUNCTION int row_is_beyond_end(const row_world_t* w, ray_uint edge,
                                   const row_separation_t* separation) {
  const row_edge_t wall = ROW_PART(w, row_edge_t, ROW_EDGES)[edge];
  const row_point_t toward_body = row_opposite(separation->normal);
  const row_point_t along = row_minus(wall.ends[1], wall.ends[0]);
  const double sideways = row_dot(toward_body, along);
  if (sideways * sideways < 1e-12 * row_dot(along, along)) return 0;
  return row_dot(toward_body, wall.beyond[separation->b]) > 1e-9;
}

RAY_FUNCTION void row_find_response(ROW_ROOM const row_solid_t* solid, ROW_ROOM const double* arm,
                                    ROW_ROOM double* response) {
  response[0] = solid->mass + solid->inertia * arm[0] * arm[0];
  response[1] = solid->mass + solid->inertia * arm[0] * arm[1];
  response[2] = solid->mass + solid->inertia * arm[1] * arm[1];
}

/* Sets where the forces of a touch act, and the room. */
RAY_FUNCTION void row_set_arms(const row_solver_t* s, ROW_ROOM row_touch_t* touch,
                               const row_manifold_t* manifold) {
  const int wall = touch->b == ROW_NONE;
  const row_point_t tangent = row_left(manifold->normal);
  const row_point_t center_a = s->solids[touch->a].position;
  const row_point_t center_b = wall ? row_point(0, 0) : s->solids[touch->b].position;
  const double share = 1.0 / manifold->count;
  row_point_t middle_a = row_point(0, 0), middle_b = row_point(0, 0);
  ray_uint k;
  for (k = 0; k < 2; k++) touch->room[k] = touch->arm_a[k] = touch->arm_b[k] = 0;
  for (k = 0; k < manifold->count; k++) {
    const row_point_t on_a = row_minus(manifold->on_a[k], center_a);
    const row_point_t on_b = row_minus(manifold->on_b[k], center_b);
    touch->room[k] = row_larger(manifold->gap[k], 0.0) - ROW_SKIN;
    touch->arm_a[k] = row_cross(on_a, manifold->normal);
    middle_a = row_plus(middle_a, row_times(share, on_a));
    if (wall) continue;
    touch->arm_b[k] = row_cross(on_b, manifold->normal);
    middle_b = row_plus(middle_b, row_times(share, on_b));
  }
  touch->slide_arm_a = row_cross(middle_a, tangent);
  touch->slide_arm_b = row_cross(middle_b, tangent);
}

/* See IslandSolver::AddTouch(). */
RAY_FUNCTION void row_add_touch(row_solver_t* s, ROW_ROOM const row_pair_t* pair,
                                const row_separation_t* separation) {
  ROW_ROOM row_touch_t* const touch = s->touches + s->touch_count++;
  const row_hull_t hull_a = row_hull_a(s, pair), hull_b = row_hull_b(s, pair);
  const row_manifold_t manifold = row_find_manifold(&hull_a, &hull_b, separation);
  ROW_ROOM row_solid_t* const a = s->solids + pair->a;
  int k;
  touch->a = pair->a;
  touch->b = pair->b;
  touch->kind = pair->kind;
  touch->count = manifold.count;
  touch->normal = manifold.normal;
  touch->friction = pair->friction;
  touch->rub_a = touch->rub_b = touch->slide_of_b = 0;
  for (k = 0; k < 2; k++) touch->push_a[k] = touch->push_b[k] = 0;
  for (k = 0; k < 3; k++) touch->of_b[k] = 0;
  row_set_arms(s, touch, &manifold);
  row_find_response(a, touch->arm_a, touch->of_a);
  touch->slide_of_a = a->mass + a->inertia * touch->slide_arm_a * touch->slide_arm_a;
  if (pair->kind == ROW_FIXED) return;
  {
    ROW_ROOM row_solid_t* const b = s->solids + pair->b;
    row_find_response(b, touch->arm_b, touch->of_b);
    touch->slide_of_b = b->mass + b->inertia * touch->slide_arm_b * touch->slide_arm_b;
    if (pair->kind == ROW_SPLIT) return;
    a->flags |= ROW_PUSHES;
    b->flags |= ROW_PUSHES;
  }
}

/* See IslandSolver::FindTouches(). */
RAY_FUNCTION void row_find_touches(row_solver_t* s) {
  ray_uint i;
  s->touch_count = 0;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    solid->flags = (solid->flags & ~ROW_PUSHES) | (solid->pushable ? ROW_PUSHES : 0);
  }
  for (i = 0; i < s->pair_count; i++) {
    ROW_ROOM row_pair_t* const pair = s->pairs + i;
    const row_hull_t a = row_hull_a(s, pair), b = row_hull_b(s, pair);
    row_separation_t found;
    if (row_gap_across(&a, &b, pair->normal) > ROW_TOUCH) continue;
    found = row_separate(&a, &b, pair->normal);
    pair->normal = found.normal;
    if (found.gap > ROW_TOUCH) continue;
    if (pair->b == ROW_NONE && row_is_beyond_end(s->w, pair->edge, &found)) continue;
    row_add_touch(s, pair, &found);
  }
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
