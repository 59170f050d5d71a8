/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Finds which touchers may touch which others and walls within a step, and the islands that they
 * form: libstage/motion/nearby.cc and walls.hh. Compiled after row_access.h.
 *
 * First, each work-item looks around some touchers. If one of them is near something, a single
 * work-item forms the islands.
 */
#ifndef STAGE_KERNELS_ROW_CROWD_H
#define STAGE_KERNELS_ROW_CROWD_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_access.h"
namespace Stg {
#endif

/* See libstage/motion/separation.hh. */
#define ROW_HARD 2e-5
#define ROW_SKIN 4e-4
#define ROW_TOUCH 8e-4

/* A row of motion::Columns, and what Nearby knows about it. */
typedef struct RAY_ALIGNED(16) {
  double x, y, heading, target_x, target_y, target_heading, turn;
  double made;
  double reach, push;
  ray_uint root, island, place; /* place in the island, or ROW_NONE */
  ray_uint walls, first_wall;   /* edges nearby */
  ray_uint near;                /* it may touch something */
  ray_uint asked;               /* it wants to move */
  ray_uint grown;               /* its reach has grown since its neighbours were found */
} row_contact_t;

/* See motion::NearPair. */
typedef struct {
  ray_uint a, b;
} row_near_t;

/* See motion::Island. The pairs of an island are at most `pairs`. */
typedef struct RAY_ALIGNED(16) {
  ray_uint first_member, end_member;
  ray_uint first_near, end_near;
  ray_uint first_pair, pairs;
  ray_uint standing; /* bodies that cannot move, one for each pair with them */
  ray_uint kind;     /* ROW_SMALL, ... */
} row_island_t;

typedef struct {
  double x0, y0, x1, y1;
} row_square_t;
typedef struct {
  int x0, y0, x1, y1;
} row_edge_cells_t;

RAY_FUNCTION RAY_GLOBAL row_contact_t* row_contacts(const row_world_t* w) {
  return ROW_SCRATCH(w, row_contact_t, ROW_CONTACTS);
}
RAY_FUNCTION RAY_GLOBAL const row_toucher_t* row_toucher(const row_world_t* w, ray_uint i) {
  return ROW_PART(w, row_toucher_t, ROW_TOUCHERS) + i;
}
/* The memory for the pairs of a world: its own, or the shared one. See row_room_t. */
RAY_FUNCTION RAY_GLOBAL row_byte* row_memory(const row_world_t* w, int shared) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  return row_whole_scratch(w) +
         (shared ? scene->shared_room : scene->first_room + w->world * scene->rooms[0].bytes);
}
RAY_FUNCTION RAY_GLOBAL row_near_t* row_near_pairs(const row_world_t* w, int shared) {
  return (RAY_GLOBAL row_near_t*)(row_memory(w, shared) + w->scene->rooms[shared].near);
}

/* Islands of a kind that wait to be solved, and how many they are. */
RAY_FUNCTION RAY_GLOBAL row_waiting_t* row_waiting(const row_world_t* w, ray_uint kind) {
  return (RAY_GLOBAL row_waiting_t*)(row_whole_scratch(w) + w->scene->waiting) +
         kind * w->scene->most_waiting;
}
RAY_FUNCTION volatile RAY_GLOBAL ray_uint* row_waiting_count(const row_world_t* w, ray_uint kind) {
  return (volatile RAY_GLOBAL ray_uint*)(w->state + w->scene->counts) + kind;
}

/* Makes room for further islands on a list. Returns the place of the first one. */
RAY_FUNCTION ray_uint row_add_waiting(const row_world_t* w, ray_uint kind, ray_uint islands) {
#ifdef RAY_IN_OPENCL
  return atomic_add(row_waiting_count(w, kind), islands);
#else /* worlds are stepped one after the other */
  const ray_uint before = *row_waiting_count(w, kind);
  *row_waiting_count(w, kind) = before + islands;
  return before;
#endif
}

/* Puts one island, or all of a world, at a place of a list. */
RAY_FUNCTION void row_let_wait(const row_world_t* w, ray_uint kind, ray_uint place,
                               ray_uint island) {
  RAY_GLOBAL row_waiting_t* const one = row_waiting(w, kind) + place;
  one->world = (ray_uint)w->world;
  one->island = island;
}

RAY_FUNCTION ray_uint row_bit_words(const row_world_t* w) { return (w->scene->touchers + 31) / 32; }
RAY_FUNCTION RAY_GLOBAL ray_uint* row_near_bits(const row_world_t* w, ray_uint i) {
  return ROW_SCRATCH(w, ray_uint, ROW_NEAR_BITS) + i * row_bit_words(w);
}
RAY_FUNCTION int row_is_near(const row_world_t* w, ray_uint a, ray_uint b) {
  return (int)((row_near_bits(w, a)[b / 32] >> (b % 32)) & 1);
}

