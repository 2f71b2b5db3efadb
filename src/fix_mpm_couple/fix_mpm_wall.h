/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(mpm/wall,FixMPMWall)

/* clang-format on */
#else

#ifndef LMP_FIX_MPM_WALL_H
#define LMP_FIX_MPM_WALL_H

#include <string>
#include <vector>

#include "../mpm/mpm.h"
#include "fix.h"

namespace LAMMPS_NS {

/* A wall for the material points of a fix mpm/couple; removed by `unfix`. The group is not used.
 *
 *   fix ID group mpm/wall MPMFIXID plane x|y|z POS | box x0 x1 y0 y1 [z0 z1] | segment x0 y0 x1 y1 [x2 y2 ...] |
 *       mesh MESHFIXID
 *       [noslip | slip | friction MU | nocontact] [glued] [temperature T | flux Q] [velocity vx vy vz] [side +|-]
 *       [within x0 x1 y0 y1 [z0 z1]]
 *
 * A plane holds the points on one side, which is that of all points when a run starts unless `side` names it; a box
 * holds them outside. A chain of segments (2D) and a mesh (3D; a fix mesh/surface of LIGGGHTS, which `fix move/mesh`
 * may move) are thin and hold points on both sides, or as a plane on one `side`: the left of the way from the first to
 * the last corner, the front of the triangles. Default contact: slip (frictionless, the points may lift off unless
 * `glued`). `nocontact`: heat only. `flux`: W/m2 into the body. `within` limits the wall to grid nodes inside a box
 * (INF: no limit) that does not move with the wall.
 *
 * Global vector; in 2D forces, powers and energies are per metre of depth:
 *   1-3   force of the wall on the body in the last step, N
 *   4     power lost to wall friction in the last step, W
 *   5     heat flow into the body in the last step, W
 *   6     work lost to wall friction, J      }
 *   7     heat into the body, J              } since the definition
 *   8     work done on the body by the       }
 *         wall's motion, J                   }
 *   9-11  displacement of the wall, m; 0 of a mesh
 * In restart files: displacement, side and sums. */
class FixMPMWall : public Fix {
 public:
  FixMPMWall(class LAMMPS *, int, char **);
  int setmask() { return 0; }
  void init();
  double compute_vector(int);
  void write_restart(FILE *);
  void restart(char *);

  /* For fix mpm/couple. */
  const std::string &mpm_id() const { return mpm_id_; }
  /* Start of a run; collective. low, high: bounds of all points, low > high without points. */
  void begin_run(bool thermal, const double low[3], const double high[3]);
  /* The wall as it stands at the start of the step that begins, or, with dt > 0, of the step of dt that LIGGGHTS has
   * moved meshes through. Collective. The facets stay this fix's, until the next call. */
  MpmWall present(double dt);
  /* By what a grid that ends at this plane has been stretched along the plane's axis since the wall was defined; 0: no plane. */
  double stretch(const double origin[3], int &axis) const;
  /* Where the plane was defined, along its axis. */
  double first_position() const { return wall_.point[axis_]; }
  /* Takes the answers of a step over and moves on by dt. */
  void end_step(const MpmWall &answered, double dt);

  enum { REACTION = 0, FRICTION_POWER = 3, HEAT_FLOW, FRICTION_WORK, HEAT, WORK, SUMS };

 private:
  std::string mpm_id_;
  MpmWall wall_; /* as defined */
  int axis_;     /* of a plane; -1: box */
  int side_;     /* +1, -1; 0: not known yet */
  std::string mesh_id_; /* empty: no mesh */
  class FixMeshSurface *mesh_ = NULL;
  std::vector<MpmFacet> facets_;         /* of segments, as defined; of a mesh, when its rim was found */
  std::vector<MpmFacet> present_facets_;
  double displacement_[3];
  double sums_[SUMS]; /* this rank's part */

  void read_shape(class KeywordParser &);
  void read_box(class KeywordParser &, bool infinite, double low[3], double high[3]);
  void read_segments(class KeywordParser &);
  void check_keywords(const class KeywordParser &);
  void find_mesh();
  void prepare_facets();
  std::vector<MpmFacet> gather_mesh(double dt);
  void move_facets(double dt);
  void find_side(const double low[3], const double high[3]);
};

}  // namespace LAMMPS_NS

#endif
#endif
