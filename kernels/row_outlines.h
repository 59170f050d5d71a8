/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Moves with contacts of outlines: Rows::Stepper::MoveOutlines(). Compiled after row_joint.h.
 *
 * In most steps nothing is near anything else: the movers go where they want. Otherwise each
 * work-item solves some of the islands. If the pairs of a world do not fit into its memory, one
 * work-item solves all of them in memory that the worlds share, one world after the other.
 */
#ifndef STAGE_KERNELS_ROW_OUTLINES_H
#define STAGE_KERNELS_ROW_OUTLINES_H

#ifdef RAY_IN_OPENCL
#define ROW_TRY_LOCK(word) (atomic_cmpxchg(word, 0u, 1u) == 0u)
#define ROW_UNLOCK(word)           \
  mem_fence(CLK_GLOBAL_MEM_FENCE); \
  atomic_xchg(word, 0u)
#else
#include "kernels/row_joint.h"
#include "kernels/row_move.h"
/* Worlds are stepped one after the other. */
#define ROW_TRY_LOCK(word) ((void)(word), 1)
#define ROW_UNLOCK(word) ((void)(word))
namespace Stg {
#endif

#define ROW_HINDERED_SHARE 0.95 /* see motion::kHindered */

/* See WantedReach(). */
RAY_FUNCTION double row_wanted_reach(const row_contact_t* c, double core) {
  const double dx = c->target_x - c->x, dy = c->target_y - c->y;
  if (dx == 0.0 && dy == 0.0 && c->turn == 0.0) return 0.0;
  return sqrt(dx * dx + dy * dy) + 2.0 * row_smaller(fabs(c->turn), 2.0) * core + ROW_SKIN;
}

/* See Rows::Stepper::SetTarget() and Nearby::FindReach(). */
RAY_FUNCTION void row_set_target(const row_world_t* w, ray_uint i) {
  RAY_GLOBAL const row_toucher_t* const toucher = row_toucher(w, i);
  RAY_GLOBAL const row_wanted_t* const wanted =
      ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + toucher->mover;
  const row_planar_t pose = ROW_COLUMN(w, row_planar_t, ROW_POSE)[toucher->mover];
  row_contact_t c;
  c.x = c.target_x = pose.x;
  c.y = c.target_y = pose.y;
  c.heading = c.target_heading = pose.a;
  c.turn = 0;
  c.made = 1;
  ROW_COLUMN(w, row_byte, ROW_HINDERED)[toucher->mover] = 0;
  row_find_wanted(w, toucher->mover);
  c.asked = wanted->asked;
  if (c.asked && (toucher->flags & ROW_IS_IN_FLOOR) == 0) {
    c.target_x = wanted->place.x;
    c.target_y = wanted->place.y;
    c.target_heading = wanted->place.a;
    c.turn = ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[toucher->mover].a * w->scene->seconds;
  }
  c.reach = row_larger(0.0, row_wanted_reach(&c, toucher->core));
  c.push = 2.0 * c.reach;
  c.root = i;
  c.island = c.walls = c.first_wall = c.near = c.grown = 0;
  c.place = ROW_NONE;
  row_contacts(w)[i] = c;
}

/* Solves all islands in the memory that the worlds share. What needs the lock is inside of the
 * loop, because work-items of several worlds may run in lock-step. */
RAY_FUNCTION void row_solve_in_shared_room(const row_world_t* w, ray_uint islands) {
  volatile RAY_GLOBAL ray_uint* const lock =
      (volatile RAY_GLOBAL ray_uint*)(w->state + w->scene->lock);
  row_solver_t solver;
  ray_uint i, waits = 1;
  row_enter_room(w, 1, &solver);
  while (waits)
    if (ROW_TRY_LOCK(lock)) {
      row_list_near(w, solver.near);
      for (i = 0; i < islands; i++) row_solve_island(&solver, i);
      ROW_UNLOCK(lock);
      waits = 0;
    }
}

/* Forms the islands of a world. Those that are still to be solved are in its crowd. */
RAY_LARGE_FUNCTION void row_form_islands(const row_world_t* w) {
  RAY_GLOBAL row_crowd_t* const crowd = ROW_SCRATCH(w, row_crowd_t, ROW_CROWD);
  row_solver_t solver;
  ray_uint near = 0, islands, i;
  crowd->islands = 0;
  for (i = 0; i < w->scene->touchers; i++) near |= row_contacts(w)[i].near;
  if (!near) return;
  row_spread_reaches(w);
  row_unite(w);
  islands = row_list_members(w);
  if (!row_place_islands(w, islands)) {
    row_solve_in_shared_room(w, islands);
    return;
  }
  row_enter_room(w, 0, &solver);
  row_list_near(w, solver.near);
  crowd->islands = islands;
}

RAY_FUNCTION int row_has_bits(double a, double b) { return ROW_BITS(a) == ROW_BITS(b); }

/* See motion::VelocityBetween(). */
RAY_FUNCTION row_planar_t row_velocity_between(row_planar_t before, row_planar_t now,
                                               double seconds) {
  row_point_t moved;
  if (row_are_equal(now, before)) return row_planar(0, 0, 0);
  moved = row_turned(row_point(now.x - before.x, now.y - before.y), row_turn(-before.a));
  return row_planar(moved.x / seconds, moved.y / seconds,
                    row_normalize(now.a - before.a) / seconds);
}

/* See Rows::Stepper::NoteMotion(). */
RAY_FUNCTION void row_note_move(const row_world_t* w, ray_uint mover, row_planar_t made) {
  const row_planar_t velocity = ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[mover];
  const int stalled = ROW_COLUMN(w, row_byte, ROW_STALLED)[mover] != 0;
  const int hindered = !row_are_equal(made, velocity) && !(stalled && row_is_zero(made));
  ROW_COLUMN(w, row_byte, ROW_HINDERED)[mover] = (row_byte)hindered;
  if (hindered) ROW_COLUMN(w, row_planar_t, ROW_MADE)[mover] = made;
  row_note_motion(w, mover, hindered ? made : stalled ? row_planar(0, 0, 0) : velocity);
}

/* Ends the move of a robot: whether it stalls, and its odometry. See Rows::Stepper::EndMove(). */
RAY_FUNCTION void row_end_robot(const row_world_t* w, ray_uint i, row_planar_t before,
                                row_planar_t now) {
  RAY_GLOBAL const row_toucher_t* const toucher = row_toucher(w, i);
  const ray_uint mover = toucher->mover;
  const row_placed_t wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED)[mover].place;
  const row_planar_t velocity = ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[mover];
  const int asked = row_contacts(w)[i].asked != 0;
  row_planar_t made;
  if (asked) ROW_COLUMN(w, row_byte, ROW_STALLED)
  [mover] = row_contacts(w)[i].made < ROW_HINDERED_SHARE || (toucher->flags & ROW_IS_IN_FLOOR) != 0;
  made = asked && now.x == wanted.x && now.y == wanted.y && now.a == wanted.a
             ? velocity
             : row_velocity_between(before, now, w->scene->seconds);
  if (row_is_zero(made) && row_is_zero(velocity))
    ROW_COLUMN(w, row_byte, ROW_HINDERED)[mover] = 0;
  else
    row_note_move(w, mover, made);
}

