/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(mpm/rve,FixMPMRve)

/* clang-format on */
#else

#ifndef LMP_FIX_MPM_RVE_H
#define LMP_FIX_MPM_RVE_H

#include <string>
#include <vector>

#include "fix.h"
#include "rve_law.h"

namespace LAMMPS_NS {

/* The constitutive law "every material point carries a periodic DEM packing", for `fix mpm/couple ... material rve ID`.
 *
 *   fix ID group mpm/rve packing FILE [FILE2 ...] model hooke/stiffness tangential history|off density RHO
 *       [grain disk|sphere] [thickness Z] [damping none|local A|viscous F] [pipe_resistance A] [reference T0]
 *       [bonds strength B shear_ratio M melting TS|none] [substeps N] [timestep/dem DT] [skin S] [rotation yes|no]
 *       [precision double|mixed] [share yes|no] [flight yes|no] [backend auto|cpu|cuda] [threads N] [replay DIRECTORY|none]
 *       [direct MODEL] [indirect MODEL] [their keywords: conduction_keywords.h]
 *       [conductivity affine|network [change E] [every N]]
 *
 * `grain` and `thickness` are required in 2D; `reference` and `pipe_resistance` or a conduction model with `thermal yes` of fix
 * mpm/couple.
 * Grains' properties come from `fix property/global`: kn, kt, coefficientFriction, gamman, gammat (peratomtypepair) and
 * thermalExpansionCoefficient, thermalConductivity (peratomtype), for the atom type of the points. Changed ones hold from the next run on.
 *
 *   fix_modify ID bonds install    bonds every contact of every RVE (again)
 *   fix_modify ID rest             sets the grains' fluctuation velocities and spins to zero
 *   fix_modify ID damping none|local A|viscous F     (from the next run on)
 *
 * The global state in a restart file is that of all RVEs, contact histories included; parameters are the script's. */
class FixMPMRve : public Fix {
 public:
  FixMPMRve(class LAMMPS *, int, char **);
  ~FixMPMRve();
  int setmask() { return 0; }
  int modify_param(int, char **);
  void write_restart(FILE *);
  void restart(char *);
  double memory_usage();

  /* For fix mpm/couple, whose id is `user`; collective. The first call creates the law for points of atom type `type`
   * and takes the state of a restart file over; later calls take changed properties over. Ends the program on errors.
   */
  void prepare(const char *user, int type, bool thermal);
  /* Gives RVEs to the points that have none; collective. Then does what fix_modify asked for before there were RVEs. */
  void assign(const std::vector<int64_t> &tags);
  /* Once: a warning if a GPU turned out to be too small. Alike on all ranks. */
  void tell_backend();
  RveLaw *law() const { return law_; }
  bool has_state() const { return assigned_; } /* there are RVEs: this run's or a restart file's */
  bool has_bonds() const { return scene_.bonds != 0; }

 private:
  RveScene scene_;
  bool tangential_;
  std::vector<std::string> packing_files_;
  std::vector<RvePacking> packings_;
  RveBackend backend_;
  std::string replay_directory_; /* for packings that become unstable; empty: none */
  RveLaw *law_;
  std::string user_;                /* id of the fix mpm/couple that this law serves */
  std::vector<char> restart_state_; /* from a restart file, until the law exists */
  bool assigned_, install_pending_, rest_pending_;
  double rest_error_; /* keyword rest */
  bool told_backend_;

  void read_keywords(int, char **);
  void check_keywords(const class KeywordParser &);
  void settle_backend();
  void read_damping(class KeywordParser &);
  void read_bonds(class KeywordParser &);
  void read_replay(class KeywordParser &);
  void read_conductivity(class KeywordParser &);
  bool has_model() const;
  void read_packings(double tangential_stiffness);
  void read_properties(RveScene &scene, int type, bool thermal) const;
  void check_dem_time_step(const RveScene &scene) const;
  void carry_out_pending();
};

}  // namespace LAMMPS_NS

#endif
#endif
