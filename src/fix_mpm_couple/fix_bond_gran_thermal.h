/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(bond/gran/thermal,FixBondGranThermal)

/* clang-format on */
#else

#ifndef LMP_FIX_BOND_GRAN_THERMAL_H
#define LMP_FIX_BOND_GRAN_THERMAL_H

#include <vector>

#include "../grain_bond/grain_bond.h"
#include "fix.h"

namespace LAMMPS_NS {

/* Bonds between the particles of a group (pair_style gran) whose strength falls with temperature.
 *
 *   fix ID group bond/gran/thermal strength B shear_ratio M melting TS|none [reference T0] [gap G]
 *   fix_modify ID bonds install
 *
 * Both grains of a bond know it, each with the tangential spring as it sees it; each rank moves its own grains. The
 * pair style goes on to act between bonded grains that touch: its tangential spring is kept at zero, as it would slip,
 * and this fix adds its own. All that happens before the pair style, so that fixes which change forces (freeze,
 * enforce2d) come later wherever they stand in the script.
 *
 * Scalar: intact bonds over those made. Vector: see Count. Per grain: its intact bonds. */
class FixBondGranThermal : public Fix {
 public:
  FixBondGranThermal(class LAMMPS *, int, char **);
  ~FixBondGranThermal();
  int setmask();
  void init();
  void setup_pre_force(int);
  void pre_force(int);
  bool holds(int i, int j) const; /* grain i of this rank and its neighbour j are bonded */
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
  void restart(char *);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);

 private:
  /* What the partner's rank has to learn of a bond; the ends of bonds as in GrainBondEnd. */
  enum News { NONE = GRAIN_BOND_HOLDS, MADE = GRAIN_BOND_MELTED + 1, NEWS };
  enum { WORDS = 4 }; /* bonds of a grain that one message tells of */
  /* The vector: bonds made, intact, ended by tension, shear and melting, J of intact and J of ended bonds. */
  enum Count { BONDS_MADE, BONDS_INTACT, PULLED, SHEARED, MELTED, ENERGY, RELEASED, COUNTS };
  /* A bond as one of its grains knows it. */
  struct Bond {
    int partner; /* tag */
    GrainBond bond;
    /* until the next neighbour list: */
    int other;       /* index of the partner's image next to the grain */
    bool listed;     /* the pair style acts between the two where they touch */
    double *history; /* its tangential spring, NULL if it has none */
    double sign;     /* of that spring, which is seen from one of the two grains */
    int news;
    GrainBondState state; /* of this step */
    GrainBondSprings springs;
  };
  struct Message { /* to a grain of this rank */
    int grain, partner, news;
  };
  struct PairSprings {
    double normal, tangential, gamman, gammat; /* N/m, 1/s */
  };

  GrainBondLaw law_;
  double gap_; /* m: surfaces may be that far apart when bonds are made */
  bool install_pending_;
  class PairGran *pair_;
  std::vector<std::vector<Bond>> bonds_; /* by grain */
  std::vector<PairSprings> springs_;     /* by pair of types */
  double count_[COUNTS];                 /* of this rank; of all, on rank 0, after a restart */
  class FixPropertyAtom *temperature_;
  class FixHeatGranGrain *heat_; /* whose frictional heat must not count what bonds do, or NULL */
  int round_;                    /* of messages to partners */
  std::vector<Message> heard_;
  int grown_;                    /* length of vector_atom */
  int types_;                    /* rows of springs_; row and column 0 are unused */

  void read_springs();
  void find_temperature();
  void find_images();
  void forget_removed(int missing);
  void find_contacts();
  void install();
  Bond *add_bond(int i, int j);
  void find_contact(int i, int j, double *history, double sign);
  Bond *find_bond(int i, int partner);
  GrainMotion motion_of(int i, int j) const;
  void find_springs(int i, Bond &bond) const;
  double effective_mass(int i, int j) const;
  void advance(int i, double step);
  void tell_partners();
  void hear(const Message &message);
  void end_bonds(int i);
  void end_bond(Bond &bond);
  void hold(int i, Bond &bond, double step);
  void heat_by_dashpots(int i, const Bond &bond, double step) const;
  bool shared(const Bond &bond) const { return bond.listed && bond.state.overlap > 0.0; }
};

}  // namespace LAMMPS_NS

#endif
#endif
