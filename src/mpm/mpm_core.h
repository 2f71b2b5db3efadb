/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The inside of the MPM core: what its files share. Not for callers.
 *
 * Four-wide records {scalar, x, y, z} carry a scalar field beside a vector field, so that temperature and velocity
 * (heat and force) share each sweep over the nodes; without heat the scalar is 0. */
#ifndef DEMPM_MPM_CORE_H
#define DEMPM_MPM_CORE_H

#include "mpm.h"
#include "mpm_shape.h"

/* Cells and nodes have global integer indices relative to the scene's origin, packed into one key whose order is (z, y,
 * x). 2D: z = 0. */
enum { MPM_KEY_BITS = 21, MPM_KEY_BIAS = 1 << 20 };
#define MPM_KEY_MASK ((UINT64_C(1) << MPM_KEY_BITS) - 1)

/* One line of a list of points that is to be sorted. The cell of a point is the first node of its support. */
typedef struct MpmItem {
  uint64_t cell;
  int64_t tag;
  int index; /* of whatever is sorted: slot, row, foreign point */
} MpmItem;

/* An array of rows. */
typedef struct MpmPlane {
  void **rows;
  void *spare;  /* of the same size, if the rows move */
  size_t width; /* bytes per row */
  int moves;       /* its rows move when points change their order */
  int is_constant; /* no step changes it: if all rows are equal they need not move */
  int is_uniform;  /* they are */
} MpmPlane;
enum { MPM_PLANES_MAX = 40 };

/* Row `from` becomes row `to`. */
typedef struct MpmFetch {
  int to, from;
} MpmFetch;

/* New rows first .. end, whose old places are all further up (down = 1) or further down. */
typedef struct MpmRegion {
  int first, end, down;
} MpmRegion;

/* The core's own state. Rows: own points by (cell, tag), then foreign ones by (cell, tag); they move only when points
 * change their cells. What only heat, tractions and output need stays in the attached array ("home"), where the point
 * of row k has the place slot[k]. Components of tensors are arrays of their own, so that laws run over them in vectors;
 * in 2D those that do not take part are NULL (`volume0` includes F_zz). */
typedef struct MpmPoints {
  MpmPoint *home;     /* [own] borrowed; NULL: nothing attached */
  int own, foreign;   /* of this step */
  int live;           /* own points to work on: own, or 0 after a local error */
  int count;          /* rows to work on: own + foreign, or 0 after a local error */
  int room;           /* capacity of all arrays */
  int has_order;      /* rows 0 .. own are those of slot[] and in the cells of key[] */
  int has_moved;      /* the order of own rows is new since the grid was built */
  int has_stepped;    /* velocity_gradient holds the last step's */
  double mass_low, mass_high; /* of own and foreign points */
  MpmPlane plane[MPM_PLANES_MAX];
  int planes;
  void *block;        /* memory of all planes */
  int uniform_known;  /* is_uniform of the planes is up to date */
  int *slot;          /* own rows */
  uint64_t *key;      /* cell */
  int64_t *tag;
  MpmVec *position;   /* {mass, position}, kg, m */
  MpmVec *place;      /* what P2G and G2P read: position, or the copy from before the update (USL, MUSL) */
  MpmVec *old_position;
  MpmVec *motion;     /* {1, velocity} */
  MpmVec *half;       /* half edges of the uGIMP domain over h; lanes without meaning are 1/2. NULL: not uGIMP */
  int equal_domains;  /* half is the same for all rows */
  MpmVec *force;      /* {0, external force} */
  double *volume0;    /* own rows, as the following */
  double *deformation_gradient[9], *velocity_gradient[9], *stress[6];
  double (*affine)[9]; /* APIC matrix, own and foreign */
  double (*heat)[2];   /* heat capacity m c, J/K; times temperature, J */
  MpmVec *load;        /* [1 + dimension]: {W, N} at the point, then per axis {V q_j, -V sigma_ij} */
  int load_room;
  MpmVec *gathered;    /* XPIC: {1, intermediate velocity} */
  double *carry;       /* slot: scratch for halo->forward */
  MpmVec *cell_value;  /* mpm_volumetric.c: {V, V x, 1, 0}, own and foreign. NULL: no means over cells */
  int *cell_node;      /* of the lowest corner of the cell that the row is in */
  double fastest;      /* m/s, of own points at the last mpm_give_motion(); INFINITY: they moved since */
  double sound;        /* m/s, the largest speed of sound at the last mpm_critical_attached(); INFINITY: none yet */
  int sound_age;       /* steps since */
  unsigned char *moves; /* own rows: leaves its cell */
  int movers_known;     /* `moves` is up to date: G2P has found who leaves */
  int *mover;           /* rows that leave */
  int *source;          /* new row -> old one, in `region`; rows that are fetched: themselves */
  MpmRegion *region;    /* [regions] upwards */
  MpmFetch *fetch;      /* rows that cross others, by new row */
  int regions, fetches;
  int *foreign_slot;    /* foreign row - own -> the halo's order */
  MpmItem *item, *spare_item;
  /* Of laws without `advance`: slot, own points. */
  int batch_room;
  MpmLawBatch batch;
  int64_t *law_tag;
  double *law_velocity_gradient, *law_deformation_gradient, *law_temperature, *law_temperature_rate;
} MpmPoints;

