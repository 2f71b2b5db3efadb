/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Files for ParaView and examples/plot.py: one RVE (grains, force network, cell) and the background grid, through the
 * VTK library, each with a .pvd time series.
 *
 * A series file is replaced in one move (temporary name, then rename): a reader sees the old or the new one, whole.
 * Entries of earlier times stay, those at or after `time` give way: a run that starts again from a restart file
 * continues its series. All functions: BASE_ERROR_FILE with the path and the reason. */
#ifndef DEMPM_VTK_WRITER_H
#define DEMPM_VTK_WRITER_H

#include <mpi.h>

#include "../cuda_rve/rve.h"
#include "../mpm/mpm.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Writes <prefix>_<tag>_<step>.vtm (blocks in a directory of the same name) and renews <prefix>_<tag>.pvd. Not
 * collective: call it on one rank. Blocks: "grains" points with radius [m], velocity [m/s], spin [rad/s]; "contacts"
 * lines with force_normal [N, repulsion positive], force_shear [N, vector on the first grain], bond [1 = intact],
 * contact (its number; a contact across the cell's boundary is two half lines of one number); "cell" its
 * edge polygon (2D) or faces (3D). */
BaseStatus vtk_write_rve(const char *prefix, int64_t step, double time, int64_t tag, const RveView *view);

/* Writes <prefix>_grid_<step>.vtu: the active nodes of all ranks with mass [kg], velocity [m/s], temperature (if there
 * is one) and the grid cells between them; renews <prefix>_grid.pvd. Collective over comm; the same file for every
 * number of ranks. origin [3] in m, as in MpmScene. */
BaseStatus vtk_write_grid(MPI_Comm comm, const char *prefix, int64_t step, double time, const MpmGridView *view,
                          const double origin[3]);

/* Adds `file` (an existing file, in the directory of `series`) at `time` to the .pvd file `series`. */
BaseStatus vtk_series_add(const char *series, double time, const char *file);

#ifdef __cplusplus
}
#endif
#endif
