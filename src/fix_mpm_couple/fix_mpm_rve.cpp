/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_mpm_rve.h"

#include <unistd.h>

#include <climits>
#include <cmath>
#include <cstring>

#include "../cuda_rve/rve_packing.h"
#include "comm.h"
#include "conduction_keywords.h"
#include "domain.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

/* In front of the state in a restart file. */
struct RestartHeader {
  char magic[8];
  int64_t size; /* bytes of state that follow */
  int32_t install_pending, rest_pending;
};
static const char RESTART_MAGIC[8] = {'m', 'p', 'm', '/', 'r', 'v', 'e', '1'};

static const std::vector<std::string> DAMPINGS = {"none", "local", "viscous"};

FixMPMRve::FixMPMRve(LAMMPS *lammps, int narg, char **arg)
    : Fix(lammps, narg, arg),
      scene_(rve_scene_default()),
      tangential_(true),
      backend_(RVE_BACKEND_AUTO),
      replay_directory_("."),
      law_(NULL),
      assigned_(false),
      install_pending_(false),
      rest_pending_(false),
      rest_error_(0.0),
      told_backend_(false) {
  restart_global = 1;
  scene_.dimension = domain->dimension;
  scene_.reference_temperature = NAN; /* asked for when heat flows */
  read_keywords(narg, arg);
}

FixMPMRve::~FixMPMRve() {
  rve_law_destroy(law_);
  for (RvePacking &packing : packings_) rve_packing_destroy(&packing);
}

void FixMPMRve::read_keywords(int narg, char **arg) {
  std::vector<std::string> keywords = {"packing", "model", "tangential", "density", "grain", "thickness", "damping",
                                       "pipe_resistance", "reference", "bonds", "substeps", "timestep/dem", "skin",
                                       "rotation", "precision", "share", "flight", "rest", "backend", "threads", "replay",
                                       "conductivity"};
  keywords.insert(keywords.end(), CONDUCTION_KEYWORDS.begin(), CONDUCTION_KEYWORDS.end());
  KeywordParser parser(lmp, this, narg, arg, 3, keywords);
  while (parser.next()) {
    if (parser.is("packing")) {
      do packing_files_.push_back(parser.word("the name of a file with a periodic packing"));
      while (parser.has_value());
    } else if (parser.is("model")) parser.choice({"hooke/stiffness"});
    else if (parser.is("tangential")) tangential_ = parser.choice({"off", "history"}) == 1;
    else if (parser.is("density")) scene_.density = parser.number(NumberRange::positive());
    else if (parser.is("grain")) scene_.grain = parser.choice({"disk", "sphere"}) == 0 ? RVE_DISK : RVE_SPHERE;
    else if (parser.is("thickness")) scene_.thickness = parser.number(NumberRange::positive());
    else if (parser.is("damping")) read_damping(parser);
    else if (parser.is("pipe_resistance")) scene_.pipe_resistance = parser.number(NumberRange::positive());
    else if (parser.is("reference")) scene_.reference_temperature = parser.number(NumberRange::any());
    else if (parser.is("bonds")) read_bonds(parser);
    else if (parser.is("substeps")) scene_.substeps = parser.integer(0, 100000000);
    else if (parser.is("timestep/dem")) scene_.time_step = parser.number(NumberRange::positive());
    else if (parser.is("skin")) scene_.skin = parser.number(NumberRange::positive());
    else if (parser.is("rotation")) scene_.rotation = parser.yes_no();
    else if (parser.is("share")) scene_.share = parser.yes_no();
    else if (parser.is("flight")) scene_.flight = parser.yes_no();
    else if (parser.is("rest")) rest_error_ = parser.accept("no") ? 0.0 : parser.number(NumberRange::inside(0.0, 0.1));
    else if (parser.is("precision")) scene_.mixed = parser.choice({"double", "mixed"});
    else if (parser.is("backend"))
      backend_ =
          (RveBackend[]){RVE_BACKEND_AUTO, RVE_BACKEND_CPU, RVE_BACKEND_CUDA}[parser.choice({"auto", "cpu", "cuda"})];
    else if (parser.is("threads")) scene_.threads = parser.integer(0, 4096);
    else if (parser.is("replay")) read_replay(parser);
    else if (parser.is("conductivity")) read_conductivity(parser);
    else read_conduction(parser, scene_.conduction, false);
  }
  check_keywords(parser);
  read_packings(0.0);
}

