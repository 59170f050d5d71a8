/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The bodies of an island move together: the second part of libstage/motion/island.cc. Compiled
 * after row_forces.h.
 */
#ifndef STAGE_KERNELS_ROW_JOINT_H
#define STAGE_KERNELS_ROW_JOINT_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_forces.h"
namespace Stg {
#endif

/* See Wrap(). */
RAY_FUNCTION double row_wrap(double angle) {
  return angle - 2.0 * ROW_PI * floor((angle + ROW_PI) / (2.0 * ROW_PI));
}

/* See IslandSolver::SetWanted(). */
RAY_FUNCTION int row_set_wanted(const row_solver_t* s) {
  int any = 0;
  ray_uint i;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    const row_planar_t rest = solid->rest;
    const row_planar_t wanted = solid->bold < 1.0 ? row_part_of(rest, solid->bold) : rest;
    solid->wanted = wanted;
    any |= !row_is_zero(wanted);
  }
  return any;
}

/* See IslandSolver::CutMotions(). */
RAY_FUNCTION void row_cut_motions(const row_solver_t* s) {
  const double least = row_smaller(ROW_CONVERGED, 1e-3 * s->typical);
  const row_planar_t none = row_planar(0, 0, 0);
  ray_uint i;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    row_planar_t motion = solid->motion;
    double way;
    if (row_distance(motion, none, solid->arm) < least) motion = none;
    solid->motion = motion;
    if (row_farthest(motion, solid->core) <= solid->left) continue;
    way = row_length(row_way(motion)) + fabs(motion.a) * solid->core;
    solid->motion = row_part_of(motion, solid->left / way);
  }
}

/* See IslandSolver::MovingOf(). */
RAY_FUNCTION row_moving_t row_moving_of(const row_solver_t* s, ray_uint index, row_hull_t hull,
                                        double core) {
  row_moving_t moving;
  moving.hull = hull;
  moving.core = core;
  if (index == ROW_NONE) { /* the edge of a wall */
    moving.center = hull.corners[0];
    moving.motion = row_planar(0, 0, 0);
    return moving;
  }
  moving.center = s->solids[index].position;
  moving.motion = row_part_of(s->solids[index].motion, s->solids[index].part);
  return moving;
}

/* Lowers the part of the motion of a member that is made. */
RAY_FUNCTION void row_lower_part(const row_solver_t* s, ray_uint index, double part) {
  ROW_ROOM row_solid_t* const solid = s->solids + index;
  if (index >= s->members || solid->part == 0.0) return;
  solid->next_part = row_smaller(solid->next_part, solid->part * part);
  solid->flags |= ROW_NEXT_DIRTY;
}

/* True if a body of a pair is a member that may come too near to the other. */
RAY_FUNCTION int row_has_flag(const row_solver_t* s, ray_uint index, ray_uint flag) {
  return index < s->members && (s->solids[index].flags & flag) != 0;
}
RAY_FUNCTION int row_makes_part(const row_solver_t* s, ray_uint index) {
  return index < s->members && s->solids[index].part != 0.0;
}

/* See IslandSolver::LowerParts(). */
RAY_FUNCTION int row_lower_parts(const row_solver_t* s, int to_zero) {
  const ray_uint most = s->w->scene->most_moved;
  ROW_ROOM row_point_t* const moved = s->moved;
  int any = 0;
  ray_uint i;
  for (i = 0; i < s->pair_count; i++) {
    ROW_ROOM const row_pair_t* const pair = s->pairs + i;
    double part;
    if (!row_has_flag(s, pair->a, ROW_DIRTY) && !row_has_flag(s, pair->b, ROW_DIRTY)) continue;
    if (!row_makes_part(s, pair->a) && !row_makes_part(s, pair->b)) continue;
    part = row_safe_part(row_moving_of(s, pair->a, row_hull_a(s, pair), pair->core_a),
                         row_moving_of(s, pair->b, row_hull_b(s, pair), pair->core_b), pair->normal,
                         moved, most);
    if (part >= 1.0) continue;
    if (to_zero || part < 0.01) part = 0.0;
    any = 1;
    row_lower_part(s, pair->a, part);
    row_lower_part(s, pair->b, part);
  }
  return any;
}

