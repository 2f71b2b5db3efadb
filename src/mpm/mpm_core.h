/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The inside of the MPM core: what its files share. Not for callers.
 *
 * Four-wide records {scalar, x, y, z} carry a scalar field beside a vector field, so that temperature and velocity
 * (heat and force) share each sweep over the nodes; without heat the scalar is 0. */
#ifndef DEMPM_MPM_CORE_H
#define DEMPM_MPM_CORE_H

#include "mpm.h"
#include "mpm_shape.h"

typedef double MpmVec __attribute__((vector_size(32))); /* {scalar, x, y, z} */

/* Cells and nodes have global integer indices relative to the scene's origin, packed into one key whose order is (z, y,
 * x). 2D: z = 0. */
enum { MPM_KEY_BITS = 21, MPM_KEY_BIAS = 1 << 20 };
#define MPM_KEY_MASK ((UINT64_C(1) << MPM_KEY_BITS) - 1)

/* One line of the sorted list of points. The cell of a point is the first node of its support. */
typedef struct MpmItem {
  uint64_t cell;
  int64_t tag;
  int slot; /* own points in the caller's order, then foreign ones in the halo's */
} MpmItem;

/* The core's copy of the points. "sorted" arrays follow (cell, tag), "slot" arrays the caller's order. */
typedef struct MpmPoints {
  int own, foreign;   /* of this step */
  int live;           /* own points to work on: own, or 0 after a local error */
  int count;          /* sorted points: own + foreign, or 0 after a local error */
  int items, items_own; /* of the last sorted list: its length and its number of own slots */
  int room;           /* capacity of all arrays */
  MpmItem *item, *spare, *mover;
  uint64_t *cell;        /* slot */
  unsigned char *placed; /* slot: found at its old place */
  double (*place)[4];    /* sorted: x, y, z over h relative to origin; mass, kg */
  MpmVec *motion;        /* sorted: {1, velocity} */
  double (*half)[3];     /* sorted: half edges of the uGIMP domain over h */
  double (*affine)[9];   /* sorted: APIC matrix */
  double (*heat)[2];     /* sorted: heat capacity m c, J/K; times temperature, J */
  MpmVec *load;          /* slot: [1 + dimension]: {W, N} at the point, then per axis {V q_j, -V sigma_ij} */
  double *carry;         /* slot: [12] scratch for halo->forward */
  MpmVec *gathered;      /* sorted: XPIC's intermediate velocities */
  MpmLawBatch batch;     /* slot, own points */
  int64_t *law_tag;
  double *law_velocity_gradient, *law_deformation_gradient, *law_temperature, *law_temperature_rate;
} MpmPoints;

/* Active nodes: those in the support of a point. cells and nodes are sorted by key. Memory is proportional to them, not
 * to the box. */
typedef struct MpmGrid {
  int cells, nodes, cell_room, node_room;
  int ranges, range_room;
  uint64_t *cell_key;
  int *cell_first;     /* [cells + 1] in the sorted points */
  int (*cell_row)[9];  /* first node of each row of the support; row = b + width c */
  uint64_t *node_key;
  int (*index)[3];     /* [nodes] */
  /* Slabs of MPM_SLAB layers of cells of the outermost axis, by global index; slabs of one colour share no node. */
  int slabs[2], *slab[2]; /* [slabs][2] first cell, end */
  MpmVec *sum;         /* {mass, momentum}, kg and N s */
  double (*heat)[2];   /* {C_I, sum m c T}, J/K and J */
  double *scale;       /* largest mass of a point whose support holds the node, kg */
  int64_t *lowest_tag; /* of the points whose support holds the node */
  unsigned char *owned; /* 1: that point is this rank's own */
  MpmVec *state;       /* {T, v} before the update, walls applied */
  MpmVec *rate;        /* {Q, f}, then {dT/dt, a} */
  MpmVec *term;        /* XPIC: {-, one term of v*} */
  MpmVec *extended;    /* XPIC: {-, v*}, the velocity that G2P gives the points before the acceleration */
  int *contact_of;     /* [nodes] scratch of the walls */
  /* for mpm_grid_view */
  double *view_mass, *view_velocity, *view_temperature;
  /* scratch of the dilation */
  uint64_t *dilated[2];
  int *position[3][MPM_WIDTH_MAX];
  int dilated_room[2], position_room[3];
} MpmGrid;

/* A node under a wall's condition. */
typedef struct MpmContact {
  int node, wall;
  int is_first;     /* of its node */
  double normal[3]; /* into the body */
  double velocity[3]; /* m/s, of the wall here */
  double start[3];  /* m/s, change of the nodal velocity before the update */
  double change[3]; /* m/s, change of the nodal velocity by this wall's impulse in the update */
} MpmContact;

/* An own point next to a surface, as it was when the step began. */
typedef struct MpmNear {
  int slot, wall;
  double distance;    /* m, from the surface; < 0: behind a surface of one side */
  double normal[3];   /* towards the point's side */
  double velocity[3]; /* m/s, of the wall here */
  double place[3];    /* m, the point */
} MpmNear;

/* Memory of mpm_wall_facet.c. */
typedef struct MpmWallScratch {
  struct MpmNearest *nearest; /* sorted points */
  double (*side_mass)[2];     /* nodes: kg of points in front of and behind the surface */
  struct MpmCandidate *candidate;
  int nearest_room, node_room, candidates, candidate_room;
  MpmNear *near;
  int nears, near_room;
} MpmWallScratch;

