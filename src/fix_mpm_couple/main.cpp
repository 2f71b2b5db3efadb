/* SPDX-License-Identifier: GPL-2.0-or-later */
/* dempm: LIGGGHTS with the styles of this directory. Command line, scripts and signals are those of liggghts. */
#include <dlfcn.h>
#include <mpi.h>
#include <signal.h>
#include <string.h>

#include "input.h"
#include "lammps.h"
#include "signal_handling.h"
#include "style_registry.h"

using namespace LAMMPS_NS;

/* LIGGGHTS' library calls this whenever it has made its classes: at start and after the command `clear`, which puts a
 * new Modify (without our styles) in place of the old one. The definition here takes precedence over the library's. */
void LAMMPS::post_create() {
  typedef void (*PostCreate)(LAMMPS *);
  const PostCreate original = (PostCreate)dlsym(RTLD_NEXT, "_ZN9LAMMPS_NS6LAMMPS11post_createEv");
  if (original) original(this);
  register_styles(this);
}

static void handle(int number, void (*handler)(int)) {
  struct sigaction action;
  memset(&action, 0, sizeof action);
  action.sa_handler = handler;
  sigaction(number, &action, NULL);
}

int main(int argc, char **argv) {
  handle(SIGINT, SignalHandler::int_handler);
  handle(SIGTERM, SignalHandler::int_handler); /* what Open MPI makes of an interrupted mpirun */
  handle(SIGUSR1, SignalHandler::usr1_handler);

  int provided;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  LAMMPS *lammps = new LAMMPS(argc, argv, MPI_COMM_WORLD);
  register_styles(lammps);
  lammps->input->file();
  delete lammps;
  MPI_Finalize();
}
