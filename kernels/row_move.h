/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Moves with contacts of cells: outlines as bits, see libstage/rows/outline_bits.hh, and the moves
 * of Rows::Stepper. Compiled after row_odometry.h.
 *
 * Robots move one after the other on the host. Here all are first drawn at their wanted places and
 * tested against what stands, and against the present and the wanted places of the others. Then one
 * work-item decides, in the order of the host, which of these places count.
 */
#ifndef STAGE_KERNELS_ROW_MOVE_H
#define STAGE_KERNELS_ROW_MOVE_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_odometry.h"
namespace Stg {
#endif

#define ROW_NARROW_SIDE 16
#define ROW_MAX_CELL 1073741824 /* grid::kMaxCell */
#define ROW_SUPER_SIDE 1024     /* cells of a superregion on each axis */

/* ---- rows of bits ------------------------------------------------------------------------- */

RAY_FUNCTION ray_ulong row_word(RAY_GLOBAL const row_byte* bits, ray_uint narrow, int y) {
  return narrow ? ((RAY_GLOBAL const row_short*)bits)[y] : ((RAY_GLOBAL const ray_ulong*)bits)[y];
}

RAY_FUNCTION void row_set_word(RAY_GLOBAL row_byte* bits, ray_uint narrow, int y, ray_ulong word) {
  if (narrow)
    ((RAY_GLOBAL row_short*)bits)[y] = (row_short)word;
  else
    ((RAY_GLOBAL ray_ulong*)bits)[y] = word;
}

/* Number of rows of an outline that are kept. */
RAY_FUNCTION int row_height(row_box_t box, ray_uint narrow) {
  return narrow ? ROW_NARROW_SIDE : box.height;
}

/* See Overlap(). */
RAY_FUNCTION int row_overlap(row_box_t a, RAY_GLOBAL const row_byte* bits_of_a, row_box_t b,
                             RAY_GLOBAL const row_byte* bits_of_b, ray_uint narrow) {
  const ray_long shift = (ray_long)b.x - a.x, up = (ray_long)b.y - a.y;
  int y, begin, end;
  if (shift >= a.width || -shift >= b.width || up >= a.height || -up >= b.height) return 0;
  begin = up > 0 ? (int)up : 0;
  end = up + b.height < a.height ? (int)(up + b.height) : a.height;
  for (y = begin; y < end; y++) {
    const ray_ulong other = row_word(bits_of_b, narrow, y - (int)up);
    const ray_ulong there = shift >= 0 ? other << shift : other >> -shift;
    if ((row_word(bits_of_a, narrow, y) & there) != 0) return 1;
  }
  return 0;
}

/* ---- maps of what stands, see libstage/rows/cell_map.hh ------------------------------------ */

/* A lower bound of the distance in tiles to the nearest occupied tile, columns or rows. */
RAY_FUNCTION ray_long row_tile_distance(const row_world_t* w, row_map_t map, int tile_x,
                                        int tile_y) {
  const ray_long x = (ray_long)tile_x - map.x, y = (ray_long)tile_y - map.y;
  ray_long beside = -x;
  if (x >= 0 && x < map.width && y >= 0 && y < map.height)
    return ROW_AT(w, row_byte, map.distances)[y * map.width + x];
  if (x - map.width + 1 > beside) beside = x - map.width + 1;
  if (-y > beside) beside = -y;
  if (y - map.height + 1 > beside) beside = y - map.height + 1;
  return beside;
}

/* True if surely no occupied cell is within `cells` columns and rows of the cell. */
RAY_FUNCTION int row_is_clear(const row_world_t* w, ray_uint index, int x, int y, int cells) {
  const row_map_t map = ROW_PART(w, row_map_t, ROW_MAPS)[index];
  return map.width == 0 || (row_tile_distance(w, map, x >> 3, y >> 3) - 1) * 8 >= cells;
}

RAY_FUNCTION ray_ulong row_map_word(const row_world_t* w, row_map_t map, ray_long row,
                                    ray_long word) {
  if (word < 0 || word >= (ray_long)map.words) return 0;
  return ROW_AT(w, ray_ulong, map.bits)[row * (ray_long)map.words + word];
}

/* True if the outline has an occupied cell. See CellMap::Meets(). */
RAY_FUNCTION int row_meets_map(const row_world_t* w, ray_uint index, row_box_t box,
                               RAY_GLOBAL const row_byte* bits) {
  const row_map_t map = ROW_PART(w, row_map_t, ROW_MAPS)[index];
  const ray_long x = (ray_long)box.x - (ray_long)map.x * 8;
  const ray_long y = (ray_long)box.y - (ray_long)map.y * 8;
  const int bit = (int)(x & 63);
  int i;
  for (i = 0; i < box.height; i++) {
    ray_ulong there;
    if (y + i < 0 || y + i >= (ray_long)map.height * 8) continue;
    there = row_map_word(w, map, y + i, x >> 6) >> bit;
    if (bit != 0) there |= row_map_word(w, map, y + i, (x >> 6) + 1) << (64 - bit);
    if ((row_word(bits, w->scene->narrow, i) & there) != 0) return 1;
  }
  return 0;
}

/* ---- drawing ------------------------------------------------------------------------------ */

/* The cell of a corner; false if it exceeds the grid. */
RAY_FUNCTION int row_corner_cell(const row_world_t* w, row_point_t corner, row_placed_t frame,
                                 row_cell_t* cell) {
  const double sine = frame.turn.sine, cosine = frame.turn.cosine;
  const double scale = w->scene->cells_per_metre;
  const double x = (frame.x + corner.x * cosine - corner.y * sine) * scale;
  const double y = (frame.y + corner.x * sine + corner.y * cosine) * scale;
  const int fits = row_floor_is_within(x, ROW_MAX_CELL) && row_floor_is_within(y, ROW_MAX_CELL);
  cell->x = row_floor(fits ? x : 0.0);
  cell->y = row_floor(fits ? y : 0.0);
  return fits;
}

/* Finds the cells of all corners and their box; *differ is 0 if they are those that `cells` has
 * had. Returns false, with an empty box, if the body exceeds the grid. */
RAY_FUNCTION int row_find_cells(const row_world_t* w, RAY_GLOBAL const row_body_t* body,
                                row_placed_t frame, RAY_GLOBAL row_cell_t* cells, row_box_t* box,
                                int* differ) {
  RAY_GLOBAL const row_point_t* const corners =
      ROW_PART(w, row_point_t, ROW_CORNERS) + body->first_corner;
  const ray_uint count = body->corners;
  row_cell_t cell, low, high;
  int fits = 1;
  ray_uint i;
  row_to_frame(w, body->node, &frame);
  low.x = low.y = 0x7fffffff;
  high.x = high.y = -0x7fffffff;
  *differ = 0;
  for (i = 0; i < count; i++) {
    fits &= row_corner_cell(w, corners[i], frame, &cell);
    *differ |= cell.x != cells[i].x || cell.y != cells[i].y;
    cells[i] = cell;
    low.x = cell.x < low.x ? cell.x : low.x;
    low.y = cell.y < low.y ? cell.y : low.y;
    high.x = cell.x > high.x ? cell.x : high.x;
    high.y = cell.y > high.y ? cell.y : high.y;
  }
  box->x = fits ? low.x : 0;
  box->y = fits ? low.y : 0;
  box->width = fits ? high.x - low.x + 1 : 0;
  box->height = fits ? high.y - low.y + 1 : 0;
  return fits;
}

/* Draws the cells of an edge, without the last one. See ForEachCellOfEdge(). */
RAY_FUNCTION void row_draw_edge(row_cell_t from, row_cell_t to, row_box_t box,
                                RAY_GLOBAL row_byte* bits, ray_uint narrow) {
  const int dx = to.x - from.x, dy = to.y - from.y;
  const int sx = dx < 0 ? -1 : 1, sy = dy < 0 ? -1 : 1;
  const int ax = dx * sx, ay = dy * sy;
  int error = ay - ax, x = from.x - box.x, y = from.y - box.y, left;
  for (left = ax + ay; left > 0; left--) {
    row_set_word(bits, narrow, y, row_word(bits, narrow, y) | (ray_ulong)1 << x);
    if (error < 0) {
      x += sx;
      error += 2 * ay;
    } else {
      y += sy;
      error -= 2 * ax;
    }
  }
}

/* Draws the closed outline with these corners. See DrawOutline(). */
RAY_FUNCTION void row_draw_outline(RAY_GLOBAL const row_cell_t* cells, ray_uint count,
                                   row_box_t box, RAY_GLOBAL row_byte* bits, ray_uint narrow) {
  row_cell_t from = cells[count - 1];
  ray_uint i;
  int y, any = 0;
  for (y = 0; y < row_height(box, narrow); y++) row_set_word(bits, narrow, y, 0);
  for (i = 0; i < count; i++) {
    const row_cell_t to = cells[i];
    any |= from.x != to.x || from.y != to.y;
    row_draw_edge(from, to, box, bits, narrow);
    from = to;
  }
  if (!any && count > 2) row_set_word(bits, narrow, 0, 1);
}

/* ---- phases ------------------------------------------------------------------------------- */

/* Finds where a mover wants to be. See Rows::Stepper::FindWanted(). */
RAY_FUNCTION void row_find_wanted(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + index;
  const row_planar_t v = ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[index];
  const double seconds = w->scene->seconds;
  row_placed_t place;
  wanted->asked = 0;
  wanted->collides = 0;
  if (row_is_zero(v) || ROW_PART(w, row_mover_t, ROW_MOVERS)[index].drive == ROW_NO_DRIVE) return;
  row_find_place(w, index, &place);
  row_add(&place, row_planar(v.x * seconds, v.y * seconds, row_normalize(v.a * seconds)));
  if (!row_is_finite(place.x) || !row_is_finite(place.y) || !row_is_finite(place.a)) {
    ROW_COLUMN(w, row_byte, ROW_STALLED)[index] = 1;
    return;
  }
  wanted->place = place;
  wanted->asked = 1;
}

/* Draws a body at the wanted place of its mover. */
RAY_FUNCTION void row_draw(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_body_t* const body = ROW_PART(w, row_body_t, ROW_BODIES) + index;
  RAY_GLOBAL const row_wanted_t* const wanted =
      ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + body->mover;
  RAY_GLOBAL row_drawn_t* const drawn = ROW_SCRATCH(w, row_drawn_t, ROW_DRAWN) + index;
  RAY_GLOBAL row_cell_t* const cells = ROW_SCRATCH(w, row_cell_t, ROW_CELLS) + body->first_corner;
  RAY_GLOBAL row_byte* const bits = ROW_SCRATCH(w, row_byte, ROW_DRAWN_BITS) + body->first_byte;
  row_placed_t place;
  row_box_t box;
  int pass, was_inside = 0, is_inside = 0, differ = 0;
  if (!wanted->asked) return;
  row_find_place(w, body->mover, &place);
  for (pass = 0; pass < 2; pass++) { /* where it is, and where it would be */
    was_inside = is_inside;
    is_inside = row_find_cells(w, body, place, cells, &box, &differ);
    place = wanted->place;
  }
  drawn->box = box;
  drawn->moved = was_inside != is_inside || (is_inside && differ); /* see HasMoved() */
  if (is_inside) row_draw_outline(cells, body->corners, box, bits, w->scene->narrow);
}

/* Tests a body against what stands, after it has been drawn. */
RAY_FUNCTION void row_test_drawn(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_body_t* const body = ROW_PART(w, row_body_t, ROW_BODIES) + index;
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + body->mover;
  RAY_GLOBAL const row_byte* const bits =
      ROW_SCRATCH(w, row_byte, ROW_DRAWN_BITS) + body->first_byte;
  row_box_t box;
  int side;
  if (!wanted->asked || (body->flags & ROW_OBSTACLE) == 0) return;
  box = ROW_SCRATCH(w, row_drawn_t, ROW_DRAWN)[index].box;
  side = box.width > box.height ? box.width : box.height;
  if ((body->flags & ROW_BELOW_FLOOR) != 0 ||
      (side > 0 && !row_is_clear(w, body->blocked, box.x, box.y, side) &&
       row_meets_map(w, body->blocked, box, bits)))
    wanted->collides = 1;
}

/* Tests a drawn body against a group of its rivals. */
RAY_FUNCTION void row_test_group(const row_world_t* w, ray_uint group) {
  RAY_GLOBAL const row_body_t* const bodies = ROW_PART(w, row_body_t, ROW_BODIES);
  RAY_GLOBAL const row_drawn_t* const drawn = ROW_SCRATCH(w, row_drawn_t, ROW_DRAWN);
  RAY_GLOBAL const row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED);
  RAY_GLOBAL const row_box_t* const boxes = ROW_COLUMN(w, row_box_t, ROW_BOX);
  RAY_GLOBAL const row_byte* const bits = ROW_COLUMN(w, row_byte, ROW_BITS);
  RAY_GLOBAL const row_byte* const drawn_bits = ROW_SCRATCH(w, row_byte, ROW_DRAWN_BITS);
  const ray_uint index = ROW_PART(w, ray_uint, ROW_GROUPS)[group];
  RAY_GLOBAL const row_body_t* const body = bodies + index;
  const ray_uint first = group * ROW_GROUP - body->first_rival;
  const ray_uint left = body->rivals - first, narrow = w->scene->narrow;
  row_overlaps_t overlaps;
  ray_uint i;
  overlaps.before = overlaps.drawn = 0;
  if (wanted[body->mover].asked && drawn[index].box.height != 0) {
    const row_box_t box = drawn[index].box;
    RAY_GLOBAL const row_byte* const own = drawn_bits + body->first_byte;
    for (i = 0; i < left && i < ROW_GROUP; i++) {
      const ray_uint rival = ROW_PART(w, ray_uint, ROW_RIVALS)[group * ROW_GROUP + i];
      const ray_uint byte = bodies[rival].first_byte;
      if (row_overlap(box, own, boxes[rival], bits + byte, narrow)) overlaps.before |= 1u << i;
      if (bodies[rival].mover < body->mover && wanted[bodies[rival].mover].asked &&
          row_overlap(box, own, drawn[rival].box, drawn_bits + byte, narrow))
        overlaps.drawn |= 1u << i;
    }
  }
  ROW_SCRATCH(w, row_overlaps_t, ROW_OVERLAPS)[group] = overlaps;
}

