/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Access to a world's columns and to the scene. Compiled after row_vector.h.
 *
 * A world is stepped by a group of work-items. In a phase, each work-item does its share; between
 * phases, ROW_BARRIER() makes what one has written visible to the others. On the host there is one
 * work-item.
 */
#ifndef STAGE_KERNELS_ROW_ACCESS_H
#define STAGE_KERNELS_ROW_ACCESS_H

#ifdef RAY_IN_OPENCL
#define ROW_BARRIER() barrier(CLK_GLOBAL_MEM_FENCE)
#define ROW_ITEM ((uint)get_local_id(0))
#define ROW_ITEMS ((uint)get_local_size(0))
#else
#include "kernels/row_vector.h"
#define ROW_BARRIER() ((void)0)
#define ROW_ITEM 0u
#define ROW_ITEMS 1u
namespace Stg {
#endif

/* A world: equal for all work-items of its group. */
typedef struct {
  RAY_GLOBAL const row_byte* image;
  RAY_GLOBAL const row_scene_t* scene; /* the same address */
  RAY_GLOBAL row_byte* state;          /* columns of all worlds */
  RAY_GLOBAL row_byte* scratch;        /* of this world */
  ray_ulong world;
} row_world_t;

RAY_FUNCTION row_world_t row_world_at(RAY_GLOBAL const row_byte* image, RAY_GLOBAL row_byte* state,
                                      RAY_GLOBAL row_byte* scratch, ray_ulong world) {
  row_world_t w;
  w.image = image;
  w.scene = (RAY_GLOBAL const row_scene_t*)image;
  w.state = state;
  w.scratch = scratch + world * w.scene->scratch_bytes;
  w.world = world;
  return w;
}

/* The scratch memory of all worlds. */
RAY_FUNCTION RAY_GLOBAL row_byte* row_whole_scratch(const row_world_t* w) {
  return w->scratch - w->world * w->scene->scratch_bytes;
}

/* Another world of the same buffers. */
RAY_FUNCTION row_world_t row_another_world(const row_world_t* w, ray_ulong world) {
  return row_world_at(w->image, w->state, row_whole_scratch(w), world);
}

/* Elements of this world in a column: ROW_COLUMN(w, double, ROW_RANGES)[ray]. */
#define ROW_COLUMN(w, type, column)                              \
  ((RAY_GLOBAL type*)((w)->state + (w)->scene->columns[column] + \
                      (w)->world * (w)->scene->row_bytes[column]))
/* Elements of a part of the image, or of what has this offset in it. */
#define ROW_PART(w, type, part) ((RAY_GLOBAL const type*)((w)->image + (w)->scene->parts[part]))
#define ROW_AT(w, type, offset) ((RAY_GLOBAL const type*)((w)->image + (offset)))
#define ROW_SCRATCH(w, type, which) ((RAY_GLOBAL type*)((w)->scratch + (w)->scene->scratch[which]))

/* The properties of a mover in this world. See Rows::PropertiesOf(). */
RAY_FUNCTION RAY_GLOBAL const row_properties_t* row_properties(const row_world_t* w,
                                                               ray_uint mover) {
  if (w->scene->varies_movers) return ROW_COLUMN(w, row_properties_t, ROW_PROPERTIES) + mover;
  return &ROW_PART(w, row_mover_t, ROW_MOVERS)[mover].properties;
}

/* Finds the pose of a mover with sine and cosine. */
RAY_FUNCTION void row_find_place(const row_world_t* w, ray_uint mover, row_placed_t* place) {
  const row_planar_t pose = ROW_COLUMN(w, row_planar_t, ROW_POSE)[mover];
  place->x = pose.x;
  place->y = pose.y;
  place->a = pose.a;
  place->turn = ROW_COLUMN(w, row_turn_t, ROW_TURN)[mover];
}

/* Turns the place of a mover into the frame of its node. See Mover::FrameOf(). */
RAY_FUNCTION void row_to_frame(const row_world_t* w, ray_uint node, row_placed_t* place) {
  const row_node_t record = ROW_PART(w, row_node_t, ROW_NODES)[node];
  RAY_GLOBAL const row_planar_t* const links = ROW_PART(w, row_planar_t, ROW_LINKS);
  ray_uint i;
  for (i = record.first_link; i < record.end_link; i++) row_add(place, links[i]);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