/* Ends the move of a toucher. Its new place is to be drawn if it has moved. */
RAY_FUNCTION void row_end_contact(const row_world_t* w, ray_uint i) {
  RAY_GLOBAL const row_toucher_t* const toucher = row_toucher(w, i);
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + toucher->mover;
  const row_contact_t c = row_contacts(w)[i];
  const row_planar_t before = ROW_COLUMN(w, row_planar_t, ROW_POSE)[toucher->mover];
  const row_turn_t turn = ROW_COLUMN(w, row_turn_t, ROW_TURN)[toucher->mover];
  const int is_free = c.place == ROW_NONE;
  const row_planar_t now = row_planar(is_free ? c.target_x : c.x, is_free ? c.target_y : c.y,
                                      is_free ? c.target_heading : c.heading);
  if ((toucher->flags & ROW_IS_PUSHED) != 0)
    ROW_COLUMN(w, row_planar_t, ROW_BEFORE)[toucher->mover] = before;
  if ((toucher->flags & ROW_IS_ROBOT) != 0) row_end_robot(w, i, before, now);
  wanted->asked = !row_are_equal(now, before);
  if (!wanted->asked) return;
  if (!c.asked || !row_has_bits(wanted->place.a, now.a))
    wanted->place.turn = row_has_bits(before.a, now.a) ? turn : row_turn(now.a);
  wanted->place.x = now.x;
  wanted->place.y = now.y;
  wanted->place.a = now.a;
}

/* Moves all movers of the world. */
RAY_FUNCTION void row_move_outlines(const row_world_t* w) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED);
  const ray_uint touchers = scene->touchers;
  row_solver_t solver;
  ray_uint i;
  for (i = ROW_ITEM; i < scene->movers; i += ROW_ITEMS) wanted[i].asked = wanted[i].collides = 0;
  ROW_BARRIER();
  for (i = ROW_ITEM; i < touchers; i += ROW_ITEMS) row_set_target(w, i);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < touchers; i += ROW_ITEMS) row_look_around(w, i);
  ROW_BARRIER();
  if (ROW_ITEM == 0) row_form_islands(w);
  ROW_BARRIER();
  row_enter_room(w, 0, &solver);
  for (i = ROW_ITEM; i < ROW_SCRATCH(w, row_crowd_t, ROW_CROWD)->islands; i += ROW_ITEMS)
    row_solve_island(&solver, i);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < touchers; i += ROW_ITEMS) row_end_contact(w, i);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < scene->bodies; i += ROW_ITEMS) row_draw(w, i);
  ROW_BARRIER();
  if (ROW_ITEM == 0) row_number_drawings(w);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < scene->bodies; i += ROW_ITEMS) row_commit(w, i);
  for (i = ROW_ITEM; i < scene->movers; i += ROW_ITEMS)
    if (wanted[i].asked) row_take_place(w, i);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
