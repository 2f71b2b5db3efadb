/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Periodic DEM packings (representative volume elements, RVEs) run in batches.
 *
 * Conventions. SI units. Tension positive. Cell matrix H: columns are the full cell vectors (TM-DEMPM eq. 41,
 * reading (a) of the errata); a grain sits at x = H s with s fractional. 3 x 3 tensors are double[9] row-major,
 * symmetric ones double[6] in LIGGGHTS' order xx yy zz xy xz yz. In 2D the third direction has length `thickness`
 * and does not deform. */
#ifndef DEMPM_RVE_H
#define DEMPM_RVE_H

#include "../base/base.h"
#include "../grain_heat/grain_heat.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum RveGrain {
  RVE_DISK,  /* 2D cylinder of length `thickness`: m = rho pi R^2 thickness, I = m R^2 / 2 */
  RVE_SPHERE /* m = rho 4/3 pi R^3, I = 2/5 m R^2; in 2D one layer of spheres */
} RveGrain;

typedef enum RveBackend { RVE_BACKEND_AUTO, RVE_BACKEND_CPU, RVE_BACKEND_CUDA } RveBackend;

/* What all RVEs of a batch share. Start from rve_scene_default(); entries marked "required" have no default and
 * are refused while NAN. */
typedef struct RveScene {
  int dimension;              /* 2 or 3 */
  RveGrain grain;             /* 3D allows RVE_SPHERE only */
  double thickness;           /* z_p, m; 2D only: volume, mass and moments are those of this depth. Required in 2D */
  double density;             /* of the grains' matter, kg/m3. Required */
  double normal_stiffness;    /* kn, N/m, > 0 (TM-DEMPM eq. 35a). Required */
  double tangential_stiffness;/* kt, N/m, >= 0; 0 = frictionless (eq. 35b). Required */
  double friction;            /* Coulomb mu, >= 0 (eq. 36). Required when kt > 0 */
  double normal_viscosity;    /* LIGGGHTS gamman, 1/s: normal dashpot gamma_n m_eff (hooke/stiffness). 0 = none */
  double tangential_viscosity;/* LIGGGHTS gammat, 1/s. 0 = none */
  double critical_damping;    /* fraction of critical of the normal dashpot, 2 f sqrt(m_eff kn), added to gamman */
  double local_damping;       /* Cundall's alpha, 0 <= alpha < 1: force opposing motion reduced. Its work is no heat */
  int rotation;               /* 1: grains rotate (default); 0: rotation held */

  int thermal;                /* 1: grains expand, conductivity is computed; 0: the variant without heat runs */
  double expansion;           /* beta, 1/K, linear (eq. 37). Required if thermal */
  double reference_temperature; /* at which the packing's radii hold; same scale as the temperatures passed */
  double pipe_resistance;     /* alpha, K/(W m), resistance of a heat pipe per length: h = 1/(alpha |l|). Required if
                                 thermal without a conduction model */
  GrainHeat conduction;       /* one direct and one indirect model in place of heat pipes (not collisional); h is that of
                                 spheres, also of disks. Default: neither */
  double grain_conductivity;  /* W/(m K), of the grains' matter; required with a conduction model */
  int network;                /* 0: conductivity of affine temperatures (default); 1: of those that the contacts bring
                                 about */
  double network_change;      /* the network is solved again when the affine conductivity has changed by more than this
                                 fraction (Frobenius), or the packing was deformed and turned by more (integral of
                                 |L| dt); in between it is carried along with the affine one. 0: in each call. Default
                                 0.01 */
  int conductivity_every;     /* conductivities are worked out in every N-th call with a duration, and stand in between.
                                 Default 1 */
  double grain_heat_capacity; /* J/(kg K); used by rve_batch_conduct() only. Required there */

  int bonds;                  /* 1: bonds can exist (installed by rve_batch_install_bonds) */
  double bond_strength;       /* beta_a: F_nb = beta_b kn (Ri+Rj)/2 (eq. 38) */
  double bond_shear_ratio;    /* mu_b: F_tb = mu_b F_nb (eq. 39) */
  double bond_melting_temperature; /* T_s, INFINITY = does not melt; beta_b = beta_a clip((Ts-T)/(Ts-Tref),0,1) (eq. 40 corrected) */

  double time_step;           /* DEM time step, s; 0 = time_step_fraction of the critical one */
  double time_step_fraction;  /* default 0.5, of rve_critical_time_step() of the packing */
  int substeps;               /* 0: ceil(duration / time_step), physical time (errata A.6). N > 0: exactly N DEM steps per
                                 call, the whole deformation spread over them (quasi-static relaxation time) */
  double skin;                /* neighbour skin as a fraction of the largest radius; 0 = automatic */
  int share;                  /* 1: RVEs with the same packing and the same calls so far are computed once (default); the
                                 results are the same to the last bit; CPU only. 0: each by itself, e.g. to time them */
  int flight;                 /* 1: calls in which no grains can meet are answered in closed form, equal to the steps but for
                                 round-off (default); 0: they are stepped */
  int resting;                /* 1: rows of pairs that cannot touch yet are skipped; the results are the same to the last bit
                                 (default); 0: every pair in every step, to prove it */
  int mixed;                  /* 1: contact forces in FP32, sums and positions as ever; needs AVX-512, else FP64 runs (see
                                 rve_batch_backend_name). Stresses differ by about 1e-5 of the mean stress. Default 0 */
  int threads;                /* OpenMP threads; 0 = OpenMP's own choice */
} RveScene;