/* True if a body of the mover overlaps a rival, after the movers before it have moved. */
RAY_FUNCTION int row_meets_rival(const row_world_t* w, RAY_GLOBAL const row_mover_t* mover) {
  RAY_GLOBAL const row_body_t* const bodies = ROW_PART(w, row_body_t, ROW_BODIES);
  ray_uint b, group, i;
  for (b = mover->first_body; b < mover->first_body + mover->bodies; b++) {
    const ray_uint first = bodies[b].first_rival / ROW_GROUP;
    for (group = first; (group - first) * ROW_GROUP < bodies[b].rivals; group++) {
      const row_overlaps_t overlaps = ROW_SCRATCH(w, row_overlaps_t, ROW_OVERLAPS)[group];
      for (i = 0; ((overlaps.before | overlaps.drawn) >> i) != 0; i++) {
        const ray_uint rival = ROW_PART(w, ray_uint, ROW_RIVALS)[group * ROW_GROUP + i];
        RAY_GLOBAL const row_wanted_t* const its =
            ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + bodies[rival].mover;
        const int has_moved = bodies[rival].mover < bodies[b].mover && its->asked && !its->collides;
        if ((((has_moved ? overlaps.drawn : overlaps.before) >> i) & 1) != 0) return 1;
        if (i == ROW_GROUP - 1) break;
      }
    }
  }
  return 0;
}