/* Active nodes: those in the support of a point. cells and nodes are sorted by key. Memory is proportional to them, not
 * to the box. */
typedef struct MpmGrid {
  int cells, nodes, cell_room, node_room;
  int is_current;      /* for the present order of points */
  int has_changed;     /* other cells than those that the nodes were built for */
  uint64_t *cell_key, *next_key;
  int *cell_first, *next_first; /* [cells + 1] own rows */
  /* With foreign points: the rows of a cell in the order of tags, as stretches of rows [first, end). */
  int runs, run_room;
  int *run_first;      /* [cells + 1] */
  int (*run)[2];
  int (*cell_row)[9];  /* first node of each row of the support; row = b + width c */
  uint64_t *node_key;
  int has_index, (*index)[3]; /* [nodes], if has_index */
  /* Slabs of MPM_SLAB layers of cells of the outermost axis, by global index; slabs of one colour share no node. */
  int slabs[2], *slab[2]; /* [slabs][2] first cell, end */
  double uniform_scale;   /* kg, of all nodes, or 0 */
  MpmVec *sum;         /* {mass, momentum}, kg and N s */
  double (*heat)[2];   /* {C_I, sum m c T}, J/K and J */
  double *scale;       /* largest mass of a point whose support holds the node, kg */
  int64_t *lowest_tag; /* of the points whose support holds the node */
  unsigned char *owned; /* 1: that point is this rank's own */
  MpmVec *state;       /* {T, v} before the update, walls applied */
  MpmVec *rate;        /* {Q, f}, then {dT/dt, a} */
  MpmVec *term;        /* XPIC: {-, one term of v*} */
  MpmVec *extended;    /* XPIC: {-, v*}, the velocity that G2P gives the points before the acceleration */
  MpmVec *cell_sum;    /* mpm_volumetric.c: {sum V, sum V x, points, 0} of the cell whose lowest corner is the node */
  int *contact_of;     /* [nodes] scratch of the walls */
  /* for mpm_grid_view */
  double *view_mass, *view_velocity, *view_temperature;
  /* scratch of the dilation */
  uint64_t *dilated[2];
  int *position[3][MPM_WIDTH_MAX];
  int dilated_room[2], position_room[3];
} MpmGrid;

/* Work of a pass is shared out in pieces: slabs of either colour or chunks of cells. Every thread has the same part of
 * the rows in all passes, which stay in its cache; who is ready first takes from the others' pieces. */
enum { MPM_SHARE_EVEN, MPM_SHARE_ODD, MPM_SHARE_CHUNKS, MPM_SHARES, MPM_CHUNK = 128 /* cells */ };
typedef struct MpmQueue {
  int first, end; /* pieces of one thread */
  int next;
  char apart[52]; /* each in its own line of the cache */
} MpmQueue;

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
  int row, wall;
  double distance;    /* m, from the surface; < 0: behind a surface of one side */
  double normal[3];   /* towards the point's side */
  double velocity[3]; /* m/s, of the wall here */
  double place[3];    /* m, the point */
} MpmNear;