/* See IslandSolver::Move(). */
RAY_FUNCTION void row_move_solid(const row_solver_t* s, ray_uint index) {
  ROW_ROOM row_solid_t* const solid = s->solids + index;
  const row_contact_t contact = row_contacts(s->w)[solid->toucher];
  const row_planar_t motion = solid->motion, made = row_part_of(motion, solid->part);
  solid->turned += made.a;
  if ((solid->flags & ROW_MOVED) == 0 && solid->part == 1.0 && row_are_equal(motion, solid->rest)) {
    solid->position = row_minus(row_point(contact.target_x, contact.target_y), s->origin);
    solid->heading = contact.target_heading;
    solid->flags |= ROW_ARRIVED;
  } else {
    solid->position = row_plus(solid->position, row_way(made));
    solid->heading = row_wrap(contact.heading + solid->turned);
    solid->flags &= ~ROW_ARRIVED;
  }
  solid->flags |= ROW_MOVED;
  row_place_solid(s, index);
}

/* See IslandSolver::MoveTogether(). False if the island is to be easy and its bodies do not go all
 * the way. */
RAY_FUNCTION int row_move_together(const row_solver_t* s, int easy) {
  int round;
  ray_uint i;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    solid->part = solid->next_part = row_is_zero(solid->motion) ? 0.0 : 1.0;
    solid->flags = (solid->flags | ROW_DIRTY) & ~ROW_NEXT_DIRTY;
  }
  for (round = 0; row_lower_parts(s, round >= ROW_JOINT_ROUNDS); round++) {
    if (easy) return 0;
    for (i = 0; i < s->members; i++) {
      ROW_ROOM row_solid_t* const solid = s->solids + i;
      const ray_uint dirty = (solid->flags & ROW_NEXT_DIRTY) != 0 ? ROW_DIRTY : 0;
      solid->part = solid->next_part;
      solid->flags = (solid->flags & ~(ROW_DIRTY | ROW_NEXT_DIRTY)) | dirty;
    }
  }
  for (i = 0; i < s->members; i++)
    if (s->solids[i].part != 0.0) row_move_solid(s, i);
  return 1;
}

/* See IslandSolver::NoteRest(). */
RAY_FUNCTION int row_note_rest(const row_solver_t* s) {
  int more = 0;
  ray_uint i;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    const row_planar_t motion = solid->motion, rest = solid->rest;
    const double part = row_is_zero(motion) ? 1.0 : solid->part;
    const row_planar_t done = row_part_of(solid->wanted, part);
    if (part < 1.0 || solid->bold < 1.0) more = 1;
    solid->left =
        row_larger(0.0, solid->left - row_farthest(row_part_of(motion, part), solid->core));
    solid->rest = row_planar(rest.x - done.x, rest.y - done.y, rest.a - done.a);
    solid->bold = part < 0.25 ? 0.25 * solid->bold : row_smaller(1.0, 2.0 * solid->bold);
  }
  return more;
}

RAY_FUNCTION double row_square_of_motion(double x, double y, double turn) {
  return x * x + y * y + turn * turn;
}

/* See IslandSolver::Store(). */
RAY_FUNCTION void row_store_island(const row_solver_t* s) {
  ray_uint i;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM const row_solid_t* const solid = s->solids + i;
    RAY_GLOBAL row_contact_t* const contact = row_contacts(s->w) + solid->toucher;
    const row_point_t target = row_point(contact->target_x, contact->target_y);
    const row_point_t position =
        (solid->flags & ROW_ARRIVED) != 0 ? target : row_plus(s->origin, solid->position);
    const double missed = row_square_of_motion(target.x - position.x, target.y - position.y,
                                               solid->arm * (contact->turn - solid->turned));
    const double whole = row_square_of_motion(target.x - contact->x, target.y - contact->y,
                                              solid->arm * contact->turn);
    const double share = whole > 0.0 ? 1.0 - sqrt(missed / whole) : 1.0;
    contact->made = row_clamp(share, 0.0, 1.0);
    contact->x = position.x;
    contact->y = position.y;
    contact->heading = solid->heading;
  }
}

/* See IslandSolver::Solve(). Easy islands need one pass with few sweeps. False, and nothing has
 * changed, if the island is to be easy and is not. */
RAY_FUNCTION int row_solve_island(row_solver_t* s, int easy) {
  int pass;
  row_load_island(s);
  for (pass = 0; pass < ROW_PASSES && row_set_wanted(s); pass++) {
    row_set_masses(s);
    row_find_touches(s);
    if (!row_solve_forces(s, easy)) return 0;
    row_cut_motions(s);
    if (!row_move_together(s, easy)) return 0;
    if (!row_note_rest(s)) break;
    if (easy) return 0;
  }
  row_store_island(s);
  return 1;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
