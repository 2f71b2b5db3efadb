/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_mpm_wall.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "comm.h"
#include "domain.h"
#include "fix_mesh_surface.h"
#include "fix_mpm_couple.h"
#include "keyword_parser.h"
#include "modify.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

static const char AXES[] = "xyz";
static const std::vector<std::string> CONTACTS = {"noslip", "slip", "friction", "nocontact"};

/* The whole restart record of a wall. */
struct WallRecord {
  char magic[8];
  int64_t side;
  double displacement[3], sums[FixMPMWall::SUMS];
};
static const char RECORD_MAGIC[8] = {'m', 'p', 'm', 'w', 'a', 'l', 'l', '1'};

FixMPMWall::FixMPMWall(LAMMPS *lammps, int narg, char **arg)
    : Fix(lammps, narg, arg), wall_(mpm_wall_default()), axis_(-1), side_(0), displacement_{}, sums_{} {
  if (narg < 4) fix_failed(lmp, this, "the id of a fix mpm/couple is missing");
  mpm_id_ = arg[3];
  vector_flag = 1;
  size_vector = SUMS + 3;
  global_freq = 1;
  extvector = 0;
  restart_global = 1;
  wall_.contact = MPM_WALL_SLIP;

  KeywordParser parser(lmp, this, narg, arg, 4,
                       {"plane", "box", "segment", "mesh", "noslip", "slip", "friction", "nocontact", "glued",
                        "temperature", "flux", "velocity", "side", "within"});
  while (parser.next()) {
    if (parser.is("plane") || parser.is("box") || parser.is("segment") || parser.is("mesh")) read_shape(parser);
    else if (parser.is("noslip")) wall_.contact = MPM_WALL_NO_SLIP;
    else if (parser.is("slip")) wall_.contact = MPM_WALL_SLIP;
    else if (parser.is("nocontact")) wall_.contact = MPM_WALL_NO_CONTACT;
    else if (parser.is("friction"))
      wall_.contact = MPM_WALL_FRICTION, wall_.friction = parser.number(NumberRange::at_least(0.0));
    else if (parser.is("glued")) wall_.separable = 0;
    else if (parser.is("temperature"))
      wall_.heat = MPM_WALL_TEMPERATURE, wall_.temperature = parser.number(NumberRange::any());
    else if (parser.is("flux")) wall_.heat = MPM_WALL_FLUX, wall_.flux = parser.number(NumberRange::any());
    else if (parser.is("velocity"))
      for (double &v : wall_.velocity) v = parser.number(NumberRange::any());
    else if (parser.is("side")) side_ = parser.choice({"-", "+"}) == 1 ? 1 : -1;
    else if (parser.is("within")) read_box(parser, true, wall_.range[0], wall_.range[1]);
  }
  check_keywords(parser);
}

void FixMPMWall::check_keywords(const KeywordParser &parser) {
  static const std::vector<std::string> SHAPES = {"plane", "box", "segment", "mesh"};
  for (const std::vector<std::string> *words : {&SHAPES, &CONTACTS})
    for (size_t a = 0; a < words->size(); a++)
      for (size_t b = a + 1; b < words->size(); b++) parser.exclude((*words)[a].c_str(), (*words)[b].c_str());
  if (wall_.kind == MPM_WALL_PLANE)
    parser.require("plane", "plane x|y|z POS, box x0 x1 y0 y1 [z0 z1], segment x0 y0 x1 y1 ... or mesh FIX-ID");
  parser.exclude("temperature", "flux");
  parser.exclude("glued", "noslip");
  parser.exclude("glued", "nocontact");
  parser.exclude("box", "side");
  if (parser.given("mesh") && parser.given("velocity"))
    parser.fail("keywords 'mesh' and 'velocity' cannot be given together: a mesh moves by fix move/mesh");
  if (domain->dimension == 2 && wall_.velocity[2] != 0.0) parser.fail("keyword 'velocity': vz must be 0 in 2D");
  if (parser.given("nocontact") && wall_.heat == MPM_WALL_ADIABATIC)
    parser.fail("keyword 'nocontact' without 'temperature' or 'flux': the wall would do nothing");
  if (wall_.kind == MPM_WALL_SURFACE && side_ != 0) wall_.sides = side_ > 0 ? MPM_SIDE_FRONT : MPM_SIDE_BACK;
}

