/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Kernels that find the ranges of rays, for fans that stop at everything in their layer but their
 * own tree. They need doubles. Compiled after prefilter.cl and row_ranges.h.
 */

/* The range of a ray that the host must trace. */
double unknown_range(void) { return ROW_NUMBER((ulong)0x7ff8 << 48); }

/* ---- the cell model ----------------------------------------------------------------------- */

/* True if the robot has cells in this layer that hold nothing else of it and are not hidden. */
int is_in_own_way(const item_ray_t* item) {
  const ray_mask_t* const mask = &item->mask;
  return (int)(mask->tiles[mask->width * mask->height] >> item->layer) & 1;
}

/* Finds ranges of the cell model, one work-item per ray: with a minus sign for rays that hit
 * nothing. The record for ranges of a fan is to_range_record records behind that of the fan. */
__kernel void find_cell_ranges(__global const ray_super_t* directory, const uint directory_mask,
                               __global const uint* regions, __global const ulong* words,
                               const int4 box, __global const ray_group_record_t* groups,
                               const uint first_group, const uint end_group,
                               __global const ray_fan_record_t* fans,
                               __global const ray_direction_t* directions,
                               __global const ulong* masks, const uint first_mask,
                               __global const ray_range_record_t* for_ranges,
                               const uint to_range_record, __global double* ranges) {
  item_ray_t item;
  double range;
  if (!begin_item(directory, directory_mask, regions, words, box, groups, first_group, end_group,
                  fans, directions, masks, first_mask, &item))
    return;
  range = ROW_NUMBER(for_ranges[item.fan + to_range_record].range);
  if (is_in_own_way(&item))
    range = unknown_range();
  else if (ray_next(&item.grid, &item.mask, &item.ray))
    range *= row_middle((item.ray.u << 16) - item.ray.ox, (item.ray.v << 16) - item.ray.oy,
                        item.ray.adx, item.ray.ady);
  else
    range = -range;
  ranges[item.number] = range;
}

/* ---- the exact model ---------------------------------------------------------------------- */

/* An exact ray, and the nearest hit so far. */
typedef struct {
  row_line_t line;
  ulong tree;   /* bodies of this tree are passed */
  uint layer;   /* bodies of other layers too */
  double range; /* to the hit, or the length of the ray */
  int has_hit;
} exact_ray_t;

/* The outlines of the grid: see DeviceOutlines in libstage/sensing/device_outlines.hh. */
typedef struct {
  __global const ulong* words;
  uint first_body, first_outline; /* offsets in words */
} outlines_t;

/* Tests an outline of a tile. Returns true if it is nearer than the nearest one so far. See
 * ExactVisit::TestOutline(). */
int test_outline(__global const ulong* body, const uint edges, exact_ray_t* ray) {
  const uint layers = (uint)body[RAY_BODY_LAYERS];
  double along;
  if (body[RAY_BODY_TREE] == ray->tree || ((layers >> ray->layer) & 1) == 0) return 0;
  if (row_passes_by(ray->line, ROW_NUMBER(body[0]), ROW_NUMBER(body[1]), ROW_NUMBER(body[2]),
                    ray->range))
    return 0;
  along =
      row_first_crossing(ray->line, (__global const row_point_t*)(body + RAY_BODY_CORNERS), edges);
  if (ray->has_hit ? !(along < ray->range) : !row_is_within(along, ray->range)) return 0;
  ray->range = along;
  ray->has_hit = 1;
  return 1;
}

/* Tests the outlines of a tile. Returns true if one of them is nearer. */
int test_tile(const outlines_t* outlines, const uint slot, exact_ray_t* ray) {
  uint number = (uint)(outlines->words[slot / 2] >> (slot % 2 * 32));
  int nearer = 0;
  while (number != 0) {
    __global const ulong* const outline =
        outlines->words + outlines->first_outline + (size_t)number * RAY_OUTLINE_WORDS;
    const ulong body = outline[0] & 0xffffffffu;
    nearer |= test_outline(outlines->words + outlines->first_body + (size_t)body * RAY_BODY_WORDS,
                           (uint)(outline[0] >> 32), ray);
    number = (uint)outline[1];
  }
  return nearer;
}

/* Follows the ray until no further cell can hold a nearer crossing. See ExactVisit. */
void follow(item_ray_t* item, const outlines_t* outlines, const double length, exact_ray_t* ray) {
  ray_t* const walk = &item->ray;
  uint tested = 0;
  while (ray_next(&item->grid, &item->mask, walk)) {
    const uint slot = walk->region * 64 + walk->tile;
    double fraction;
    if (slot == tested) continue;
    tested = slot;
    if (!test_tile(outlines, slot, ray)) continue;
    fraction = row_constrain(ray->range / length, 0.0, 1.0);
    walk->limit_x = row_border_limit(fraction, walk->adx, walk->limit_x);
    walk->limit_y = row_border_limit(fraction, walk->ady, walk->limit_y);
    if (row_is_past_limits(walk, walk->u + 1, walk->v) &&
        row_is_past_limits(walk, walk->u, walk->v + 1))
      return;
  }
}

/* Finds ranges of the exact model, like find_cell_ranges(). unit_vectors are the directions in
 * doubles. */
__kernel void find_exact_ranges(
    __global const ray_super_t* directory, const uint directory_mask, __global const uint* regions,
    __global const ulong* words, const int4 box, __global const ray_group_record_t* groups,
    const uint first_group, const uint end_group, __global const ray_fan_record_t* fans,
    __global const ray_direction_t* directions, __global const ulong* masks, const uint first_mask,
    __global const ray_range_record_t* for_ranges, const uint to_range_record,
    __global double* ranges, __global const row_turn_t* unit_vectors,
    __global const ulong* outline_words, const uint first_body, const uint first_outline) {
  item_ray_t item;
  exact_ray_t ray;
  outlines_t outlines;
  row_turn_t heading;
  if (!begin_item(directory, directory_mask, regions, words, box, groups, first_group, end_group,
                  fans, directions, masks, first_mask, &item))
    return;
  const ray_range_record_t record = for_ranges[item.fan + to_range_record];
  heading.sine = ROW_NUMBER(record.sine);
  heading.cosine = ROW_NUMBER(record.cosine);
  ray.line = row_line_from(ROW_NUMBER(record.x), ROW_NUMBER(record.y), heading,
                           unit_vectors[item.direction]);
  ray.tree = record.tree;
  ray.layer = item.layer;
  ray.range = ROW_NUMBER(record.range);
  ray.has_hit = 0;
  outlines.words = outline_words;
  outlines.first_body = first_body;
  outlines.first_outline = first_outline;
  follow(&item, &outlines, ray.range, &ray);
  /* A hit at minus zero would look as if there were none. */
  if (ray.has_hit && (ROW_BITS(ray.range) >> 63) != 0)
    ray.range = unknown_range();
  else if (!ray.has_hit)
    ray.range = -ray.range;
  ranges[item.number] = ray.range;
}