/* See Rows::Stepper::WidenExtent(). */
RAY_FUNCTION void row_widen_extent(const row_world_t* w, row_box_t box) {
  RAY_GLOBAL row_extent_t* const extent = ROW_COLUMN(w, row_extent_t, ROW_EXTENT);
  const int last = ROW_SUPER_SIDE - 1;
  const int min_x = box.x & ~last, max_x = (box.x + box.width - 1) | last;
  const int min_y = box.y & ~last, max_y = (box.y + box.height - 1) | last;
  const int is_empty = extent->min_x > extent->max_x;
  if (box.height == 0) return;
  if (is_empty || min_x < extent->min_x) extent->min_x = min_x;
  if (is_empty || min_y < extent->min_y) extent->min_y = min_y;
  if (is_empty || max_x > extent->max_x) extent->max_x = max_x;
  if (is_empty || max_y > extent->max_y) extent->max_y = max_y;
}

/* Numbers the rasterizations of the movers that move, in the order of the host. */
RAY_FUNCTION void row_number_drawings(const row_world_t* w) {
  RAY_GLOBAL const row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED);
  RAY_GLOBAL row_drawn_t* const drawn = ROW_SCRATCH(w, row_drawn_t, ROW_DRAWN);
  ray_ulong stamps = *ROW_COLUMN(w, ray_ulong, ROW_STAMPS);
  ray_uint i, b;
  for (i = 0; i < w->scene->movers; i++) {
    RAY_GLOBAL const row_mover_t* const mover = ROW_PART(w, row_mover_t, ROW_MOVERS) + i;
    for (b = mover->first_body; b < mover->first_body + mover->bodies; b++) {
      const int moves = wanted[i].asked && !wanted[i].collides && drawn[b].moved;
      drawn[b].stamp = moves ? ++stamps : 0;
      if (moves) row_widen_extent(w, drawn[b].box);
    }
  }
  *ROW_COLUMN(w, ray_ulong, ROW_STAMPS) = stamps;
}

