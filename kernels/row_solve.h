/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Solves the islands that wait, of all worlds. Compiled after row_joint.h: once for small islands
 * and once, with ROW_SOLVES_LARGE, for large ones.
 *
 * If the pairs of a world do not fit into its room, one work-item solves all of its islands in
 * memory that the worlds share, one world after the other.
 */
#ifndef STAGE_KERNELS_ROW_SOLVE_H
#define STAGE_KERNELS_ROW_SOLVE_H

#ifdef RAY_IN_OPENCL
#define ROW_TRY_LOCK(word) (atomic_cmpxchg(word, 0u, 1u) == 0u)
#define ROW_UNLOCK(word)           \
  mem_fence(CLK_GLOBAL_MEM_FENCE); \
  atomic_xchg(word, 0u)
#else
#include "kernels/row_joint.h"
/* Worlds are stepped one after the other. */
#define ROW_TRY_LOCK(word) ((void)(word), 1)
#define ROW_UNLOCK(word) ((void)(word))
namespace Stg {
#endif

/* Number of islands of some kinds. */
RAY_FUNCTION ray_uint row_count_waiting(const row_world_t* w, ray_uint kinds) {
  ray_uint kind, sum = 0;
  for (kind = 0; kind < ROW_ISLAND_KINDS; kind++)
    if (((kinds >> kind) & 1) != 0) sum += *row_waiting_count(w, kind);
  return sum;
}

/* Chooses the island to solve, in its world's memory or in the shared one. */
RAY_FUNCTION void row_choose_island(const row_world_t* w, ray_uint number, int shared,
                                    row_solver_t* s) {
  s->w = w;
  s->island = ROW_SCRATCH(w, row_island_t, ROW_ISLANDS)[number];
  s->near = row_near_pairs(w, shared);
  s->walls = (RAY_GLOBAL ray_uint*)(row_memory(w, shared) + w->scene->rooms[shared].walls);
}

#if !defined(RAY_IN_OPENCL) || !defined(ROW_SOLVES_LARGE)

RAY_FUNCTION int row_solve_small(const row_world_t* w, ray_uint number, int easy) {
  row_solid_t solids[ROW_SMALL_SOLIDS];
  row_point_t corners[ROW_SMALL_CORNERS], moved[ROW_SMALL_MOVED];
  row_pair_t pairs[ROW_SMALL_PAIRS];
  row_touch_t touches[ROW_SMALL_PAIRS];
  row_solver_t s;
  row_choose_island(w, number, 0, &s);
  s.solids = solids;
  s.corners = corners;
  s.moved = moved;
  s.pairs = pairs;
  s.touches = touches;
  return row_solve_island(&s, easy);
}

/* Solves the share of a work-item of small islands. Those that take as long are solved side by
 * side. `easy`: they are given up, and become slow ones, if they take long. `w`: any world. */
RAY_FUNCTION void row_solve_small_islands(const row_world_t* w, ray_uint kinds, int easy,
                                          ray_uint item, ray_uint items) {
  ray_uint kind, i = item;
  for (kind = 0; kind < ROW_ISLAND_KINDS; kind++) {
    const ray_uint count = ((kinds >> kind) & 1) != 0 ? *row_waiting_count(w, kind) : 0;
    for (; i < count; i += items) {
      const row_waiting_t one = row_waiting(w, kind)[i];
      const row_world_t its = row_another_world(w, one.world);
      if (!row_solve_small(&its, one.island, easy))
        row_let_wait(&its, ROW_SLOW, row_add_waiting(&its, ROW_SLOW, 1), one.island);
    }
    i -= count;
  }
}

#endif
#if !defined(RAY_IN_OPENCL) || defined(ROW_SOLVES_LARGE)

RAY_FUNCTION void row_solve_in_room(const row_world_t* w, ray_uint number, int shared) {
  RAY_GLOBAL const row_room_t* const room = w->scene->rooms + shared;
  RAY_GLOBAL row_byte* const base = row_memory(w, shared);
  row_solver_t s;
  ray_uint first;
  row_choose_island(w, number, shared, &s);
  first = s.island.first_member + s.island.first_near;
  s.solids = (RAY_GLOBAL row_solid_t*)(base + room->solids) + first;
  s.corners = (RAY_GLOBAL row_point_t*)(base + room->corners) + first * w->scene->most_corners;
  s.moved = (RAY_GLOBAL row_point_t*)(base + room->moved) +
            2 * w->scene->most_moved * s.island.first_member;
  s.pairs = (RAY_GLOBAL row_pair_t*)(base + room->pairs) + s.island.first_pair;
  s.touches = (RAY_GLOBAL row_touch_t*)(base + room->touches) + s.island.first_pair;
  row_solve_island(&s, 0);
}

/* Solves all islands of a world in the memory that the worlds share. What needs the lock is inside
 * of the loop, because work-items of several worlds may run in lock-step. */
RAY_FUNCTION void row_solve_in_shared_room(const row_world_t* w, ray_uint islands) {
  volatile RAY_GLOBAL ray_uint* const lock =
      (volatile RAY_GLOBAL ray_uint*)(w->state + w->scene->lock);
  ray_uint waits = 1, i;
  while (waits)
    if (ROW_TRY_LOCK(lock)) {
      row_list_near(w, row_near_pairs(w, 1));
      for (i = 0; i < islands; i++) row_solve_in_room(w, i, 1);
      ROW_UNLOCK(lock);
      waits = 0;
    }
}

/* Solves the share of a work-item of the large islands. `w`: any world. */
RAY_FUNCTION void row_solve_large_islands(const row_world_t* w, ray_uint item, ray_uint items) {
  const ray_uint count = *row_waiting_count(w, ROW_LARGE);
  ray_uint i;
  for (i = item; i < count; i += items) {
    const row_waiting_t one = row_waiting(w, ROW_LARGE)[i];
    const row_world_t its = row_another_world(w, one.world);
    if ((one.island & ROW_ALL_OF) != 0)
      row_solve_in_shared_room(&its, one.island & ~ROW_ALL_OF);
    else
      row_solve_in_room(&its, one.island, 0);
  }
}

#endif

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