/* Memory of mpm_wall_facet.c. */
typedef struct MpmWallScratch {
  struct MpmNearest *nearest; /* rows */
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
  double spacing[3];  /* m, present edges of a cell: the scene's times what mpm_set_stretch() said */
  MpmVec per_length;  /* lane 1 + i: 1 / spacing[i]; lane 0: 1 / the scene's spacing */
  int threads; /* OpenMP threads of a pass */
  MpmQueue *queue; /* [MPM_SHARES][threads] */
  double dt;
  double heat_duration; /* s, of mpm_set_heat_duration() */
  int heats;            /* this step finds rates of temperature */
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

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
/* Same bits: no contraction. AVX-512 (v4) for its 32 registers; older compilers do not know the name. */
#if __GNUC__ >= 12
#define MPM_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define MPM_CLONES __attribute__((target_clones("avx2", "default")))
#endif
#else
#define MPM_CLONES
#endif

enum { MPM_PARALLEL_POINTS = 2000 /* fewer: threads cost more than they bring */ };

static inline double mpm_largest_spacing(const Mpm *mpm) {
  const double h = mpm->spacing[0] > mpm->spacing[1] ? mpm->spacing[0] : mpm->spacing[1];
  return h > mpm->spacing[2] ? h : mpm->spacing[2];
}
static inline int mpm_width(const Mpm *mpm) { return mpm_shape_width(mpm->scene.shape); }
static inline int mpm_load_width(const Mpm *mpm) { return 1 + mpm->scene.dimension; }

/* Strain rates and mean stresses are averaged over cells. */
static inline int mpm_averages(const Mpm *mpm) {
  return mpm->scene.volumetric == MPM_VOLUMETRIC_CELL && mpm->scene.mechanical;
}
/* The array of loads is needed where something adds to what stress and external force alone give. */
static inline int mpm_uses_load(const Mpm *mpm) {
  return mpm->halo || mpm->heats || mpm->traction_count > 0 || mpm_averages(mpm);
}
/* The law acts on rows where they lie. */
static inline int mpm_law_is_local(const Mpm *mpm) {
  return mpm->law->advance && !mpm->scene.thermal && !mpm->law->thermal;
}
static inline int mpm_is_parallel(const Mpm *mpm) {
  return mpm->threads > 1 && mpm->points.count > MPM_PARALLEL_POINTS;
}
MPM_INLINE MpmVec mpm_vector_of(int dimension, double first, const double x[3]) {
  return (MpmVec){first, x[0], x[1], dimension == 3 ? x[2] : 0.0};
}
/* Loops over a tensor's components that take part: 9, or the 4 of the plane. */
static inline int mpm_component(int dimension, int n) { return dimension == 3 ? n : n + n / 2; }

/* Remembers a local error (the first one) without leaving the step. */
void mpm_note_error(Mpm *mpm, BaseStatus status);
/* Remembers what is wrong with a point; the lowest tag wins. Thread-safe. */
void mpm_note_point(Mpm *mpm, BaseStatus status, int64_t tag, const char *fault);

/* mpm_step.c */
BaseStatus mpm_forward_rows(Mpm *mpm, MpmVec *vector, double (*tensor)[9]);

/* mpm_points.c */
BaseStatus mpm_points_reserve(Mpm *mpm, int count);
BaseStatus mpm_batch_reserve(Mpm *mpm, int count);
void mpm_points_free(Mpm *mpm);
/* Rows from the attached array; keeps their order if it holds the same points. Notes faults of points. */
BaseStatus mpm_points_attach(Mpm *mpm, MpmPoint *points, int count);
void mpm_points_load_foreign(Mpm *mpm, const MpmPoint *foreign);
void mpm_points_load_heat(Mpm *mpm, const MpmPoint *foreign);
void mpm_points_write(const Mpm *mpm, int what); /* to the attached array */
enum { MPM_WRITE_MOTION = 1 /* position, velocity, affine matrix */, MPM_WRITE_SHAPE = 2 /* F */,
       MPM_WRITE_LAW = 4 /* stress, velocity gradient, answers of a law with `advance` */, MPM_WRITE_ALL = 7 };
void mpm_row_deformation(const Mpm *mpm, int row, double f[9]);
double mpm_row_volume(const Mpm *mpm, int row); /* current, m3 */
/* Half edges over h of a point's uGIMP domain. */
MpmVec mpm_half_edges(const Mpm *mpm, const double size0[3], const double f[9]);
const char *mpm_find_fault(const Mpm *mpm, const MpmPoint *point, BaseStatus *status); /* NULL: none */

/* mpm_sort.c */
void mpm_sort_items(MpmItem **item, MpmItem **spare, int n); /* by (cell, tag); the two may change places */
uint64_t mpm_find_cell(Mpm *mpm, MpmVec position, MpmVec half, int64_t tag); /* 0, and a note, if it is too far away */

/* mpm_order.c */
/* Moves the rows of own points that have left their cells; checks that all are finite. */
BaseStatus mpm_points_order(Mpm *mpm);
void mpm_mark_cell(Mpm *mpm, int cell);      /* sets `moves` of its rows */
void mpm_points_forget_movers(Mpm *mpm);     /* positions or the grid were changed since G2P marked them */

/* mpm_share.c */
void mpm_share_set(Mpm *mpm);                /* who has which pieces, by rows */
void mpm_share_start(Mpm *mpm);              /* before the threads of a pass start */
int mpm_share_next(Mpm *mpm, int kind);      /* a piece for this thread; -1: none is left */

/* mpm_grid.c */
BaseStatus mpm_grid_build(Mpm *mpm); /* cells, slabs, nodes from the rows */
BaseStatus mpm_grid_reserve_cells(MpmGrid *grid, int cells);
void mpm_grid_find_index(Mpm *mpm);
void mpm_grid_free(MpmGrid *grid);

/* mpm_p2g.c: motion, heat -> sum, heat; load, or force and stress -> rate */
void mpm_p2g_momentum(Mpm *mpm, const MpmVec *motion, int with_heat, int with_affine);
void mpm_p2g_load(Mpm *mpm);
void mpm_p2g_load_cells(Mpm *mpm, int first, int end); /* force and stress of some cells, added to rate */

/* mpm_g2p.c */
void mpm_g2p_temperature_gradient(Mpm *mpm);           /* state -> temperature gradient of own points */
void mpm_g2p_velocity_gradient(Mpm *mpm);              /* state -> velocity gradient of own rows */
void mpm_g2p_velocity_gradient_cells(Mpm *mpm, int first, int end);
void mpm_g2p_update(Mpm *mpm);                         /* state, rate -> the points' new velocity, ... */
void mpm_g2p_velocity(Mpm *mpm, const MpmVec *field);  /* field -> gathered */

/* mpm_fused.c */
/* Gradient, local law and, with_load, its load on the nodes, some cells at a time: they stay in the cache. */
void mpm_stress(Mpm *mpm, int with_load);

/* mpm_volumetric.c. Collective */
BaseStatus mpm_volumetric_gradient(Mpm *mpm); /* velocity gradient of own rows: its trace becomes the mean of the cell */
BaseStatus mpm_volumetric_load(Mpm *mpm);     /* load of own rows: as if the mean stress were that of the cell */

/* mpm_xpic.c */
BaseStatus mpm_extended_velocity(Mpm *mpm);                          /* XPIC: state -> extended. Collective */

/* mpm_law_batch.c */
BaseStatus mpm_law_run(Mpm *mpm, double dt); /* the law for own points, from velocity_gradient. Collective */
void mpm_law_rows(Mpm *mpm, int first, int end); /* the same, and F, of a local law for some rows */
void mpm_law_all_rows(Mpm *mpm);                 /* for all own rows */
/* Loads: own points', tractions, flux walls, those of foreign points. Collective. */
BaseStatus mpm_load_fill(Mpm *mpm);

/* mpm_heat.c */
void mpm_heat_start(Mpm *mpm);                                       /* nodal temperature, temperature walls */
void mpm_heat_update(Mpm *mpm);                                      /* rate of nodal temperature, walls' heat flow */
void mpm_heat_walls(Mpm *mpm, MpmVec *load); /* flux walls: heat of the outermost points */
double mpm_heat_source(const Mpm *mpm, int row); /* W, of a point: law, fixes */
void mpm_heat_collect(Mpm *mpm);             /* sources -> heat_waiting, at thermal steps -> heat_power */
void mpm_heat_carry(Mpm *mpm);               /* temperatures by the rates that the last thermal step left */

/* mpm_wall.c */
BaseStatus mpm_wall_find(Mpm *mpm);       /* contacts: the nodes under each wall; zeroes the walls' outputs */
void mpm_wall_start(Mpm *mpm);            /* kinematic condition on the nodal velocity before the update */
void mpm_wall_update(Mpm *mpm);           /* impulses on the updated velocity; the walls' outputs */
void mpm_wall_guard(Mpm *mpm); /* points that would come too close to a surface are held */
void mpm_wall_free(Mpm *mpm);
BaseStatus mpm_wall_add(Mpm *mpm, int node, int wall, const double normal[3], const double velocity[3]);

/* mpm_wall_shape.c: planes and boxes */
int mpm_wall_is_under(const Mpm *mpm, const MpmWall *wall, int node, double normal[3]);
double mpm_wall_distance(const MpmWall *wall, int dimension, const double x[3], double normal[3]);
int mpm_wall_in_range(const MpmWall *wall, int dimension, const double x[3], double tolerance);
void mpm_node_place(const Mpm *mpm, int node, double x[3]);
/* The face of the point's domain, deformed by f, that looks most along the normal: area vector, m2, and its projection
 * on the normal. */
double mpm_face_area(const MpmPoint *point, const double f[9], const double normal[3], double area[3]);

/* mpm_wall_facet.c: surfaces */
BaseStatus mpm_surface_find(Mpm *mpm, int wall);

/* mpm_traction.c */
void mpm_traction_add(Mpm *mpm, MpmVec *load);

#endif