void FixMPMRve::check_keywords(const KeywordParser &parser) {
  parser.require("packing", "packing FILE [FILE2 ...]");
  parser.require("model", "model hooke/stiffness");
  parser.require("tangential", "tangential history|off");
  parser.require("density", "density RHO, that of the grains' matter, kg/m3");
  if (scene_.dimension == 2) {
    parser.require("grain", "grain disk|sphere (disks fill the thickness, spheres lie in one layer)");
    parser.require("thickness", "thickness Z, the depth that volume and mass of a 2D packing count for, m");
  } else {
    if (parser.given("grain") && scene_.grain == RVE_DISK)
      parser.fail("keyword 'grain': 'disk' is given, allowed is sphere in 3D");
    if (parser.given("thickness")) parser.fail("keyword 'thickness' is for 2D only");
    scene_.grain = RVE_SPHERE;
  }
  check_conduction(parser, scene_.conduction, false);
  if (!has_model()) return;
  parser.exclude("pipe_resistance", "direct");
  parser.exclude("pipe_resistance", "indirect");
  if (grain_heat_check(&scene_.conduction) != BASE_OK) parser.fail(base_error_message());
}

/* One direct or indirect model, in place of heat pipes. */
bool FixMPMRve::has_model() const {
  return scene_.conduction.direct != GRAIN_DIRECT_NONE || scene_.conduction.indirect != GRAIN_INDIRECT_NONE;
}

void FixMPMRve::read_conductivity(KeywordParser &parser) {
  scene_.network = parser.choice({"affine", "network"});
  while (parser.has_value()) {
    if (parser.accept("every")) scene_.conductivity_every = parser.integer(1, 1000000000);
    else if (scene_.network && parser.accept("change"))
      scene_.network_change = parser.number(NumberRange::between(0.0, 0.1));
    else parser.refuse(parser.word(""), scene_.network ? "every N or change E" : "every N");
  }
}