RAY_FUNCTION int row_squares_overlap(row_square_t a, row_square_t b) {
  return a.x0 <= b.x1 && b.x0 <= a.x1 && a.y0 <= b.y1 && b.y0 <= a.y1;
}

/* See Nearby::SetBox(). */
RAY_FUNCTION row_square_t row_square_of(const row_world_t* w, ray_uint i) {
  RAY_GLOBAL const row_contact_t* const c = row_contacts(w) + i;
  const double side = row_toucher(w, i)->bound + c->reach + ROW_TOUCH;
  row_square_t square;
  square.x0 = c->x - side;
  square.y0 = c->y - side;
  square.x1 = c->x + side;
  square.y1 = c->y + side;
  return square;
}

/* ---- walls ---------------------------------------------------------------------------------- */

RAY_FUNCTION int row_edge_cell(double position, double origin, double size, int count) {
  const double cell = (position - origin) / size;
  if (!(cell > 0.0)) return 0;
  return cell < (double)count ? (int)cell : count - 1;
}

/* See Walls::CellsOf(). */
RAY_FUNCTION row_edge_cells_t row_edge_cells(const row_world_t* w, row_square_t box) {
  const row_edge_index_t index = w->scene->edges;
  row_edge_cells_t cells;
  cells.x0 = row_edge_cell(box.x0, index.x0, index.cell, index.columns);
  cells.y0 = row_edge_cell(box.y0, index.y0, index.cell, index.rows);
  cells.x1 = row_edge_cell(box.x1, index.x0, index.cell, index.columns);
  cells.y1 = row_edge_cell(box.y1, index.y0, index.cell, index.rows);
  return cells;
}

RAY_FUNCTION row_square_t row_square_of_edge(row_point_t a, row_point_t b) {
  row_square_t box;
  box.x0 = row_smaller(a.x, b.x);
  box.y0 = row_smaller(a.y, b.y);
  box.x1 = row_larger(a.x, b.x);
  box.y1 = row_larger(a.y, b.y);
  return box;
}

/* See SquaredDistance(). */
RAY_FUNCTION double row_squared_distance_to_edge(row_point_t p, row_point_t a, row_point_t b) {
  const row_point_t along = row_minus(b, a), from = row_minus(p, a);
  const double square = row_dot(along, along);
  const double t = square > 0.0 ? row_clamp(row_dot(from, along) / square, 0.0, 1.0) : 0.0;
  const row_point_t distance = row_minus(from, row_times(t, along));
  return row_dot(distance, distance);
}

/* True if an edge, which is in this cell of the index, is near a toucher, and this is the first
 * cell in which it is found. */
RAY_FUNCTION int row_is_edge_near(const row_world_t* w, ray_uint i, ray_uint number,
                                  row_square_t box, row_edge_cells_t near, int x, int y) {
  RAY_GLOBAL const row_edge_t* const edge = ROW_PART(w, row_edge_t, ROW_EDGES) + number;
  const row_point_t a = edge->ends[0], b = edge->ends[1];
  const row_square_t of_edge = row_square_of_edge(a, b);
  RAY_GLOBAL const row_contact_t* const c = row_contacts(w) + i;
  const double far = row_toucher(w, i)->bound + c->reach + ROW_TOUCH;
  row_edge_cells_t own;
  if (!row_squares_overlap(box, of_edge)) return 0;
  own = row_edge_cells(w, of_edge);
  if ((own.x0 < near.x0 ? near.x0 : own.x0) != x || (own.y0 < near.y0 ? near.y0 : own.y0) != y)
    return 0;
  return row_squared_distance_to_edge(row_point(c->x, c->y), a, b) < far * far;
}

/* Puts a number into an ascending list with `count` numbers. */
RAY_FUNCTION void row_insert(RAY_GLOBAL ray_uint* list, ray_uint count, ray_uint number) {
  for (; count > 0 && list[count - 1] > number; count--) list[count] = list[count - 1];
  list[count] = number;
}

