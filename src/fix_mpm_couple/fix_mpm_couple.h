/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(mpm/couple,FixMPMCouple)

/* clang-format on */
#else

#ifndef LMP_FIX_MPM_COUPLE_H
#define LMP_FIX_MPM_COUPLE_H

#include <string>
#include <vector>

#include "../mpm/mpm.h"
#include "fix.h"
#include "point_output.h"

namespace LAMMPS_NS {

/* Moves the particles of its group as material points of a continuum. It is their time integrator.
 *
 *   fix ID group mpm/couple grid H shape linear|gimp|bspline transfer flip A|pic|apic|xpic M
 *       material rve RVEFIXID | material elastic 3d|plane_strain|plane_stress|bar
 *       [origin x y z] [order usf|usl|musl] [thermal yes|no] [temperature T0] [mechanics yes|no]
 *       [damping/point A] [damping/grid A] [point/size LX LY [LZ]] [timestep/check yes|no]
 *       [leaving error|delete] [density/bulk RHO] [threads N] [thermal/every N|auto E]
 *       [volumetric point|cell] [follow WALL ...]
 *   fix_modify ID damping/point A
 *   fix_modify ID damping/grid A             (from the next run on)
 *
 * The whole step runs in final_integrate: atom->f then holds the forces of all other fixes (gravity, addforce ...),
 * which are the external forces of the points. The group is excluded from LIGGGHTS' neighbour lists when the fix is
 * defined: points never touch each other or grains through a pair style.
 *
 * Size: `point/size`, else the spacing of the current lattice (sq, sc); in 2D the third edge is a metre of depth, so
 * that masses, forces and energies are per metre. Mass: volume times bulk density, which is that of the packings
 * (material rve; `density/bulk` replaces it, to scale inertia) or the particles' own `density` (material elastic). The
 * particle's rmass becomes the point's mass, its radius half the smallest edge.
 *
 * Points have numbers (f[30] of a particle): they count by position, z first, then y, then x, the same on any number of
 * ranks, whereas ids from create_atoms depend on it; on one rank both agree. Messages about points and fix mpm/vtk use
 * them; with several packings point n gets packing (n - 1) modulo their number.
 *
 * Global scalar: f[5] + f[6] + f[7], the mechanical energy. Global vector, sums over all points:
 *    1     mass, kg
 *    2-4   momentum, kg m/s
 *    5     kinetic energy, J
 *    6     potential energy, J: minus the sum of external force times position, which is m g h under gravity; means
 *          something for forces that are constant in space and time only
 *    7     energy stored in the material, J: springs and fluctuations of the grains, or elastic
 *    8     thermal energy, J: sum m c T, and what waits for the next thermal step
 *    9     frictional heat of the grains since their RVEs were made, J
 *   10     number of RVEs run in the last step
 *   11     worst unbalanced force ratio of all RVEs in the last step
 *   12     DEM particle-steps since the program (re)started
 *   13     work lost to damping of the grains since their RVEs were made, J
 *   14     work of the external forces on the points so far, J: any force, summed step by step
 *   15     number of points
 * Per-particle array: point_output.h. The state of the points is in restart files: 2 N steps equal N steps, restart
 * and N steps bit for bit, on any number of ranks. */
class FixMPMCouple : public Fix {
 public:
  FixMPMCouple(class LAMMPS *, int, char **);
  ~FixMPMCouple();
  int setmask();
  void init();
  void setup(int);
  void setup_pre_exchange() { pre_exchange(); }
  void setup_pre_neighbor() { pre_neighbor(); }
  void pre_exchange();
  void pre_neighbor();
  void final_integrate();
  void post_run();
  int modify_param(int, char **);

  double compute_scalar();
  double compute_vector(int);
  double memory_usage();

  void grow_arrays(int);
  void copy_arrays(int, int, int);
  void set_arrays(int);
  int pack_exchange(int, double *);
  int unpack_exchange(int, double *);
  int pack_restart(int, double *);
  void unpack_restart(int, int);
  int size_restart(int);
  int maxsize_restart();
  void write_restart(FILE *);
  void write_restart_file(char *);
  void restart(char *);

  /* The fix mpm/couple called `mpm_id`, for `asking`, a fix that belongs to it. Ends the program if there is none. */
  static FixMPMCouple *find(class LAMMPS *, const Fix *asking, const std::string &mpm_id);
  /* For fix mpm/vtk. */
  Mpm *mpm() const { return mpm_; }
  class FixMPMRve *rve() const {
    return rve_;
  }