RveScene rve_scene_default(void);
/* BASE_ERROR_ARGUMENT names the first wrong entry, what was given and what is allowed. */
BaseStatus rve_scene_check(const RveScene *scene);

/* A periodic packing as it comes from a file or from the generator. */
typedef struct RvePacking {
  int dimension;
  int grains;
  double cell[9];          /* H, m; columns are cell vectors. 2D: cell[8] = 1 and cell[2,5,6,7] = 0 */
  double *position;        /* [grains][3] fractional s in [-0.5, 0.5); s_z = 0 in 2D */
  double *radius;          /* [grains] m */
  double *velocity;        /* [grains][3] m/s, relative to the affine flow; NULL = at rest */
  double *spin;            /* [grains][3] rad/s (2D: z only), relative to the affine flow's vorticity; NULL = at rest */
  /* Tangential history, so that a packing prepared with friction starts in equilibrium; 0 contacts = unknown. */
  int contacts;
  int *contact_pair;       /* [contacts][2] grain indices */
  int *contact_image;      /* [contacts][3] cell shift P of the second grain: branch = H (s_j - s_i + P) */
  double *contact_shear;   /* [contacts][3] tangential spring force on the first grain, N */
} RvePacking;

void rve_packing_destroy(RvePacking *packing); /* frees the arrays; accepts NULL and half-filled */
/* Checks what a batch relies on: finite, n >= 1, radii > 0, no overlap above 30 % of the smaller radius, cell not
 * singular, no grain wider than half a cell height unless grains <= 16 (crystals: all images are counted then). */
BaseStatus rve_packing_check(const RvePacking *packing);
/* n_x by n_y by n_z copies of a packing (crystals of many cells); n_z = 1 in 2D. */
BaseStatus rve_packing_replicate(const RvePacking *packing, const int copies[3], RvePacking *result);

/* What a material point asks of its RVE: one constant velocity gradient and temperature over `duration`. */
typedef struct RveInput {
  double velocity_gradient[9]; /* L_ij = dv_i/dx_j, 1/s (eq. 46b) */
  double temperature;          /* at the end of the call; grains change linearly to it over the DEM steps, starting from the last call's (at
                                  first: reference_temperature). Ignored if !thermal */
} RveInput;

typedef struct RveAnswer {
  double stress[6];       /* Cauchy, Pa: -(1/V)[sum f (x) b + sum m v_f (x) v_f], symmetrised (eq. 49 corrected) */
  double conductivity[6]; /* W/(m K): (1/V) sum h l (x) l (eq. 34 corrected), or that of the network; 0 if !thermal */
  double conductivity_affine[6]; /* W/(m K): the affine sum, an upper bound, whatever the scene asks for */
  double heat;            /* frictional heat per current volume and time of the MPM step, W/m3 (eq. 32-33 corrected) */
  double friction_work;   /* total slip work since creation, J per RVE */
  double solid_fraction;  /* sum of grain areas (2D: pi R^2) or volumes over the cell's, overlaps not removed */
  double coordination;    /* 2 contacts / grains */
  double fabric[6];       /* mean n (x) n over contacts; trace 1; 0 without contacts */
  double bond_fraction;   /* intact / installed; 0 when none were installed */
  double kinetic_energy;  /* J per RVE, of fluctuations and rotation */
  double elastic_energy;  /* J per RVE, of normal and tangential springs */
  double damping_work;    /* J per RVE lost to local and viscous damping since creation */
  double unbalanced;      /* mean resultant force over mean contact force; 0 without contacts */
  double modulus;         /* affine bound of the P-wave modulus, Pa (eq. 58): for the critical time step */
  double volume;          /* current, m3 (2D: area * thickness) */
  int64_t steps;          /* DEM steps since creation */
  int64_t rebuilds;       /* neighbour lists built since creation */
  int status;             /* 0, or BASE_ERROR_UNSTABLE: a value is not finite; the other entries are then the last good */
  int flew;               /* 1: no two grains could meet in the last call, which was answered in closed form */
} RveAnswer;

typedef struct RveBatch RveBatch;

/* 1 if CUDA was built in and a device answers. */
int rve_device_present(void);
/* Of several processes on a machine with several devices, number `process` (from 0) takes device `process` modulo their number.
 * Before the first batch; 0 unless said. */
void rve_device_share(int process);

/* Creates `count` RVEs; RVE k is a copy of packings[packing_of_rve[k]] (NULL: all of packings[0]).
 * Copies what it needs; borrows nothing. A device whose memory is too small, now or later, loses the batch to the CPU
 * (rve_batch_is_on_device). BASE_ERROR_ARGUMENT, BASE_ERROR_MEMORY, BASE_ERROR_DEVICE. */
