/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The kernels that solve islands of closed worlds with contacts of outlines, in OpenCL C 1.1. They
 * are two programs from the same text, for small and for large islands, see row_solve.h.
 *
 * image, state, scratch: as in row_step.cl. items: number of work-items.
 * kinds: of the islands to solve, a bit for each: ROW_SMALL_KINDS, or only slow or large ones.
 */
__kernel void solve_islands(__global const ulong* image, __global ulong* state,
                            __global ulong* scratch, const uint items, const uint kinds) {
  const row_world_t first = row_world_at((__global const row_byte*)image, (__global row_byte*)state,
                                         (__global row_byte*)scratch, 0);
  const uint size = (uint)get_local_size(0), groups = items / size;
  const uint place = (uint)get_local_id(0), group = (uint)get_group_id(0);
  /* A few islands are spread over all groups, because work-items of a group that do different
   * things wait for each other. Then none is given up. */
  const int few = row_count_waiting(&first, kinds) <= 4 * groups;
  const uint item = few ? place * groups + group : group * size + place;
#ifdef ROW_SOLVES_LARGE
  row_solve_large_islands(&first, item, items);
#else
  row_solve_small_islands(&first, kinds, !few && kinds == ROW_SMALL_KINDS, item, items);
#endif
}