/* Decides one mover after the other whether it collides. */
RAY_FUNCTION void row_decide(const row_world_t* w) {
  ray_uint i;
  for (i = 0; i < w->scene->movers; i++) {
    RAY_GLOBAL const row_mover_t* const mover = ROW_PART(w, row_mover_t, ROW_MOVERS) + i;
    RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + i;
    if (wanted->asked && !wanted->collides) wanted->collides = (ray_uint)row_meets_rival(w, mover);
  }
  row_number_drawings(w);
}

/* Moves the outline of a body to where it was drawn, if its mover moves. See
 * Rows::Stepper::Commit(). */
RAY_FUNCTION void row_commit(const row_world_t* w, ray_uint index) {
  const row_drawn_t drawn = ROW_SCRATCH(w, row_drawn_t, ROW_DRAWN)[index];
  const ray_uint first_byte = ROW_PART(w, row_body_t, ROW_BODIES)[index].first_byte;
  RAY_GLOBAL const row_byte* const from = ROW_SCRATCH(w, row_byte, ROW_DRAWN_BITS) + first_byte;
  RAY_GLOBAL row_byte* const to = ROW_COLUMN(w, row_byte, ROW_BITS) + first_byte;
  int y;
  if (drawn.stamp == 0) return;
  ROW_COLUMN(w, row_box_t, ROW_BOX)[index] = drawn.box;
  ROW_COLUMN(w, ray_ulong, ROW_STAMP)[index] = drawn.stamp;
  for (y = 0; y < row_height(drawn.box, w->scene->narrow); y++)
    row_set_word(to, w->scene->narrow, y, row_word(from, w->scene->narrow, y));
}