/* Counts the edges near a toucher, or lists them in their order. See Nearby::FindWallsOf(). */
RAY_FUNCTION ray_uint row_find_walls(const row_world_t* w, ray_uint i, int lists,
                                     RAY_GLOBAL ray_uint* list) {
  RAY_GLOBAL const ray_uint* const starts = ROW_PART(w, ray_uint, ROW_EDGE_STARTS);
  RAY_GLOBAL const ray_uint* const entries = ROW_PART(w, ray_uint, ROW_EDGE_ENTRIES);
  const row_edge_index_t index = w->scene->edges;
  const row_square_t box = row_square_of(w, i);
  row_square_t all;
  row_edge_cells_t near;
  ray_uint count = 0, k;
  int x, y;
  all.x0 = index.x0;
  all.y0 = index.y0;
  all.x1 = index.x1;
  all.y1 = index.y1;
  if (row_contacts(w)[i].reach == 0.0 || index.edges == 0 || !row_squares_overlap(box, all))
    return 0;
  near = row_edge_cells(w, box);
  for (y = near.y0; y <= near.y1; y++)
    for (x = near.x0; x <= near.x1; x++)
      for (k = starts[y * index.columns + x]; k < starts[y * index.columns + x + 1]; k++) {
        if (!row_is_edge_near(w, i, entries[k], box, near, x, y)) continue;
        if (lists) row_insert(list, count, entries[k]);
        count++;
      }
  return count;
}

/* ---- pairs ---------------------------------------------------------------------------------- */

/* See Nearby::TryPair(). Touchers and walls are whole trees, so none are related. */
RAY_FUNCTION int row_may_touch(const row_world_t* w, ray_uint a, ray_uint b) {
  RAY_GLOBAL const row_contact_t* const of_a = row_contacts(w) + a;
  RAY_GLOBAL const row_contact_t* const of_b = row_contacts(w) + b;
  double dx, dy, far;
  if (of_a->reach == 0.0 && of_b->reach == 0.0) return 0;
  if (!row_squares_overlap(row_square_of(w, a), row_square_of(w, b))) return 0;
  dx = of_a->x - of_b->x;
  dy = of_a->y - of_b->y;
  far = (row_toucher(w, a)->bound + row_toucher(w, b)->bound) + (of_a->reach + of_b->reach) +
        ROW_TOUCH;
  return dx * dx + dy * dy < far * far;
}

/* Looks around a toucher: at those after it, and at walls. */
RAY_FUNCTION void row_look_around(const row_world_t* w, ray_uint a) {
  RAY_GLOBAL row_contact_t* const contact = row_contacts(w) + a;
  RAY_GLOBAL ray_uint* const bits = row_near_bits(w, a);
  ray_uint b, word, any = 0;
  for (word = 0; word < row_bit_words(w); word++) bits[word] = 0;
  for (b = a + 1; b < w->scene->touchers; b++)
    if (row_may_touch(w, a, b)) {
      bits[b / 32] |= 1u << (b % 32);
      any = 1;
    }
  contact->walls = row_find_walls(w, a, 0, 0);
  contact->near = any | (contact->walls > 0 ? 1u : 0u);
}

/* Gives a pushable toucher the reach of one that may push it. True if that changes it. */
RAY_FUNCTION ray_uint row_spread(const row_world_t* w, ray_uint to, ray_uint from) {
  RAY_GLOBAL row_contact_t* const contacts = row_contacts(w);
  if ((row_toucher(w, to)->flags & ROW_IS_PUSHABLE) == 0) return 0;
  if (contacts[from].push <= contacts[to].push) return 0;
  contacts[to].reach = contacts[to].push = contacts[from].push;
  contacts[to].grown = 1;
  return 1;
}

/* Finds the pairs of a toucher whose reach has grown. */
RAY_FUNCTION void row_look_again(const row_world_t* w, ray_uint a) {
  ray_uint b;
  row_contacts(w)[a].grown = 0;
  for (b = 0; b < w->scene->touchers; b++)
    if (b != a && row_may_touch(w, a, b)) {
      const ray_uint first = a < b ? a : b, second = a < b ? b : a;
      row_near_bits(w, first)[second / 32] |= 1u << (second % 32);
    }
}

/* See Nearby::SpreadReaches(). The result does not depend on the order. */
RAY_FUNCTION void row_spread_reaches(const row_world_t* w) {
  const ray_uint count = w->scene->touchers;
  ray_uint a, b, grown = 1;
  while (grown) {
    grown = 0;
    for (a = 0; a < count; a++)
      for (b = a + 1; b < count; b++)
        if (row_is_near(w, a, b)) grown |= row_spread(w, a, b) | row_spread(w, b, a);
    for (a = 0; a < count; a++)
      if (row_contacts(w)[a].grown) {
        row_look_again(w, a);
        row_contacts(w)[a].walls = row_find_walls(w, a, 0, 0);
      }
  }
}

/* ---- islands -------------------------------------------------------------------------------- */

RAY_FUNCTION ray_uint row_root(RAY_GLOBAL row_contact_t* contacts, ray_uint i) {
  while (contacts[i].root != i) i = contacts[i].root = contacts[contacts[i].root].root;
  return i;
}