void FixMPMWall::init() { FixMPMCouple::find(lmp, this, mpm_id_); }

/* The mesh may have been removed, or defined anew, between runs. */
void FixMPMWall::find_mesh() {
  const int found = modify->find_fix(mesh_id_.c_str());
  if (found < 0)
    fix_failed(lmp, this, "keyword 'mesh': there is no fix with ID " + mesh_id_ + "; define a fix mesh/surface");
  mesh_ = dynamic_cast<FixMeshSurface *>(modify->fix[found]);
  if (!mesh_)
    fix_failed(lmp, this, "keyword 'mesh': fix " + mesh_id_ + " is of style " + modify->fix[found]->style +
                              ", allowed is mesh/surface");
}

void FixMPMWall::read_shape(KeywordParser &parser) {
  if (parser.is("box")) {
    wall_.kind = MPM_WALL_BOX;
    read_box(parser, false, wall_.low, wall_.high);
    return;
  }
  if (parser.is("segment")) return read_segments(parser);
  if (parser.is("mesh")) {
    if (domain->dimension == 2) parser.fail("keyword 'mesh' is for 3D; use 'segment' in 2D");
    wall_.kind = MPM_WALL_SURFACE;
    mesh_id_ = parser.word("the ID of a fix mesh/surface");
    return;
  }
  wall_.kind = MPM_WALL_PLANE;
  axis_ = parser.choice({"x", "y", "z"});
  if (axis_ >= domain->dimension) parser.refuse("z", "x or y in 2D");
  wall_.point[axis_] = parser.number(NumberRange::any());
}

void FixMPMWall::read_segments(KeywordParser &parser) {
  if (domain->dimension == 3) parser.fail("keyword 'segment' is for 2D; use 'mesh' with a fix mesh/surface in 3D");
  wall_.kind = MPM_WALL_SURFACE;
  double corner[2][3] = {};
  for (int n = 0; n < 2 || parser.has_value(); n++) {
    memcpy(corner[0], corner[1], sizeof corner[0]);
    for (int i = 0; i < 2; i++) corner[1][i] = parser.number(NumberRange::any());
    if (n == 0) continue;
    if (corner[0][0] == corner[1][0] && corner[0][1] == corner[1][1])
      parser.refuse(format_text("%g %g %g %g", corner[0][0], corner[0][1], corner[1][0], corner[1][1]),
                    "a segment whose ends differ");
    MpmFacet facet = {};
    memcpy(facet.node, corner, sizeof corner);
    facets_.push_back(facet);
  }
}

void FixMPMWall::read_box(KeywordParser &parser, bool infinite, double low[3], double high[3]) {
  for (int i = 0; i < domain->dimension; i++) {
    low[i] = infinite ? parser.number_or_infinity(-1) : parser.number(NumberRange::any());
    high[i] = infinite ? parser.number_or_infinity(1) : parser.number(NumberRange::any());
    if (!(low[i] < high[i]))
      parser.refuse(format_text("%c0 %g %c1 %g", AXES[i], low[i], AXES[i], high[i]),
                    format_text("%c0 < %c1", AXES[i], AXES[i]));
  }
  if (domain->dimension == 2) low[2] = -HUGE_VAL, high[2] = HUGE_VAL;
}

