# SPDX-License-Identifier: GPL-2.0-or-later
# Installs these fixes as a package in a LIGGGHTS source tree; mode = 0/1/2 for uninstall/install/update.
#
#   make NVCC=                                           # in dempm: build/libdempm.a (without CUDA)
#   ln -s DEMPM/src/fix_mpm_couple LIGGGHTS/src/DEMPM    # absolute path of dempm
#   cd LIGGGHTS/src && make yes-dempm && make mpi
#
# LIGGGHTS compiles the fixes itself; the plain C below them (MPM core, RVE engine, conduction of grains) and the
# VTK writer come from libdempm.a. Without VTK 9 on the machine fix mpm/vtk is left out.

mode=$1

# `cd` and not `..`: this directory may be reached by a symbolic link.
here=$(pwd -P)
target=$(cd .. && pwd)
library=$(cd "$here/../.." && pwd)/build
vtk=$(ls -d /usr/include/vtk-9* 2>/dev/null | head -1)
vtk_version=${vtk##*/vtk-}

files="conduction_keywords.cpp conduction_keywords.h double_sum.h fix_bond_gran_arrays.cpp fix_bond_gran_thermal.cpp
  fix_bond_gran_thermal.h fix_expansion_gran.cpp fix_expansion_gran.h fix_heat_gran_grain.cpp fix_heat_gran_grain.h
  fix_heat_gran_history.cpp fix_heat_gran_tables.cpp fix_heat_rest.cpp fix_heat_rest.h fix_mpm_couple.cpp
  fix_mpm_couple.h fix_mpm_couple_arrays.cpp fix_mpm_couple_heat.cpp fix_mpm_couple_output.cpp fix_mpm_couple_step.cpp
  fix_mpm_rve.cpp fix_mpm_rve.h fix_mpm_traction.cpp fix_mpm_traction.h fix_mpm_wall.cpp fix_mpm_wall.h heat_walls.cpp
  heat_walls.h heat_walls_springs.cpp keyword_parser.cpp keyword_parser.h liggghts_walls.h material_properties.cpp
  material_properties.h point_output.cpp point_output.h rank_error.cpp rank_error.h restart_seal.cpp restart_seal.h"
vtk_files="fix_mpm_vtk.cpp fix_mpm_vtk.h"

if test $mode = 0; then
  for file in $files $vtk_files; do rm -f "$target/$file"; done
else
  test -n "$vtk" && files="$files $vtk_files"
  for file in $files; do
    cmp -s "$here/$file" "$target/$file" || cp "$here/$file" "$target"
  done
fi

# Paths and libraries in LIGGGHTS' Makefile.package: old ones out, new ones in.
package="$target/Makefile.package"
test -e "$package" || exit 0
sed -i -e 's/-I[^ \t]*fix_mpm_couple //g' -e 's/-L[^ \t]* -ldempm //g' -e 's/-fopenmp -lm //g' -e 's/-lvtk[^ \t]*-9[^ \t]* //g' \
  "$package"
test $mode = 0 && exit 0

test -e "$library/libdempm.a" || echo "  $library/libdempm.a is missing: run 'make' in dempm before LIGGGHTS is linked"
vtk_libraries=
if test -n "$vtk"; then
  for name in IOXML IOXMLParser IOCore CommonExecutionModel CommonDataModel CommonTransforms CommonMath CommonMisc \
              CommonSystem CommonCore sys; do
    vtk_libraries="$vtk_libraries-lvtk$name-$vtk_version "
  done
fi
sed -i -e "s|^PKG_INC =[ \t]*|&-I$here |" -e "s|^PKG_LIB =[ \t]*|&-L$library -ldempm |" \
       -e "s|^PKG_SYSLIB =[ \t]*|&$vtk_libraries-fopenmp -lm |" "$package"