  /* Per-point state: a whole MpmPoint, so that nothing that influences the future can be forgotten, and what LIGGGHTS'
   * side adds. */
  enum {
    STATE_POINT = 0,
    STATE_STAGE = sizeof(MpmPoint) / sizeof(double), /* one of Stage */
    STATE_EXTERNAL_WORK,                             /* J, so far */
    STATE_COLUMNS
  };
  enum Stage { STAGE_NEW = 0, STAGE_STARTED /* mass, size, temperature are set */, STAGE_ANSWERED /* by the law */ };
  enum Total {
    TOTAL_MASS = 0,
    TOTAL_MOMENTUM,
    TOTAL_KINETIC = 4,
    TOTAL_POTENTIAL,
    TOTAL_STORED,
    TOTAL_THERMAL,
    TOTAL_FRICTION_HEAT,
    TOTAL_RVES_RUN,
    TOTAL_UNBALANCED,
    TOTAL_PARTICLE_STEPS,
    TOTAL_DAMPING_WORK,
    TOTAL_EXTERNAL_WORK,
    TOTAL_POINTS,
    TOTALS
  };

 private:
  /* What the command says. */
  MpmScene scene_;
  std::string rve_id_; /* empty: elastic */
  std::vector<std::string> followed_; /* ids of the walls that the grid follows */
  MpmElasticMode elastic_mode_ = MPM_ELASTIC_3D;
  double start_temperature_ = 0.0, given_density_ = 0.0 /* 0: the packings' */;
  double size0_[3] = {};
  bool check_time_step_ = true, delete_leaving_ = false;

  Mpm *mpm_ = NULL;
  MpmLaw law_ = {};   /* content is ours if elastic, the fix mpm/rve's otherwise */
  MpmHalo halo_ = {}; /* content NULL: none needed */
  class FixMPMRve *rve_ = NULL;
  double heat_capacity_ = 0.0, bulk_density_ = 0.0;
  std::vector<class FixMPMWall *> wall_fixes_;
  std::vector<MpmWall> walls_;

  double **state_ = NULL; /* [state_rows_][STATE_COLUMNS] */
  int state_rows_ = 0;
  int64_t last_number_ = 0; /* of all points so far */
  std::vector<MpmPoint> points_; /* this rank's points, gathered from the particles */
  std::vector<int> particle_;    /* their indices */
  bool attached_ = false;        /* to the core, which borrows points_ */
  int attached_particles_ = 0;   /* atom->nlocal when they were */
  bool points_written_ = true, state_written_ = true; /* points_, state_ are as the core's; if attached */
  std::vector<double> work_;     /* J, external, of points_; if attached */
  std::vector<int> output_every_; /* steps in which other fixes may read the output */
  bigint points_before_exchange_ = -1;
  bool warned_time_step_ = false;

  /* Thermal steps of several time steps (fix_mpm_couple_heat.cpp). */
  int heat_every_ = 1;        /* time steps per thermal step as the command says; 0: found by heat_error_ */
  double heat_error_ = 0.0;   /* largest change of a temperature in a thermal step over the range of temperatures */
  bool heat_apart_ = false;   /* thermal steps are not simply time steps, or were not before a restart */
  int64_t heat_left_ = 0;     /* time steps until the next thermal step; 0: it is due */
  int64_t heat_steps_ = 1;    /* time steps of the last thermal step */
  bigint heat_steps_done_ = 0, heat_steps_left_out_ = 0; /* in this run */

  bigint totals_step_ = -1; /* of totals_; -1: none */
  double totals_[TOTALS] = {};
  bool show_progress_ = false, progress_shown_ = false;
  double run_started_ = 0.0, progress_printed_ = 0.0;
  double particle_steps_before_ = 0.0, rve_seconds_before_ = 0.0;

  void read_keywords(int, char **);
  void read_transfer(class KeywordParser &);
  void read_material(class KeywordParser &);
  void check_keywords(const class KeywordParser &);
  void take_size_from_lattice();
  void exclude_from_neighbor_lists();

  void set_sort_bins();
  void check_domain();
  void check_other_fixes();
  int find_point_type();
  void check_place();
  void find_bounds(double low[3], double high[3]);
  void create_law(int type);
  void create_elastic_law(int type);
  void create_mpm();
  void destroy_mpm();
  void find_walls_and_tractions();
  void check_followed();
  void follow_walls();
  bool is_below_limits() const;
  void check_time_step(bool starting);
  void find_limits(double limit[2]) const;

  void read_thermal_every(class KeywordParser &);
  void begin_heat();
  int64_t choose_heat_steps() const;
  std::string heat_line() const;
  std::string rve_lines() const;

  bool is_point(int i) const;
  void start_points();
  void start_point(int i);
  void number_points(const std::vector<int> &started);
  void tell_volumes();
  void answer_points();
  void assign_rves();
  void gather();
  MpmMotion motion();
  bool has_other_particles() const;
  BaseStatus attach();
  void write_points();
  void write_state();
  void detach();
  void give_motion();
  void find_readers();
  bool output_is_due() const;
  void fill_output();
  void check_leaving(double **x, bool some) const;
  bigint count_points(bool inside_only) const;
  bool is_outside(const double position[3]) const;

  void sum_points(struct DoubleSum sum[TOTALS]) const;
  void update_totals();
  void start_progress();
  void progress();
};

}  // namespace LAMMPS_NS

#endif
#endif