static int rank_on_machine(MPI_Comm world) {
  MPI_Comm machine;
  int rank;
  MPI_Comm_split_type(world, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
  MPI_Comm_rank(machine, &rank);
  MPI_Comm_free(&machine);
  return rank;
}

/* All ranks take a GPU or none: another backend has other last bits, and a packing's answer must not depend on its rank. */
void FixMPMRve::settle_backend() {
  if (backend_ == RVE_BACKEND_CPU) return;
  rve_device_share(rank_on_machine(world));
  int present = rve_device_present(), everywhere;
  MPI_Allreduce(&present, &everywhere, 1, MPI_INT, MPI_MIN, world);
  if (everywhere) return;
  if (backend_ == RVE_BACKEND_CUDA)
    fix_warning(lmp, this, "keyword 'backend': 'cuda' is given, but not every rank has a GPU that answers; the packings run on the CPU");
  backend_ = RVE_BACKEND_CPU;
}

void FixMPMRve::tell_backend() {
  if (told_backend_ || !law_ || !rve_law_left_device(law_)) return;
  fix_warning(lmp, this, "a GPU's memory is too small for its packings, or it could not be opened; all packings go on on the CPU "
                         "(keyword 'backend': 'cpu')");
  told_backend_ = true;
}

void FixMPMRve::read_damping(KeywordParser &parser) {
  scene_.local_damping = scene_.critical_damping = 0.0;
  const int kind = parser.choice(DAMPINGS);
  if (kind == 1) scene_.local_damping = parser.number(NumberRange::from_below(0.0, 1.0));
  if (kind == 2) scene_.critical_damping = parser.number(NumberRange::from_below(0.0, 1.0));
}

void FixMPMRve::read_bonds(KeywordParser &parser) {
  scene_.bonds = 1;
  if (!parser.accept("strength"))
    parser.refuse(parser.has_value() ? parser.word("") : "", "strength B shear_ratio M melting TS|none");
  scene_.bond_strength = parser.number(NumberRange::positive());
  if (!parser.accept("shear_ratio"))
    parser.refuse(parser.has_value() ? parser.word("") : "", "shear_ratio M after strength B");
  scene_.bond_shear_ratio = parser.number(NumberRange::positive());
  if (!parser.accept("melting"))
    parser.refuse(parser.has_value() ? parser.word("") : "", "melting TS|none after shear_ratio M");
  scene_.bond_melting_temperature = parser.accept("none") ? HUGE_VAL : parser.number(NumberRange::any());
}

void FixMPMRve::read_replay(KeywordParser &parser) {
  replay_directory_ = parser.word("none or a directory that exists");
  if (replay_directory_ == "none") replay_directory_.clear();
  else if (access(replay_directory_.c_str(), W_OK | X_OK) != 0)
    parser.refuse(replay_directory_, "none or a directory that exists and can be written to");
}

/* A restart file of LIGGGHTS keeps tangential displacements: without their stiffness (0) contacts start with none, far from
 * equilibrium if the packing was made with friction. */
void FixMPMRve::read_packings(double tangential_stiffness) {
  const std::vector<std::string> &files = packing_files_;
  for (RvePacking &packing : packings_) rve_packing_destroy(&packing);
  packings_.resize(files.size());
  memset(packings_.data(), 0, files.size() * sizeof(RvePacking));
  for (size_t k = 0; k < files.size(); k++) {
    BaseStatus status =
        rve_packing_read_history(files[k].c_str(), scene_.dimension, tangential_stiffness, &packings_[k]);
    if (status == BASE_OK) status = rve_packing_check(&packings_[k]);
    if (status != BASE_OK) base_error_context(status, "keyword 'packing', file %s: ", files[k].c_str());
    fix_check(lmp, this, status);
  }
}

void FixMPMRve::read_properties(RveScene &scene, int type, bool thermal) const {
  const MaterialProperties properties(lmp, this, type);
  scene.normal_stiffness = properties.of_pair("kn", NumberRange::positive());
  scene.tangential_stiffness = tangential_ ? properties.of_pair("kt", NumberRange::at_least(0.0)) : 0.0;
  scene.friction = tangential_ ? properties.of_pair("coefficientFriction", NumberRange::at_least(0.0)) : 0.0;
  scene.normal_viscosity = properties.has("gamman") ? properties.of_pair("gamman", NumberRange::at_least(0.0)) : 0.0;
  scene.tangential_viscosity =
      tangential_ && properties.has("gammat") ? properties.of_pair("gammat", NumberRange::at_least(0.0)) : 0.0;
  scene.thermal = thermal;
  if (!thermal) {
    if (scene.bonds && !std::isinf(scene.bond_melting_temperature))
      fix_failed(lmp, this, "keyword 'bonds': melting bonds need 'thermal yes' in fix mpm/couple, or 'melting none'");
    return;
  }
  scene.expansion = properties.of_type("thermalExpansionCoefficient", NumberRange::at_least(0.0));
  if (has_model()) scene.grain_conductivity = properties.of_type("thermalConductivity", NumberRange::positive());
  else if (std::isnan(scene.pipe_resistance))
    fix_failed(
        lmp, this,
        "keyword 'pipe_resistance' is missing: with 'thermal yes' in fix mpm/couple the resistance of the grains' "
        "heat pipes per length, K/(W m), is needed, or a conduction model (keywords 'direct' and 'indirect')");
  if (std::isnan(scene.reference_temperature))
    fix_failed(lmp, this,
               "keyword 'reference' is missing: with 'thermal yes' in fix mpm/couple the temperature at which the "
               "radii of the "
               "packing hold is needed");
}

void FixMPMRve::check_dem_time_step(const RveScene &scene) const {
  for (const RvePacking &packing : packings_) {
    const double critical = rve_critical_time_step(&scene, &packing);
    if (scene.time_step > critical)
      fix_failed(lmp, this,
                 format_text("keyword 'timestep/dem': '%g' is given, allowed is a number > 0 and <= %g, the critical "
                             "time step of packing %d",
                             scene.time_step, critical, (int)(&packing - packings_.data()) + 1));
  }
}

void FixMPMRve::prepare(const char *user, int type, bool thermal) {
  if (!user_.empty() && user_ != user)
    fix_failed(lmp, this, "serves fix " + user_ + " already; fix " + user + " needs a fix mpm/rve of its own");
  user_ = user;
  RveScene scene = scene_;
  read_properties(scene, type, thermal);
  fix_check(lmp, this, rve_scene_check(&scene));
  check_dem_time_step(scene);
  if (law_) {
    fix_check(lmp, this, rve_law_set_scene(law_, &scene));
    return;
  }
  if (scene.tangential_stiffness > 0.0) read_packings(scene.tangential_stiffness);
  settle_backend();
  fix_check(lmp, this, rve_law_create(world, &scene, packings_.data(), (int)packings_.size(), backend_, &law_));
  rve_law_set_rest(law_, rest_error_);
  fix_check(lmp, this, rve_law_set_replay(law_, replay_directory_.empty() ? NULL : replay_directory_.c_str()));
  if (!restart_state_.empty()) {
    fix_check(lmp, this, rve_law_unpack(law_, restart_state_.data(), restart_state_.size()));
    restart_state_.clear();
    restart_state_.shrink_to_fit();
    RveLawTotals totals; /* none if the restart file was written before the first run */
    fix_check(lmp, this, rve_law_totals(law_, &totals));
    assigned_ = totals.rves > 0;
  }
}

void FixMPMRve::assign(const std::vector<int64_t> &tags) {
  fix_check(lmp, this, rve_law_assign(law_, (int)tags.size(), tags.data()));
  assigned_ = true;
  carry_out_pending();
  tell_backend();
}

void FixMPMRve::carry_out_pending() {
  if (!assigned_) return;
  if (install_pending_) fix_check(lmp, this, rve_law_install_bonds(law_));
  if (rest_pending_) fix_check(lmp, this, rve_law_rest(law_));
  install_pending_ = rest_pending_ = false;
}

/* LIGGGHTS passes the rest of the line and wants to know how many words were used: all, as the parser refuses others.
 */
int FixMPMRve::modify_param(int narg, char **arg) {
  KeywordParser parser(lmp, this, narg, arg, 0, {"bonds", "rest", "damping"});
  while (parser.next()) {
    if (parser.is("bonds")) {
      parser.choice({"install"});
      if (!scene_.bonds)
        parser.fail(
            "keyword 'bonds': the fix was defined without bonds; add 'bonds strength B shear_ratio M melting TS|none'");
      install_pending_ = true;
    } else if (parser.is("rest")) rest_pending_ = true;
    else if (parser.is("damping")) read_damping(parser); /* taken over by the next run's init */
  }
  carry_out_pending();
  return narg;
}

/* Collective, though only rank 0 writes. */
void FixMPMRve::write_restart(FILE *file) {
  void *bytes = NULL;
  size_t size = 0;
  if (law_) fix_check(lmp, this, rve_law_pack(law_, &bytes, &size));
  else if (comm->me == 0) size = restart_state_.size();
  BaseStatus status = BASE_OK;
  if (size + sizeof(RestartHeader) > INT_MAX)
    status = base_error(
        BASE_ERROR_MEMORY,
        "the RVEs' state of %zu bytes does not fit into a LIGGGHTS restart file, which allows %d bytes per fix", size,
        INT_MAX);
  fix_check(lmp, this, status);
  if (comm->me == 0) {
    RestartHeader header = {{}, (int64_t)size, install_pending_, rest_pending_};
    memcpy(header.magic, RESTART_MAGIC, sizeof header.magic);
    const int total = (int)(size + sizeof header);
    fwrite(&total, sizeof total, 1, file);
    fwrite(&header, sizeof header, 1, file);
    fwrite(law_ ? bytes : restart_state_.data(), 1, size, file);
  }
  base_free(bytes);
}

void FixMPMRve::restart(char *bytes) {
  RestartHeader header;
  memcpy(&header, bytes, sizeof header);
  if (memcmp(header.magic, RESTART_MAGIC, sizeof header.magic) != 0 || header.size < 0 || header.size > INT_MAX)
    fix_failed(lmp, this, "the restart file holds no state of this fix, or one of another version");
  restart_state_.assign(bytes + sizeof header, bytes + sizeof header + header.size);
  install_pending_ = header.install_pending;
  rest_pending_ = header.rest_pending;
}

double FixMPMRve::memory_usage() { return (double)restart_state_.size(); }