void FixMPMWall::find_side(const double low[3], const double high[3]) {
  if (axis_ < 0 || side_ != 0 || low[axis_] > high[axis_]) return;
  const double position = present(0.0).point[axis_];
  if (low[axis_] >= position) side_ = 1;
  else if (high[axis_] <= position) side_ = -1;
  else
    fix_failed(lmp, this,
               format_text(
                   "keyword 'side' is missing: plane %c = %g has points on both sides (%g to %g); add side + or side -",
                   AXES[axis_], position, low[axis_], high[axis_]));
}

void FixMPMWall::begin_run(bool thermal, const double low[3], const double high[3]) {
  if (!thermal && wall_.heat != MPM_WALL_ADIABATIC)
    fix_failed(lmp, this,
               format_text("keyword '%s' needs 'thermal yes' in fix %s",
                           wall_.heat == MPM_WALL_FLUX ? "flux" : "temperature", mpm_id_.c_str()));
  if (!mesh_id_.empty()) find_mesh(), facets_ = gather_mesh(0.0);
  for (MpmFacet &facet : facets_)
    for (int n = 0; n < 2 && !mesh_; n++) memcpy(facet.velocity[n], wall_.velocity, sizeof facet.velocity[n]);
  if (wall_.kind == MPM_WALL_SURFACE) prepare_facets();
  find_side(low, high);
  const MpmWall wall = present(0.0);
  fix_check(lmp, this, mpm_wall_check(&wall, domain->dimension, thermal));
}

/* A triangle as ranks exchange it. */
struct MeshTriangle {
  double id, node[3][3], velocity[3][3];
  bool operator<(const MeshTriangle &other) const { return id < other.id; }
};

/* The mesh is spread over the ranks (before its first run all ranks have all of it); facets are the same on all ranks,
 * in the order of the triangles' ids. dt > 0: where a moving mesh was dt earlier. Collective. */
std::vector<MpmFacet> FixMPMWall::gather_mesh(double dt) {
  TriMesh *mesh = mesh_->triMesh();
  typedef MultiVectorContainer<double, 3, 3> NodeVectors;
  NodeVectors *velocity = mesh->prop().getElementProperty<NodeVectors>("v");
  std::vector<MeshTriangle> own(mesh->sizeLocal());
  for (size_t k = 0; k < own.size(); k++) {
    own[k].id = mesh->id((int)k);
    for (int n = 0; n < 3; n++) {
      mesh->node((int)k, n, own[k].node[n]);
      for (int i = 0; i < 3; i++) {
        own[k].velocity[n][i] = velocity ? velocity->begin()[k][n][i] : 0.0;
        if (mesh->isMoving()) own[k].node[n][i] -= dt * own[k].velocity[n][i];
      }
    }
  }
  const int width = sizeof(MeshTriangle) / sizeof(double), mine = width * (int)own.size();
  std::vector<int> count(comm->nprocs), first(comm->nprocs);
  MPI_Allgather(&mine, 1, MPI_INT, count.data(), 1, MPI_INT, world);
  int total = 0;
  for (int r = 0; r < comm->nprocs; r++) first[r] = total, total += count[r];
  std::vector<MeshTriangle> all(total / width);
  MPI_Allgatherv(own.data(), mine, MPI_DOUBLE, all.data(), count.data(), first.data(), MPI_DOUBLE, world);
  std::stable_sort(all.begin(), all.end());
  std::vector<MpmFacet> facets;
  for (size_t k = 0; k < all.size(); k++) {
    if (k > 0 && all[k].id == all[k - 1].id) continue;
    MpmFacet facet = {};
    memcpy(facet.node, all[k].node, sizeof facet.node);
    memcpy(facet.velocity, all[k].velocity, sizeof facet.velocity);
    facets.push_back(facet);
  }
  if (facets.empty()) fix_failed(lmp, this, "keyword 'mesh': no triangle of fix " + mesh_id_ + " is in the box");
  return facets;
}

void FixMPMWall::prepare_facets() {
  fix_check(lmp, this, mpm_facets_prepare(facets_.data(), (int)facets_.size(), domain->dimension));
}

