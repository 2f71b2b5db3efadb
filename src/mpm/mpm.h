/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The material point method core: points, background grid, transfers, walls, step order. One source for 2D and 3D.
 *
 * Determinism. Every sum over points at a node runs in the order (cell, tag), whatever the order of the caller's
 * arrays, the number of threads or of ranks: a rank holds copies ("halo points") of all foreign points that share a
 * node with one of its own, so each node it needs is summed completely, in the same order as on every other rank. Grid
 * fields are then equal bit for bit. */
#ifndef DEMPM_MPM_H
#define DEMPM_MPM_H

#include "mpm_law.h"

#ifdef __cplusplus
extern "C" {
#endif

/* GIMP = uGIMP; BSPLINE: quadratic. */
typedef enum MpmShape { MPM_SHAPE_LINEAR, MPM_SHAPE_GIMP, MPM_SHAPE_BSPLINE } MpmShape;
/* FLIP blends PIC by pic_fraction. */
typedef enum MpmTransfer { MPM_TRANSFER_FLIP, MPM_TRANSFER_APIC, MPM_TRANSFER_XPIC } MpmTransfer;
typedef enum MpmOrder { MPM_ORDER_USF, MPM_ORDER_USL, MPM_ORDER_MUSL } MpmOrder;
/* Whose volumetric strain rate the law sees: the point's own, or the mean over the points of its cell. */
typedef enum MpmVolumetric { MPM_VOLUMETRIC_POINT, MPM_VOLUMETRIC_CELL } MpmVolumetric;

typedef struct MpmScene {
  int dimension;          /* 2 or 3 */
  double spacing;         /* h, m: edge of a (square, cubic) grid cell. Required */
  double origin[3];       /* a grid node, m; default 0 */
  int periodic[3];        /* 1: period[i] must be a whole multiple (>= 4) of spacing */
  double period[3];       /* m */
  MpmShape shape;         /* default GIMP */
  MpmTransfer transfer;   /* default FLIP */
  double pic_fraction;    /* alpha_PIC in [0, 1]; 0 = FLIP, 1 = PIC (TM-DEMPM eq. 25-26) */
  int xpic_order;         /* XPIC(m), 1..10 */
  MpmOrder order;         /* default USF */
  double point_damping;   /* alpha_p, 1/s (eq. 26-27 corrected) */
  double grid_damping;    /* alpha_g, 1/s */
  int thermal;            /* 1: heat is transported */
  int mechanical;         /* 1 (default); 0: thermal only: points do not move, the law is not run (conductivities stay) */
  double mass_cutoff;     /* nodes below this fraction of their largest point's mass move with the points' field but
                           * carry no force; default 1e-30 */
  int threads;            /* 0 = OpenMP's own choice */
  MpmVolumetric volumetric; /* default POINT; CELL against volumetric locking (mpm_volumetric.c) */
  int gimp_stretch; /* 1: the domains of uGIMP follow the points' stretch, at most a cell wide; default 0, undeformed */
} MpmScene;
MpmScene mpm_scene_default(void);
BaseStatus mpm_scene_check(const MpmScene *scene);

/* The state of one material point, as the caller (a LIGGGHTS fix, a test) keeps it and hands it over at each step.
 * Array of structures on the outside; the core keeps its own structure of arrays, sorted by cell. */
typedef struct MpmPoint {
  int64_t tag;                  /* global identity, > 0, unique */
  double position[3];           /* m */
  double velocity[3];           /* m/s */
  double force[3];              /* external, N (gravity and whatever fixes added); 2D: per unit depth */
  double mass;                  /* kg (2D: per metre of depth) */
  double volume0;               /* m3 (2D: m2 times unit depth), undeformed; current volume = volume0 det F */
  double size0[3];              /* edges of the undeformed point domain, m (uGIMP keeps them; 2D: size0[2] = 1) */
  double deformation_gradient[9];
  double velocity_gradient[9];  /* of the last step, as the law saw it; out */
  double stress[6];             /* Cauchy, Pa */
  double affine[9];             /* APIC matrix: velocity near the point = v + affine (x - x_p), 1/s */
  double temperature;           /* incremental T_p (eq. 28) */
  double temperature_mapped;    /* remapped from the grid (eq. 29): what law and output see */
  double temperature_law;       /* temperature_mapped that the law saw last: state, belongs into exchange and restart */
  double temperature_gradient[3]; /* K/m */
  double heat_capacity;         /* specific, J/(kg K); required if thermal */
  double heat;                  /* W/m3 from the law */
  double heat_external;         /* W, from walls or fixes, this step */
  /* Of thermal steps longer than the mechanical ones (mpm_set_heat_duration), else 0: */
  double temperature_rate;      /* K/s, of the last thermal step; held until the next */
  double heat_waiting;          /* J from law and fixes that the temperature has not got yet */
  double heat_power;            /* W, at which the last thermal step gives what waited then */
  double conductivity[6];       /* W/(m K) */
  double modulus;               /* Pa */
  double scalars[MPM_LAW_SCALARS];
} MpmPoint;
void mpm_point_default(MpmPoint *point); /* F = I, all else 0 */

/* Walls. A plane keeps the half space its normal points into; a box keeps its outside. Both may move at `velocity`. A
 * surface is a thin wall of facets, each moving as its corners do; it may hold material on either side. */
typedef enum MpmWallKind { MPM_WALL_PLANE, MPM_WALL_BOX, MPM_WALL_SURFACE } MpmWallKind;
/* 2D: a segment from node[0] to node[1], its normal to the left; 3D: a triangle, its normal by the right-hand rule. */
typedef struct MpmFacet {
  double node[3][3];     /* m */
  double velocity[3][3]; /* m/s, of the nodes */
  double normal[3];      /* unit; set by mpm_facets_prepare */
  /* Bit i: node i, or the edge from node i to the next, is on the rim of the surface; set by mpm_facets_prepare. */
  unsigned char free_nodes, free_edges;
} MpmFacet;
enum { MPM_SIDE_FRONT = 1 /* where the normals point */, MPM_SIDE_BACK = 2 };
/* Normals, and which nodes and edges are on the rim: those that no other facet shares. 2D: nodes' z must be 0. Once per
 * surface; while it moves mpm_facets_turn renews the normals. */
BaseStatus mpm_facets_prepare(MpmFacet *facets, int count, int dimension);
BaseStatus mpm_facets_turn(MpmFacet *facets, int count, int dimension);
typedef enum MpmWallContact { MPM_WALL_NO_CONTACT, MPM_WALL_NO_SLIP, MPM_WALL_SLIP, MPM_WALL_FRICTION } MpmWallContact;
typedef enum MpmWallHeat { MPM_WALL_ADIABATIC, MPM_WALL_TEMPERATURE, MPM_WALL_FLUX } MpmWallHeat;
typedef struct MpmWall {
  MpmWallKind kind;
  double point[3], normal[3];  /* plane: a point of it, unit normal towards the material */
  double low[3], high[3];      /* box */
  const MpmFacet *facets;      /* surface, borrowed; the same ones in the same order on all ranks */
  int facet_count;
  int sides;                   /* surface: MPM_SIDE_*, where material may be; default both. One side: as a plane, the
                                * surface holds all points near it, also those that are behind it */
  double velocity[3];          /* m/s, of a plane or box; the caller moves point / low / high */
  MpmWallContact contact;
  int separable;               /* SLIP, FRICTION: 1 = the body may lift off (default), 0 = glued normally */
  double friction;             /* Coulomb coefficient, FRICTION */
  MpmWallHeat heat;
  double temperature;          /* TEMPERATURE */
  double flux;                 /* FLUX: W/m2 into the material */
  double range[2][3];          /* the wall acts only on nodes inside this box; default -inf .. inf */
  /* out, per step, sums over nodes this rank owns: */
  double reaction[3];          /* force of the wall on the body, N */
  double power_friction;       /* W dissipated by wall friction (not heat of the body unless asked) */
  double power_motion;         /* W, work of the moving wall on the body */
  double heat_flow;            /* W into the body; in steps without heat (mpm_set_heat_duration) left as the caller gives it */
} MpmWall;
MpmWall mpm_wall_default(void);
BaseStatus mpm_wall_check(const MpmWall *wall, int dimension, int thermal);

/* Traction on the current outermost layer of points along +axis or -axis (errata A.6): each gets t V_p / h, h its own
 * width. The component along the axis acts along the current normal of the point's face, as a pressure does.
 * Or, with `surface`, a pressure on the whole surface of the body: by the divergence theorem its nodal forces are those of the
 * stress -p I in all points, -int p phi n dA = -sum V_p p grad phi, so no surface has to be found and a body under -p I is in
 * equilibrium to round-off, however deformed. Walls then carry what differs from p. */
typedef struct MpmTraction {
  int axis;            /* 0, 1, 2 */
  int side;            /* +1 or -1: which outermost layer */
  double traction[3];  /* Pa, in global axes */
  int surface;         /* 1: `pressure` on the whole surface; the entries above are not used */
  double pressure;     /* Pa, positive pushes into the body */
} MpmTraction;

/* Copies of foreign points: begin finds whom to send what (once per step, after positions are known), forward repeats
 * the transfer of changed fields. Implemented by the coupling over MPI; NULL = one rank. fields: bit set of
 * MPM_FIELD_*. */
enum { MPM_FIELD_STRESS = 1, MPM_FIELD_VELOCITY = 2, MPM_FIELD_HEAT = 4 /* heat, conductivity, temperature */ };
typedef struct MpmHalo {
  void *content;
  /* Given own points [own], returns foreign points (and periodic images, positions shifted) within `reach` of this
   * rank's own. The array stays owned by the halo and valid until the next begin. Collective. */
  BaseStatus (*begin)(void *content, const MpmPoint *own, int own_count, double reach, const MpmPoint **foreign,
                      int *foreign_count);
  /* Sends `width` doubles per own point, value [own_count][width], to wherever copies are; writes foreign_value
   * [foreign_count][width]. Collective. */
  BaseStatus (*forward)(void *content, int width, const double *value, double *foreign_value);
  void (*destroy)(void *content);
} MpmHalo;

typedef struct Mpm Mpm;

/* Copies scene. law and halo are borrowed and must outlive the Mpm; halo NULL = one rank, not periodic. */
BaseStatus mpm_create(const MpmScene *scene, const MpmLaw *law, const MpmHalo *halo, Mpm **mpm);
void mpm_destroy(Mpm *mpm); /* accepts NULL */
const MpmScene *mpm_scene(const Mpm *mpm);
/* From the next step on a cell's edge along axis i is the scene's spacing times stretch[i] > 0, measured from the origin: a grid
 * that follows a moving wall keeps it on a node. The grid is made anew in each step anyhow, so nothing else changes. 2D:
 * stretch[2] is not read. BASE_ERROR_ARGUMENT, also for a periodic axis. */
BaseStatus mpm_set_stretch(Mpm *mpm, const double stretch[3]);
double mpm_smallest_spacing(const Mpm *mpm);
BaseStatus mpm_set_walls(Mpm *mpm, MpmWall *walls, int count);            /* borrowed; outputs are written into them */
BaseStatus mpm_set_tractions(Mpm *mpm, const MpmTraction *tractions, int count); /* copied */

/* Heat in steps of its own, from the next step on. duration < 0 (so at first): each step conducts for its own dt. > 0: the next
 * step finds the rates of temperature for `duration` s, a whole number of steps; 0: the next step only goes on with them (temperatures
 * change linearly meanwhile, which is explicit Euler with steps of `duration`). Sources are collected in every step and given
 * evenly over the thermal step that follows, so that no heat is lost: thermal_energy of mpm_totals() includes what waits. */
void mpm_set_heat_duration(Mpm *mpm, double duration);

/* One step of dt seconds: P2G, grid, law, G2P in the scene's order. points [count] in and out, order kept. Collective.
 * BASE_ERROR_UNSTABLE names the first (lowest tag) point that is not finite. */
BaseStatus mpm_step(Mpm *mpm, MpmPoint *points, int count, double dt);
/* The same in parts, for many steps: attach copies the state of points [count] into the core's own arrays and borrows
 * `points`, whose entries are then out of date until write brings them up to date (order kept); advance does one step.
 * Attach again after points changed and after an error. advance is collective; it reports what attach found wrong with
 * points, too. */
BaseStatus mpm_attach(Mpm *mpm, MpmPoint *points, int count);
BaseStatus mpm_advance(Mpm *mpm, double dt);
void mpm_write(const Mpm *mpm);

/* Motion of attached points in arrays of the caller (LIGGGHTS' own), of which others may read and write. */
typedef struct MpmMotion {
  const int *index;         /* [count] row of the following arrays, for each point of the attached array */
  double (*position)[3];    /* m */
  double (*velocity)[3];    /* m/s */
  const double (*force)[3]; /* N, external */
  double *work;             /* [count] J, of the external force on each point so far */
} MpmMotion;
/* Between attach and the next step, or between steps: takes over the motion where its bits differ from the core's. */
void mpm_take_motion(Mpm *mpm, const MpmMotion *motion);
/* After a step: writes positions and velocities (2D: x and y) and adds force times displacement from the position that stood
 * there to work. low, high: box around all positions, m; low > high without points. */
void mpm_give_motion(Mpm *mpm, const MpmMotion *motion, double low[3], double high[3]);
/* Answers of the law for the initial state (stress of the packing, conductivity, modulus), without stepping. Sets
 * temperature_mapped and temperature_law to temperature: call it once for new points, not for restarted ones.
 * Collective. */
BaseStatus mpm_initialise(Mpm *mpm, MpmPoint *points, int count);

/* Critical time steps of this rank's points, s; INFINITY without points. Mechanical: h / (sqrt(M/rho) + |v|) times half
 * the limit of verification B9 (0.5 for FLIP, PIC, XPIC with USF or MUSL, 0.45 if linear; less for APIC and USL:
 * mpm_critical.c). Thermal: rho c h^2 / (b k_max), b = 2, 10 if linear (eq. 30-31 corrected). */
void mpm_critical_time_steps(const Mpm *mpm, const MpmPoint *points, int count, double *mechanical, double *thermal);
/* The same of the attached points as they are now. */
void mpm_critical_attached(Mpm *mpm, double *mechanical, double *thermal);
/* 1 if dt is surely below the mechanical limit of the attached points, without a look at each: since the last
 * mpm_critical_attached() their speeds of sound grew by at most 1 % per step (a law of constant moduli, which only their volumes
 * change), their largest speed is known from mpm_give_motion(). 0: unknown. */
int mpm_is_below_critical(const Mpm *mpm, double dt);

/* Sums over this rank's own points (caller reduces over ranks). */
typedef struct MpmTotals {
  double mass, momentum[3], kinetic_energy, thermal_energy /* sum m c T, and heat_waiting */, heat_power /* W, sum V Q */;
} MpmTotals;
void mpm_totals(const MpmPoint *points, int count, MpmTotals *totals);

/* The active nodes of the last step, for writers. */
typedef struct MpmGridView {
  int nodes;
  double spacing[3];         /* m, edges of a cell */
  const int *index;          /* [nodes][3] */
  const double *mass;        /* [nodes] */
  const double *velocity;    /* [nodes][3] */
  const double *temperature; /* [nodes]; NULL if the step was not thermal */
  const unsigned char *owned;/* [nodes] 1 if this rank holds the node's lowest-tag point: owned by exactly one rank */
} MpmGridView;
void mpm_grid_view(Mpm *mpm, MpmGridView *view);

#ifdef __cplusplus
}
#endif
#endif