/* Unites what may touch (union-find, with the smallest member as root). */
RAY_FUNCTION void row_unite(const row_world_t* w) {
  RAY_GLOBAL row_contact_t* const contacts = row_contacts(w);
  const ray_uint count = w->scene->touchers;
  ray_uint a, b;
  for (a = 0; a < count; a++) {
    contacts[a].root = a;
    contacts[a].place = contacts[a].walls > 0 ? 0 : ROW_NONE;
  }
  for (a = 0; a < count; a++)
    for (b = a + 1; b < count; b++) {
      ray_uint first, second;
      if (!row_is_near(w, a, b)) continue;
      if (contacts[a].reach > 0.0) contacts[a].place = 0;
      if (contacts[b].reach > 0.0) contacts[b].place = 0;
      if (contacts[a].reach == 0.0 || contacts[b].reach == 0.0) continue;
      first = row_root(contacts, a);
      second = row_root(contacts, b);
      contacts[first < second ? second : first].root = first < second ? first : second;
    }
}

RAY_FUNCTION ray_uint row_island_of(const row_world_t* w, ray_uint a, ray_uint b) {
  RAY_GLOBAL const row_contact_t* const contacts = row_contacts(w);
  return contacts[a].place != ROW_NONE ? contacts[a].island : contacts[b].island;
}

/* Numbers the islands and lists their members. Returns the number of islands. */
RAY_FUNCTION ray_uint row_list_members(const row_world_t* w) {
  RAY_GLOBAL row_contact_t* const contacts = row_contacts(w);
  RAY_GLOBAL row_island_t* const islands = ROW_SCRATCH(w, row_island_t, ROW_ISLANDS);
  RAY_GLOBAL ray_uint* const members = ROW_SCRATCH(w, ray_uint, ROW_MEMBERS);
  const ray_uint count = w->scene->touchers;
  ray_uint i, sum = 0, number = 0;
  for (i = 0; i < count; i++) {
    ray_uint root;
    if (contacts[i].place == ROW_NONE) continue;
    root = row_root(contacts, i);
    contacts[i].island = root == i ? number : contacts[root].island;
    if (root == i) {
      islands[number].end_member = islands[number].end_near = islands[number].pairs = 0;
      islands[number].standing = 0;
      number++;
    }
    contacts[i].place = islands[contacts[i].island].end_member++;
    islands[contacts[i].island].pairs += contacts[i].walls * row_toucher(w, i)->pieces;
  }
  for (i = 0; i < number; i++) {
    islands[i].first_member = sum;
    sum = islands[i].end_member += sum;
  }
  for (i = 0; i < count; i++)
    if (contacts[i].place != ROW_NONE)
      members[islands[contacts[i].island].first_member + contacts[i].place] = i;
  return number;
}

/* Finds where the pairs of the islands begin. False if they do not fit into the room. */
RAY_FUNCTION int row_place_islands(const row_world_t* w, ray_uint count) {
  RAY_GLOBAL row_contact_t* const contacts = row_contacts(w);
  RAY_GLOBAL row_island_t* const islands = ROW_SCRATCH(w, row_island_t, ROW_ISLANDS);
  RAY_GLOBAL const row_room_t* const room = w->scene->rooms;
  ray_ulong walls = 0, near = 0, pairs = 0;
  ray_uint a, b, k;
  for (a = 0; a < w->scene->touchers; a++) {
    contacts[a].first_wall = (ray_uint)walls;
    walls += contacts[a].place != ROW_NONE ? contacts[a].walls : 0;
    for (b = a + 1; b < w->scene->touchers; b++) {
      if (!row_is_near(w, a, b)) continue;
      k = row_island_of(w, a, b);
      islands[k].end_near++;
      islands[k].standing += contacts[a].place == ROW_NONE || contacts[b].place == ROW_NONE;
      islands[k].pairs += row_toucher(w, a)->pieces * row_toucher(w, b)->pieces;
    }
  }
  for (k = 0; k < count; k++) {
    islands[k].first_near = (ray_uint)near;
    islands[k].first_pair = (ray_uint)pairs;
    near += islands[k].end_near;
    pairs += islands[k].pairs;
    islands[k].end_near = islands[k].first_near;
  }
  return near <= room->most_near && walls <= room->most_walls && pairs <= room->most_pairs;
}

/* Lists the pairs of touchers by island, in their order. */
RAY_FUNCTION void row_list_near(const row_world_t* w, RAY_GLOBAL row_near_t* near) {
  RAY_GLOBAL row_island_t* const islands = ROW_SCRATCH(w, row_island_t, ROW_ISLANDS);
  ray_uint a, b;
  for (a = 0; a < w->scene->touchers; a++)
    for (b = a + 1; b < w->scene->touchers; b++)
      if (row_is_near(w, a, b)) {
        RAY_GLOBAL row_near_t* const to = near + islands[row_island_of(w, a, b)].end_near++;
        to->a = a;
        to->b = b;
      }
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