BaseStatus rve_batch_create(const RveScene *scene, const RvePacking *packings, int packing_count,
                            const int *packing_of_rve, int count, RveBackend backend, RveBatch **batch);
void rve_batch_destroy(RveBatch *batch); /* accepts NULL */
int rve_batch_count(const RveBatch *batch);
enum { RVE_BACKEND_BYTES = 24 }; /* room for a backend's name and its final zero */
const char *rve_batch_backend_name(const RveBatch *batch); /* "cpu/avx512", "cpu/avx512_mixed", "cpu/avx2", "cpu/plain", "cuda" */
int rve_batch_is_on_device(const RveBatch *batch);
/* All RVEs go on on the CPU: the same states, other last bits. Nothing without a device. BASE_ERROR_MEMORY,
 * BASE_ERROR_DEVICE: the batch is of no use then. */
BaseStatus rve_batch_leave_device(RveBatch *batch);
const RveScene *rve_batch_scene(const RveBatch *batch);
/* May change material parameters (friction, damping, substeps, bonds' strengths, threads, time step) between steps; refuses a change of
 * dimension, grain, stiffness sign, thermal or bonds flag. */
BaseStatus rve_batch_set_scene(RveBatch *batch, const RveScene *scene);

/* Advances RVEs index[0..n) (NULL: the first n) by `duration` seconds and answers. input and answer are [n], in the order of
 * index. Results do not depend on n, on the order or on threads. duration = 0 answers without stepping.
 * BASE_ERROR_UNSTABLE if any RVE's status says so (all answers are written). */
BaseStatus rve_batch_step(RveBatch *batch, int n, const int *index, const RveInput *input, double duration,
                          RveAnswer *answer);

/* How many RVE steps were copies of another RVE's with the same packing and the same calls so far (results are the same to the
 * last bit). Restored RVEs count as having histories of their own. */
int64_t rve_batch_shared(const RveBatch *batch);

/* Conductivities that were asked of networks since creation: by solving, and carried along from an earlier solution. */
void rve_batch_network_counts(const RveBatch *batch, int64_t *solved, int64_t *kept);
/* How many RVE steps were free flights, answered in closed form, since creation; copies are not counted. */
int64_t rve_batch_flown(const RveBatch *batch);

/* Bonds every contact with overlap > 0 of the given RVEs (NULL: all). Requires scene.bonds. */
BaseStatus rve_batch_install_bonds(RveBatch *batch, int n, const int *index);
/* Sets fluctuation velocities and spins to zero, e.g. after consolidation. */
BaseStatus rve_batch_rest(RveBatch *batch, int n, const int *index);

/* One RVE's exact state as bytes, position independent: an RVE restored on any rank continues bit for bit when the lane width
 * is the same (else canonically: neighbour list rebuilt). pack writes at most rve_batch_state_bytes(batch, k). */
size_t rve_batch_state_bytes(const RveBatch *batch, int rve);
BaseStatus rve_batch_pack(const RveBatch *batch, int rve, void *bytes, size_t *written);
/* BASE_ERROR_FORMAT if truncated, altered (checksum) or of another scene; the RVE is unchanged then. */
BaseStatus rve_batch_unpack(RveBatch *batch, int rve, const void *bytes, size_t size);

/* The grains and contacts of one RVE, for writers and tests. */
typedef struct RveView {
  int grains;
  double cell[9];
  double *position;     /* [grains][3] m, wrapped into the cell */
  double *radius;       /* [grains] current (expanded) */
  double *velocity;     /* [grains][3] fluctuation */
  double *spin;         /* [grains][3] rad/s, relative to the affine flow's vorticity */
  int contacts;         /* pairs with overlap > 0 or an intact bond */
  int *pair;            /* [contacts][2] */
  int *image;           /* [contacts][3] */
  double *branch;       /* [contacts][3] x_j - x_i, m */
  double *force_normal; /* [contacts] N, repulsion positive */
  double *force_shear;  /* [contacts][3] tangential force on grain i, N */
  int *bond;            /* [contacts] 1 = intact bond */
} RveView;
BaseStatus rve_batch_view(const RveBatch *batch, int rve, RveView *view);
void rve_view_destroy(RveView *view);
/* The same as a packing (with history), to start other batches from. */
BaseStatus rve_batch_packing(const RveBatch *batch, int rve, RvePacking *packing);

/* Heat conduction between the grains themselves at fixed geometry, `steps` explicit steps of `time_step` s:
 * m c dT_i/dt = sum_c h_c (T_j - T_i), h = 1/(alpha |l|) or that of the conduction model. temperature [grains] in and
 * out. For verification A11. BASE_ERROR_ARGUMENT if time_step exceeds min m c / sum h. */
BaseStatus rve_batch_conduct(const RveBatch *batch, int rve, double time_step, int64_t steps, double *temperature);

/* Critical DEM time step of a packing, s: min over grains of 2 sqrt(m / (kn W)), W bounding the contact stiffness matrix
 * (verification A: crystals' dt_c are met exactly or from below). */
double rve_critical_time_step(const RveScene *scene, const RvePacking *packing);

#ifdef __cplusplus
}
#endif
#endif