void FixMPMWall::move_facets(double dt) {
  if (mesh_ && dt > 0.0) {
    if (!mesh_->triMesh()->isMoving()) return;
    present_facets_ = gather_mesh(dt);
    if (present_facets_.size() != facets_.size()) facets_ = present_facets_, prepare_facets(); /* some left the box */
    for (size_t k = 0; k < facets_.size(); k++) {
      present_facets_[k].free_nodes = facets_[k].free_nodes;
      present_facets_[k].free_edges = facets_[k].free_edges;
    }
    fix_check(lmp, this, mpm_facets_turn(present_facets_.data(), (int)present_facets_.size(), domain->dimension));
    return;
  }
  present_facets_ = facets_;
  if (mesh_) return;
  for (MpmFacet &facet : present_facets_)
    for (int n = 0; n < 2; n++)
      for (int i = 0; i < 2; i++) facet.node[n][i] += displacement_[i];
}

MpmWall FixMPMWall::present(double dt) {
  MpmWall wall = wall_;
  wall.heat_flow = sums_[HEAT_FLOW]; /* holds between thermal steps */
  if (wall_.kind == MPM_WALL_SURFACE) {
    move_facets(dt);
    wall.facets = present_facets_.data();
    wall.facet_count = (int)present_facets_.size();
    return wall;
  }
  for (int i = 0; i < 3; i++) {
    wall.point[i] += displacement_[i];
    wall.low[i] += displacement_[i];
    wall.high[i] += displacement_[i];
  }
  if (axis_ >= 0) {
    for (double &n : wall.normal) n = 0.0;
    wall.normal[axis_] = side_ < 0 ? -1.0 : 1.0;
  }
  return wall;
}

double FixMPMWall::stretch(const double origin[3], int &axis) const {
  axis = axis_;
  if (wall_.kind != MPM_WALL_PLANE) return 0.0;
  const double first = wall_.point[axis_] - origin[axis_];
  return (first + displacement_[axis_]) / first;
}

void FixMPMWall::end_step(const MpmWall &answered, double dt) {
  for (int i = 0; i < 3; i++) {
    sums_[REACTION + i] = answered.reaction[i];
    displacement_[i] += dt * wall_.velocity[i];
  }
  sums_[FRICTION_POWER] = answered.power_friction;
  sums_[HEAT_FLOW] = answered.heat_flow;
  sums_[FRICTION_WORK] += dt * answered.power_friction;
  sums_[HEAT] += dt * answered.heat_flow;
  sums_[WORK] += dt * answered.power_motion;
}

double FixMPMWall::compute_vector(int k) {
  if (k >= SUMS) return displacement_[k - SUMS];
  double sum;
  MPI_Allreduce(&sums_[k], &sum, 1, MPI_DOUBLE, MPI_SUM, world);
  return sum;
}

/* Collective: the sums are spread over the ranks. */
void FixMPMWall::write_restart(FILE *file) {
  WallRecord record;
  memcpy(record.magic, RECORD_MAGIC, sizeof record.magic);
  record.side = side_;
  memcpy(record.displacement, displacement_, sizeof displacement_);
  MPI_Allreduce(sums_, record.sums, SUMS, MPI_DOUBLE, MPI_SUM, world);
  if (comm->me != 0) return;
  const int size = sizeof record;
  fwrite(&size, sizeof size, 1, file);
  fwrite(&record, sizeof record, 1, file);
}

void FixMPMWall::restart(char *bytes) {
  WallRecord record;
  memcpy(&record, bytes, sizeof record);
  if (memcmp(record.magic, RECORD_MAGIC, sizeof record.magic) != 0)
    fix_failed(lmp, this, "the restart file holds no state of this fix, or one of another version");
  side_ = (int)record.side;
  memcpy(displacement_, record.displacement, sizeof displacement_);
  for (int k = 0; k < SUMS; k++) sums_[k] = comm->me == 0 ? record.sums[k] : 0.0;
}