/* Writes the wanted place of a mover to its pose. */
RAY_FUNCTION void row_take_place(const row_world_t* w, ray_uint index) {
  const row_placed_t place = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED)[index].place;
  ROW_COLUMN(w, row_planar_t, ROW_POSE)[index] = row_planar(place.x, place.y, place.a);
  ROW_COLUMN(w, row_turn_t, ROW_TURN)[index] = place.turn;
}

/* Ends the move of a mover: its pose, whether it stalls, and its odometry. */
RAY_FUNCTION void row_end_move(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + index;
  if (!wanted->asked) return;
  ROW_COLUMN(w, row_byte, ROW_STALLED)[index] = (row_byte)wanted->collides;
  if (!wanted->collides) row_take_place(w, index);
  row_note_motion(
      w, index,
      wanted->collides ? row_planar(0, 0, 0) : ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[index]);
}

/* Moves all movers of the world. See Rows::Stepper::MoveCells(). */
RAY_FUNCTION void row_move(const row_world_t* w) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  ray_uint i;
  for (i = ROW_ITEM; i < scene->movers; i += ROW_ITEMS) row_find_wanted(w, i);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < scene->bodies; i += ROW_ITEMS) {
    row_draw(w, i);
    row_test_drawn(w, i);
  }
  ROW_BARRIER();
  for (i = ROW_ITEM; i < scene->groups; i += ROW_ITEMS) row_test_group(w, i);
  ROW_BARRIER();
  if (ROW_ITEM == 0) row_decide(w);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < scene->bodies; i += ROW_ITEMS) row_commit(w, i);
  for (i = ROW_ITEM; i < scene->movers; i += ROW_ITEMS) row_end_move(w, i);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
