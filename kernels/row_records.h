/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Data of closed worlds on a device: the scene as records, and the columns of all worlds. See
 * libstage/rows/scene.hh and libstage/rows/rows.hh, which explain the members. Like ray_walk.h,
 * this file is C++ for libstage and OpenCL C 1.1 for devices, where it is compiled after
 * ray_walk.h.
 *
 * The image of a scene is one buffer: a row_scene_t, then its parts. The columns of all worlds are
 * one buffer too, the state. Offsets are in bytes. Doubles are needed, so devices without them
 * cannot step rows.
 */
#ifndef STAGE_KERNELS_ROW_RECORDS_H
#define STAGE_KERNELS_ROW_RECORDS_H

#ifdef RAY_IN_OPENCL
#if !defined(__OPENCL_C_VERSION__) || __OPENCL_C_VERSION__ < 120
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif
/* Products and sums are rounded separately, as on the host. */
#pragma OPENCL FP_CONTRACT OFF
typedef uchar row_byte;
typedef ushort row_short;
#else
#include "kernels/ray_walk.h"
namespace Stg {
typedef uint8_t row_byte;
typedef uint16_t row_short;
#endif

#define ROW_NONE 0xffffffffu /* no index */
#define ROW_GROUP 32u        /* rivals in a group */
#define ROW_ALIGNMENT 64u    /* bytes; columns and parts begin at multiples of it */

/* The columns that a device has, in the order of libstage/rows/rows.cc. */
enum {
  ROW_SEED,
  ROW_TIME,
  ROW_NEXT_UPDATE,
  ROW_LAST_UPDATE,
  ROW_STEPS,
  ROW_EXTENT,
  ROW_STAMPS,
  ROW_POSE,
  ROW_TURN,
  ROW_VELOCITY,
  ROW_COMMAND,
  ROW_SENSED,
  ROW_MODE,
  ROW_STALLED,
  ROW_WATTS,
  ROW_STEERING,
  ROW_STORED,
  ROW_DISSIPATED,
  ROW_ENERGY,
  ROW_ESTIMATE,
  ROW_DRIVEN,
  ROW_ERROR,
  ROW_NOISY_ODOMETRY,
  ROW_RANDOM,
  ROW_MEMORY,
  ROW_BOX,
  ROW_STAMP,
  ROW_BITS,
  ROW_NOISE,
  ROW_RANGES,
  ROW_BRIGHTNESS,
  ROW_MADE,
  ROW_HINDERED,
  ROW_BEFORE,
  ROW_VARIED,
  ROW_PROPERTIES,  /* row_properties_t by mover, if they differ between worlds */
  ROW_RANGE_NOISE, /* row_range_noise_t by sensor, likewise */
  ROW_COLUMNS      /* their number */
};

/* The parts of an image. */
enum {
  ROW_MOVERS,
  ROW_NODES,
  ROW_LINKS,
  ROW_BODIES,
  ROW_CORNERS, /* row_point_t of all bodies, in the frames of their nodes */
  ROW_RIVALS,  /* indices of bodies; those of each body begin at a multiple of ROW_GROUP */
  ROW_GROUPS,  /* by ROW_GROUP rivals: index of the body that they are rivals of */
  ROW_SENSORS,
  ROW_OTHERS,       /* indices of bodies */
  ROW_SENSOR_OF,    /* by ray */
  ROW_BEARINGS,     /* by ray, rad; of sensors that turn noisily */
  ROW_DIRECTIONS,   /* ray_direction_t */
  ROW_UNIT_VECTORS, /* row_turn_t, with the same indices */
  ROW_CONSUMERS,
  ROW_CONTROLLED, /* row_driven_t, see row_control.h */
  ROW_CONTROLS,   /* row_control_t */
  ROW_POSITIONS,  /* movers that are robots, if controllers need their poses */
  ROW_LAYOUTS,    /* row_layout_t, each with its parts */
  ROW_LOOK_OF,    /* by look: index of its control */
  ROW_MAPS,
  ROW_VIEWS,
  ROW_WALLS,
  ROW_FRAGMENTS,
  ROW_WALL_CORNERS, /* row_point_t, m, of what stands, for exact rays */
  ROW_DIRECTORY,    /* of the grid of what stands, see ray_grid_t */
  ROW_REGIONS,
  ROW_REGION_MAPS,
  ROW_TOUCHERS,      /* row_toucher_t: what contacts of outlines move */
  ROW_PIECES,        /* row_piece_t */
  ROW_TOUCH_CORNERS, /* row_point_t of pieces, in the frame of the mover */
  ROW_EDGES,         /* row_edge_t of what stands, for contacts of outlines */
  ROW_EDGE_STARTS,   /* by cell of the index of edges: its first entry; see motion::Walls */
  ROW_EDGE_ENTRIES,  /* indices of edges */
  ROW_START,         /* the columns of one world in its state after loading */
  ROW_PARTS          /* their number */
};

/* Memory of one world during a step, which holds nothing between steps. */
enum {
  ROW_FANS,           /* row_fan_t by sensor */
  ROW_OWN_RAYS,       /* row_own_ray_t by ray, if a sensor turns noisily */
  ROW_POINTS,         /* row_point_t of all bodies, closed, m, if a sensor is exact */
  ROW_WANTED,         /* row_wanted_t by mover */
  ROW_CELLS,          /* row_cell_t by corner: the outlines at the wanted places */
  ROW_DRAWN,          /* row_drawn_t by body */
  ROW_OVERLAPS,       /* row_overlaps_t by group of rivals */
  ROW_DRAWN_BITS,     /* as ROW_BITS */
  ROW_LOOKS,          /* row_look_t of controls */
  ROW_ALL_POSES,      /* row_planar_t by robot */
  ROW_ALL_VELOCITIES, /* row_planar_t by robot, global, if controllers need them */
  ROW_CONTACTS,       /* row_contact_t by toucher */
  ROW_NEAR_BITS,      /* by toucher: a bit for each toucher after it that it may touch */
  ROW_MEMBERS,        /* touchers, by island */
  ROW_ISLANDS,        /* row_island_t */
  ROW_SCRATCHES       /* their number */
};

typedef struct {
  double sine, cosine;
} row_turn_t;

typedef struct {
  double x, y;
} row_point_t;

/* A pose, velocity or command in the plane. */
typedef struct {
  double x, y, a;
} row_planar_t;

/* A pose with the sine and cosine of its heading. */
typedef struct {
  double x, y, a;
  row_turn_t turn;
} row_placed_t;

typedef struct {
  double min, max;
} row_bounds_t;

typedef struct {
  int x, y;
} row_cell_t;

typedef struct RAY_ALIGNED(16) {
  int x, y, width, height;
} row_box_t;

typedef struct RAY_ALIGNED(16) {
  int min_x, min_y, max_x, max_y;
} row_extent_t;

typedef struct {
  ray_ulong state[4];
} row_random_t;

typedef struct {
  double stored, capacity, dissipated, input;
} row_energy_t;

typedef struct {
  double xx, xy, yy, xa, ya, aa;
} row_covariance_t;

/* See NoisyOdometry. */
typedef struct {
  double translation_per_metre, translation_per_radian, heading_per_radian, heading_per_metre;
  row_covariance_t covariance, driven_covariance;
  double twist_error[4]; /* x, y, z, turn */
} row_noisy_odometry_t;

/* Drives. Without one, a mover neither drives nor moves. */
enum { ROW_NO_DRIVE, ROW_DIFFERENTIAL, ROW_OMNI, ROW_CAR };
/* Modes of commands, as in DriveInput. */
enum { ROW_ACCELERATION_MODE, ROW_VELOCITY_MODE, ROW_POSITION_MODE };
/* Bits of row_mover_t::flags. */
#define ROW_HAS_ODOMETRY 1u
#define ROW_HAS_NOISY_ODOMETRY 2u
#define ROW_OBEYS_VELOCITY 4u
#define ROW_COMMANDS_TURN 8u
#define ROW_LIMITS_ACCELERATION 16u

/* See MoverProperties, which has the same layout. Bounds are those of x, y, z and turn. */
#define ROW_TURN_AXIS 3
typedef struct {
  double mass, friction, floor_friction, grip;
  double wheel_slip, wheelbase, steering_limit, steering_rate;
  row_bounds_t velocity[4], acceleration[4];
} row_properties_t;

typedef struct RAY_ALIGNED(16) {
  ray_uint drive, flags;
  ray_uint pack; /* ROW_NONE: it never stops for lack of energy */
  ray_uint first_body, bodies;
  ray_uint unused[3];
  row_properties_t properties; /* in worlds whose properties do not differ, see row_properties() */
} row_mover_t;

/* A node: its frame is the sum of its mover's pose and of its links. */
typedef struct {
  ray_uint first_link, end_link;
} row_node_t;

/* Bits of row_body_t::flags. */
#define ROW_OBSTACLE 1u
#define ROW_BELOW_FLOOR 2u

typedef struct RAY_ALIGNED(16) {
  ray_uint mover, node;
  ray_uint flags;
  ray_uint first_corner, corners;
  ray_uint first_point, first_byte;
  ray_uint blocked; /* index of a map */
  ray_uint first_rival, rivals;
  ray_uint brightness;
  ray_uint model; /* its id */
  ray_ulong loading_stamp;
  double radius;
} row_body_t;

/* Bits of row_sensor_t::flags. */
#define ROW_EXACT 1u
#define ROW_NOISY 2u
#define ROW_TURNS_NOISILY 4u
#define ROW_BLIND_NEAR 8u

/* See RangeNoise, which has the same layout. */
typedef struct {
  double variance, fraction, angle;
} row_range_noise_t;

typedef struct RAY_ALIGNED(16) {
  ray_uint mover, node; /* the node's frame is the start of the rays */
  ray_uint flags;
  ray_uint first_ray, rays, first_direction;
  ray_uint view; /* what stands, for its rays */
  ray_uint seen; /* index of a map */
  ray_uint first_other, others;
  double reach, leg_cells;
  double turn_noise;           /* rad: largest error of a ray's heading; see row_turn_noise() */
  double fraction, deviation;  /* of the noise of ranges, see row_noise_of() */
  double min_range, max_range; /* limits of ranges with noise */
  double increment;            /* rad, between rays */
  double step, loss, least_cosine2, sine, cosine; /* see RangeDefects */
} row_sensor_t;

typedef struct RAY_ALIGNED(16) {
  ray_uint pack, mover; /* ROW_NONE: `watts` */
  double watts;
} row_consumer_t;

/* See CellMap. */
typedef struct RAY_ALIGNED(16) {
  int x, y, width, height;   /* in tiles */
  ray_ulong distances, bits; /* offsets in the image */
  ray_ulong words;           /* of a row of cells */
  ray_ulong unused;
} row_map_t;

/* Standing bodies at the height of some rays: a layer of the grid without cells that the rays pass.
 */
typedef struct RAY_ALIGNED(16) {
  ray_ulong tile_maps, tiles; /* offsets in the image */
  /* By tile: index in ROW_WALLS of what its cells show, or ROW_SEVERAL | index in `lists` of 64
   * such indices. Exact rays: index of the tile's first fragment, or ROW_NONE. */
  ray_ulong of_tiles;
  ray_ulong lists;
} row_view_t;
#define ROW_SEVERAL 0x80000000u

/* A standing body that rays meet in a cell. */
typedef struct RAY_ALIGNED(16) {
  ray_ulong key; /* orders bodies in a cell; the first one is hit */
  ray_uint brightness;
  ray_uint unused;
} row_wall_t;

/* Edges of what stands in a tile, for exact rays; see grid::OutlineFragment and grid::Body. */
typedef struct RAY_ALIGNED(16) {
  double x, y, radius;
  ray_uint first_corner; /* in ROW_WALL_CORNERS */
  ray_uint edges;        /* bit i: from corner i to corner i + 1 */
  ray_uint number;       /* of the body */
  ray_uint model;        /* its id */
  ray_uint brightness;
  ray_uint next; /* in ROW_FRAGMENTS; ROW_NONE: it is the last */
} row_fragment_t;

/* Bits of row_toucher_t::flags. */
#define ROW_IS_ROBOT 1u
#define ROW_IS_PUSHED 2u
#define ROW_IS_PUSHABLE 4u
#define ROW_IS_IN_FLOOR 8u

/* A mover in contacts of outlines: its shape, and what does not change in motion::Columns. */
typedef struct RAY_ALIGNED(16) {
  ray_uint mover, flags;
  ray_uint first_piece, pieces;
  ray_uint first_corner, corners;
  ray_uint unused[2];
  double core, bound, grip, arm, friction, elevation;
} row_toucher_t;

/* See motion::Piece. */
typedef struct RAY_ALIGNED(16) {
  ray_uint corners, unused[3];
  double radius, core, bottom, top;
} row_piece_t;

/* See motion::WallEdge. */
typedef struct RAY_ALIGNED(16) {
  row_point_t ends[2], beyond[2];
  double bottom, top, friction, unused;
} row_edge_t;

/* Islands that wait to be solved, by the memory and the time that this takes. Small islands are
 * solved in the private memory of a work-item, large ones in the room of their world. Small ones
 * are begun first, and become slow ones if they take long. */
enum {
  ROW_SMALL, /* several bodies */
  ROW_SMALLER,
  ROW_SMALLEST,
  ROW_SLOW,
  ROW_LARGE,
  ROW_ISLAND_KINDS /* their number */
};
#define ROW_SMALL_KINDS ((1u << ROW_SMALL) | (1u << ROW_SMALLER) | (1u << ROW_SMALLEST))

/* Limits of small islands: bodies, corners of all bodies, pairs of pieces, corners of two pieces.
 */
#define ROW_SMALL_SOLIDS 6u
#define ROW_SMALL_CORNERS 48u
#define ROW_SMALL_PAIRS 16u
#define ROW_SMALL_MOVED 32u

/* An island that waits to be solved. ROW_ALL_OF | n: all n islands of that world, which take turns
 * with those of other worlds in the shared room. */
typedef struct {
  ray_uint world, island;
} row_waiting_t;
#define ROW_ALL_OF 0x80000000u

/* Memory for the contacts of a world: offsets of arrays, and numbers of their elements. */
typedef struct RAY_ALIGNED(16) {
  ray_ulong near, walls, solids, corners, moved, pairs, touches;
  ray_ulong bytes;
  ray_uint most_near, most_walls, most_pairs;
  ray_uint unused;
} row_room_t;

/* The index of edges by place, see motion::Walls. */
typedef struct RAY_ALIGNED(16) {
  double x0, y0, x1, y1; /* box of all edges */
  double cell;
  int columns, rows;
  ray_uint edges;
  ray_uint unused[3];
} row_edge_index_t;

typedef struct RAY_ALIGNED(16) {
  row_edge_index_t edges;
  row_room_t rooms[2];              /* of each world, and one that all worlds share */
  ray_ulong columns[ROW_COLUMNS];   /* offset in the state of a column, of all worlds */
  ray_ulong row_bytes[ROW_COLUMNS]; /* bytes of a world in a column */
  ray_ulong starts[ROW_COLUMNS];    /* offset in ROW_START of a column */
  ray_ulong parts[ROW_PARTS];       /* offset in the image */
  ray_ulong scratch[ROW_SCRATCHES]; /* offset in the memory of a world */
  ray_ulong scratch_bytes;          /* of a world */
  ray_ulong kept; /* columns, as bits, that stay in resets of worlds that keep their seeds */
  ray_ulong step, interval; /* durations of a step and between updates, microseconds */
  double cells_per_metre, seconds;
  ray_uint movers, bodies, sensors, rays, packs, consumers, bytes;
  ray_uint groups; /* of rivals */
  ray_uint driven, controls, looks, positions;
  ray_uint narrow;     /* outlines have NarrowWord rows, otherwise WideWord */
  ray_uint any_exact;  /* among the sensors */
  ray_uint any_noise;  /* of ranges */
  ray_uint needs_rays; /* readings change a step: they have noise, or a controller reads them */
  ray_uint directory_mask;
  ray_uint varies_movers;         /* properties differ between worlds, see ROW_PROPERTIES */
  ray_uint varies_noise;          /* noise of ranges does, see ROW_RANGE_NOISE */
  ray_uint needs_velocities;      /* controllers need those of all robots */
  int min_x, min_y, max_x, max_y; /* box of what stands */
  /* Contacts of outlines. */
  ray_ulong first_room;            /* offset of the worlds' rooms in the scratch memory */
  ray_ulong shared_room;           /* offset there of the room that all worlds share */
  ray_ulong waiting;               /* offset there of row_waiting_t, by kind of island */
  ray_ulong lock;                  /* offset in the state: whether a world uses the shared room */
  ray_ulong counts;                /* offset there of the numbers of waiting islands, by kind */
  ray_uint most_waiting;           /* of a kind */
  ray_uint outlines;               /* contacts are those of outlines, otherwise of cells */
  ray_uint touchers, most_corners; /* corners: of a toucher */
  ray_uint most_moved;             /* corners of a piece, if they are moved on trial */
  ray_uint unused;
} row_scene_t;

/* The fan of a sensor in a step. */
typedef struct RAY_ALIGNED(16) {
  int x, y;             /* start cell */
  ray_uint fraction;    /* as in ray_fan_record_t */
  int cosine, sine;     /* heading times length, Q16 cells */
  ray_uint nothing;     /* it casts no rays */
  ray_uint meets_walls; /* something that stands may be within reach */
  ray_uint unused;
  double start_x, start_y; /* m */
  row_turn_t heading;
} row_fan_t;

typedef struct RAY_ALIGNED(16) {
  row_turn_t unit_vector;
  int cosine, sine; /* Q30 */
  ray_uint unused[2];
} row_own_ray_t;

typedef struct RAY_ALIGNED(16) {
  row_placed_t place;
  ray_uint asked;    /* the mover wants to move; after contacts of outlines: it has moved */
  ray_uint collides; /* there */
} row_wanted_t;

typedef struct RAY_ALIGNED(16) {
  row_box_t box;
  ray_uint moved; /* its cells are not those that it has */
  ray_uint unused;
  ray_ulong stamp; /* of its rasterization; 0: it stays where it is */
} row_drawn_t;

/* Bit i: the drawn body overlaps rival i of the group where that was before the step, and where it
 * has been drawn. */
typedef struct {
  ray_uint before, drawn;
} row_overlaps_t;

/* How elements of an array for other programs come from a column. */
enum {
  ROW_NUMBERS,   /* doubles */
  ROW_FLAGS,     /* bytes: 0 or 1 */
  ROW_SECONDS,   /* doubles, from microseconds */
  ROW_LOOKED_UP, /* doubles: values[byte] */
  ROW_ACTUAL,    /* doubles, three by mover: those of its last move, from wanted ones */
  ROW_COMMANDS   /* doubles, three by mover, which are written to the column */
};

/* Worlds that a kernel of arrays concerns. */
enum { ROW_ALL_WORLDS, ROW_LISTED_WORLDS, ROW_FLAGGED_WORLDS };

/* An element of a world's part of an array, and the place of its number in the world's part of the
 * column. Commands: number of the robot, and of the mover. */
typedef struct {
  ray_uint element, place;
} row_entry_t;

/* Entries of an array that come from one column. */
typedef struct {
  ray_uint kind, column;
  ray_uint elements;    /* of a world in the array; commands: its robots */
  ray_uint of_readings; /* doubles are NaN as long as the world has no readings */
} row_array_t;

/* A command to a robot of one world. */
typedef struct {
  row_planar_t command;
  ray_uint world, mover;
  ray_uint mode; /* ROW_..._MODE */
  ray_uint unused;
} row_given_t;

/* OpenCL C 1.1 has no static assertions. */
typedef char row_placed_has_40_bytes[sizeof(row_placed_t) == 40 ? 1 : -1];
typedef char row_mover_has_224_bytes[sizeof(row_mover_t) == 224 ? 1 : -1];
typedef char row_properties_has_192_bytes[sizeof(row_properties_t) == 192 ? 1 : -1];
typedef char row_body_has_64_bytes[sizeof(row_body_t) == 64 ? 1 : -1];
typedef char row_sensor_has_144_bytes[sizeof(row_sensor_t) == 144 ? 1 : -1];
typedef char row_own_ray_has_32_bytes[sizeof(row_own_ray_t) == 32 ? 1 : -1];
typedef char row_fan_has_64_bytes[sizeof(row_fan_t) == 64 ? 1 : -1];
typedef char row_wanted_has_48_bytes[sizeof(row_wanted_t) == 48 ? 1 : -1];
typedef char row_drawn_has_32_bytes[sizeof(row_drawn_t) == 32 ? 1 : -1];

typedef char row_scene_has_1712_bytes[sizeof(row_scene_t) == 1712 ? 1 : -1];
typedef char row_toucher_has_80_bytes[sizeof(row_toucher_t) == 80 ? 1 : -1];
typedef char row_piece_has_48_bytes[sizeof(row_piece_t) == 48 ? 1 : -1];
typedef char row_edge_has_96_bytes[sizeof(row_edge_t) == 96 ? 1 : -1];
typedef char row_room_has_80_bytes[sizeof(row_room_t) == 80 ? 1 : -1];
typedef char row_map_has_48_bytes[sizeof(row_map_t) == 48 ? 1 : -1];
typedef char row_view_has_32_bytes[sizeof(row_view_t) == 32 ? 1 : -1];
typedef char row_fragment_has_48_bytes[sizeof(row_fragment_t) == 48 ? 1 : -1];
typedef char row_given_has_40_bytes[sizeof(row_given_t) == 40 ? 1 : -1];
typedef char row_noisy_odometry_has_160_bytes[sizeof(row_noisy_odometry_t) == 160 ? 1 : -1];

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