struct Mpm {
  MpmScene scene;
  const MpmLaw *law;
  const MpmHalo *halo;
  MpmWall *walls;
  int wall_count;
  MpmTraction *tractions;
  int traction_count;
  double inverse_spacing;
  int threads; /* OpenMP threads of a pass */
  double dt;
  const MpmPoint *foreign_points;
  MpmPoints points;
  MpmGrid grid;
  MpmContact *contacts;
  int contact_count, contact_room;
  int has_corners; /* some node is under several walls */
  MpmWallScratch wall_scratch;
  int state_is_new; /* state holds the updated velocity and temperature */
  /* The first local error of a step; kept to its end because the callbacks are collective. */
  BaseStatus status;
  char message[512];
  BaseStatus point_status; /* of the point with the lowest tag among those in error */
  int64_t point_tag;       /* INT64_MAX: none */
  const char *point_fault;
};

enum { MPM_PARALLEL_POINTS = 2000 /* fewer: threads cost more than they bring */ };

static inline int mpm_width(const Mpm *mpm) { return mpm_shape_width(mpm->scene.shape); }
static inline int mpm_load_width(const Mpm *mpm) { return 1 + mpm->scene.dimension; }

static inline const MpmPoint *mpm_slot_point(const Mpm *mpm, const MpmPoint *own, int slot) {
  return slot < mpm->points.own ? own + slot : mpm->foreign_points + (slot - mpm->points.own);
}

/* Remembers a local error (the first one) without leaving the step. */
void mpm_note_error(Mpm *mpm, BaseStatus status);
/* Remembers what is wrong with a point; the lowest tag wins. Thread-safe. */
void mpm_note_point(Mpm *mpm, BaseStatus status, int64_t tag, const char *fault);

/* mpm_points.c */
BaseStatus mpm_points_reserve(Mpm *mpm, int count);
void mpm_points_free(Mpm *mpm);
BaseStatus mpm_points_sort(Mpm *mpm, const MpmPoint *own); /* fills item[] by (cell, tag) */
void mpm_points_load(Mpm *mpm, const MpmPoint *own);       /* fills the sorted arrays */

/* mpm_grid.c */
BaseStatus mpm_grid_build(Mpm *mpm); /* cells, slabs, nodes from the sorted points */
void mpm_grid_free(MpmGrid *grid);

/* mpm_transfer.c */
enum { MPM_GRADIENT_VELOCITY = 1, MPM_GRADIENT_TEMPERATURE = 2 };
void mpm_p2g_momentum(Mpm *mpm, int with_heat, int with_affine);     /* motion, heat -> sum, heat, scale, owned */
void mpm_p2g_load(Mpm *mpm);                                         /* load -> rate */
void mpm_g2p_gradient(Mpm *mpm, MpmPoint *points, int what);         /* state -> velocity, temperature gradient */
void mpm_g2p_update(Mpm *mpm, MpmPoint *points);                     /* state, rate -> the points' new velocity, ... */
void mpm_g2p_velocity(Mpm *mpm, const MpmVec *field);                /* field -> gathered */

/* mpm_xpic.c */
BaseStatus mpm_extended_velocity(Mpm *mpm);                          /* XPIC: state -> extended. Collective */

/* mpm_law_batch.c */
/* The law for own points; with_load also fills their loads, while the points are in the cache. Collective. */
BaseStatus mpm_law_run(Mpm *mpm, MpmPoint *points, double dt, int with_load);
void mpm_load_fill(Mpm *mpm, const MpmPoint *points);         /* loads of own points */
/* Tractions, flux walls, loads of foreign points. Collective. */
BaseStatus mpm_load_finish(Mpm *mpm, const MpmPoint *points);

/* mpm_heat.c */
void mpm_heat_start(Mpm *mpm);                                       /* nodal temperature, temperature walls */
void mpm_heat_update(Mpm *mpm);                                      /* rate of nodal temperature, walls' heat flow */
void mpm_heat_walls(Mpm *mpm, const MpmPoint *points, MpmVec *load); /* flux walls: heat of the outermost points */

/* mpm_wall.c */
BaseStatus mpm_wall_find(Mpm *mpm);       /* contacts: the nodes under each wall; zeroes the walls' outputs */
void mpm_wall_start(Mpm *mpm);            /* kinematic condition on the nodal velocity before the update */
void mpm_wall_update(Mpm *mpm);           /* impulses on the updated velocity; the walls' outputs */
void mpm_wall_guard(Mpm *mpm, MpmPoint *points); /* points that would come too close to a surface are held */
void mpm_wall_free(Mpm *mpm);
BaseStatus mpm_wall_add(Mpm *mpm, int node, int wall, const double normal[3], const double velocity[3]);

/* mpm_wall_shape.c: planes and boxes */
int mpm_wall_is_under(const Mpm *mpm, const MpmWall *wall, int node, double normal[3]);
double mpm_wall_distance(const MpmWall *wall, int dimension, const double x[3], double normal[3]);
int mpm_wall_in_range(const MpmWall *wall, int dimension, const double x[3], double tolerance);
void mpm_node_place(const Mpm *mpm, int node, double x[3]);
/* The face of the point's deformed domain that looks most along the normal: area vector, m2, and its projection on the
 * normal. */
double mpm_face_area(const MpmPoint *point, const double normal[3], double area[3]);

/* mpm_wall_facet.c: surfaces */
BaseStatus mpm_surface_find(Mpm *mpm, int wall);

/* mpm_traction.c */
void mpm_traction_add(Mpm *mpm, const MpmPoint *points, MpmVec *load);

#endif
