/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Moves with contacts of outlines: Rows::Stepper::MoveOutlines(). Compiled after row_crowd.h and
 * row_move.h.
 *
 * In most steps nothing is near anything else: the movers go where they want. Otherwise the islands
 * of all worlds are listed, and other kernels solve them between the two parts of the moves, see
 * row_solve.h.
 */
#ifndef STAGE_KERNELS_ROW_OUTLINES_H
#define STAGE_KERNELS_ROW_OUTLINES_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_crowd.h"
#include "kernels/row_move.h"
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

/* The kind of an island, by which it is solved. */
RAY_FUNCTION ray_uint row_kind_of(const row_world_t* w, const row_island_t* island) {
  const int is_alone = island->end_near == island->first_near;
  const ray_uint solids = island->end_member - island->first_member + island->standing;
  if (solids > ROW_SMALL_SOLIDS || solids * w->scene->most_corners > ROW_SMALL_CORNERS ||
      2 * w->scene->most_moved > ROW_SMALL_MOVED || island->pairs > ROW_SMALL_PAIRS)
    return ROW_LARGE;
  return !is_alone ? ROW_SMALL : island->pairs > 2 ? ROW_SMALLER : ROW_SMALLEST;
}

/* Puts the islands of a world on the lists of their kinds. */
RAY_FUNCTION void row_let_all_wait(const row_world_t* w, ray_uint islands) {
  RAY_GLOBAL row_island_t* const all = ROW_SCRATCH(w, row_island_t, ROW_ISLANDS);
  ray_uint counts[ROW_ISLAND_KINDS], kind, i;
  for (kind = 0; kind < ROW_ISLAND_KINDS; kind++) counts[kind] = 0;
  for (i = 0; i < islands; i++) {
    const row_island_t island = all[i];
    all[i].kind = row_kind_of(w, &island);
    counts[all[i].kind]++;
  }
  for (kind = 0; kind < ROW_ISLAND_KINDS; kind++) {
    ray_uint place;
    if (counts[kind] == 0) continue;
    place = row_add_waiting(w, kind, counts[kind]);
    for (i = 0; i < islands; i++)
      if (all[i].kind == kind) row_let_wait(w, kind, place++, i);
  }
}

/* Empties the lists. */
RAY_FUNCTION void row_forget_waiting(const row_world_t* w) {
  ray_uint kind;
  for (kind = 0; kind < ROW_ISLAND_KINDS; kind++) *row_waiting_count(w, kind) = 0;
}

/* Forms the islands of a world, which then wait to be solved. */
RAY_FUNCTION void row_form_islands(const row_world_t* w) {
  ray_uint near = 0, islands, i;
  for (i = 0; i < w->scene->touchers; i++) near |= row_contacts(w)[i].near;
  if (!near) return;
  row_spread_reaches(w);
  row_unite(w);
  islands = row_list_members(w);
  if (row_place_islands(w, islands)) {
    row_list_near(w, row_near_pairs(w, 0));
    row_let_all_wait(w, islands);
  } else {
    row_let_wait(w, ROW_LARGE, row_add_waiting(w, ROW_LARGE, 1), ROW_ALL_OF | islands);
  }
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

/* The first part of the moves of a world: its islands wait to be solved. */
RAY_FUNCTION void row_begin_moves(const row_world_t* w) {
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED);
  const ray_uint touchers = w->scene->touchers;
  ray_uint i;
  for (i = ROW_ITEM; i < w->scene->movers; i += ROW_ITEMS) wanted[i].asked = wanted[i].collides = 0;
  ROW_BARRIER();
  for (i = ROW_ITEM; i < touchers; i += ROW_ITEMS) row_set_target(w, i);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < touchers; i += ROW_ITEMS) row_look_around(w, i);
  ROW_BARRIER();
  if (ROW_ITEM == 0) row_form_islands(w);
}

/* The last part of the moves, after all islands have been solved. */
RAY_FUNCTION void row_end_moves(const row_world_t* w) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  RAY_GLOBAL const row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED);
  ray_uint i;
  for (i = ROW_ITEM; i < scene->touchers; i += ROW_ITEMS) row_end_contact(w, i);
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
