/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the VTK writer wrote is read back by the VTK library and compared. */
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <unistd.h>

extern "C" {
#include <cmocka.h>
}

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLMultiBlockDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include "fix_mpm_couple/vtk_writer.h"

static int rank, ranks;

/* Three disks in a sheared cell; contact 1 leaves the cell through its right side. */
static double position[9] = {-0.4, 0.1, 0, 0.1, 0.1, 0, 0.45, -0.3, 0}, radius[3] = {0.25, 0.26, 0.1};
static double velocity[9] = {1, 2, 0, 3, 4, 0, 5, 6, 0}, spin[9] = {0, 0, 1, 0, 0, 2, 0, 0, 3};
static double branch[6] = {0.5, 0, 0, 0.5, 0, 0}, force_normal[2] = {7, 8}, force_shear[6] = {0, 9, 0, 0, -10, 0};
static int pair[4] = {0, 1, 1, 0}, image[6] = {0, 0, 0, 1, 0, 0}, bond[2] = {0, 1};

static RveView example() {
  RveView view = {};
  view.grains = 3, view.position = position, view.radius = radius, view.velocity = velocity, view.spin = spin;
  const double cell[9] = {1, 0.2, 0, 0, 1, 0, 0, 0, 1};
  for (int k = 0; k < 9; k++) view.cell[k] = cell[k];
  view.contacts = 2, view.pair = pair, view.image = image, view.branch = branch;
  view.force_normal = force_normal, view.force_shear = force_shear, view.bond = bond;
  return view;
}

static std::string text_of(const std::string &path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

static void grains_contacts_and_cell_come_back_as_written(void **) {
  if (rank != 0) return;
  const RveView view = example();
  assert_int_equal(vtk_write_rve("rve", 40, 0.25, 17, &view), BASE_OK);
  vtkNew<vtkXMLMultiBlockDataReader> reader;
  reader->SetFileName("rve_17_40.vtm");
  reader->Update();
  vtkMultiBlockDataSet *blocks = vtkMultiBlockDataSet::SafeDownCast(reader->GetOutput());
  assert_int_equal(blocks->GetNumberOfBlocks(), 3);
  vtkPolyData *grains = vtkPolyData::SafeDownCast(blocks->GetBlock(0));
  vtkPolyData *contacts = vtkPolyData::SafeDownCast(blocks->GetBlock(1));
  vtkPolyData *cell = vtkPolyData::SafeDownCast(blocks->GetBlock(2));
  assert_int_equal(grains->GetNumberOfPoints(), 3);
  for (int i = 0; i < 3; i++) { /* doubles are stored as such: equal, not near */
    assert_true(grains->GetPointData()->GetArray("radius")->GetTuple1(i) == radius[i]);
    for (int k = 0; k < 3; k++) {
      assert_true(grains->GetPoint(i)[k] == position[3 * i + k]);
      assert_true(grains->GetPointData()->GetArray("velocity")->GetComponent(i, k) == velocity[3 * i + k]);
      assert_true(grains->GetPointData()->GetArray("spin")->GetComponent(i, k) == spin[3 * i + k]);
    }
  }
  /* One whole line and two halves of the contact across the boundary. */
  assert_int_equal(contacts->GetNumberOfLines(), 3);
  const double expected_force[3] = {7, 8, 8}, expected_bond[3] = {0, 1, 1};
  for (int c = 0; c < 3; c++) {
    assert_true(contacts->GetCellData()->GetArray("force_normal")->GetTuple1(c) == expected_force[c]);
    assert_true(contacts->GetCellData()->GetArray("bond")->GetTuple1(c) == expected_bond[c]);
  }
  assert_true(contacts->GetCellData()->GetArray("force_shear")->GetComponent(1, 1) == -10);
  assert_true(std::fabs(contacts->GetPoint(3)[0] - 0.35) < 1e-15);  /* half way out of grain 1 */
  assert_true(std::fabs(contacts->GetPoint(5)[0] - -0.65) < 1e-15); /* half way back from grain 0; 1e-15: one rounding */
  assert_int_equal(cell->GetNumberOfPoints(), 4);
  assert_true(std::fabs(cell->GetPoint(0)[0] - -0.6) < 1e-15 && std::fabs(cell->GetPoint(3)[0] - 0.6) < 1e-15);
}

static void cell_of_a_packing_of_spheres_is_a_box(void **) {
  if (rank != 0) return;
  RveView view = example();
  double raised[9];
  for (int k = 0; k < 9; k++) raised[k] = position[k] + (k == 5 ? 0.1 : 0.0);
  view.position = raised;
  assert_int_equal(vtk_write_rve("box", 1, 0.0, 1, &view), BASE_OK);
  vtkNew<vtkXMLMultiBlockDataReader> reader;
  reader->SetFileName("box_1_1.vtm");
  reader->Update();
  vtkPolyData *cell = vtkPolyData::SafeDownCast(vtkMultiBlockDataSet::SafeDownCast(reader->GetOutput())->GetBlock(2));
  assert_int_equal(cell->GetNumberOfPoints(), 8);
  assert_int_equal(cell->GetNumberOfPolys(), 6);
}

static void series_continues_after_a_restart(void **) {
  if (rank != 0) return;
  const RveView view = example();
  for (int step = 1; step <= 4; step++) assert_int_equal(vtk_write_rve("series", step, 0.1 * step, 3, &view), BASE_OK);
  /* The run starts again from step 2: entries at and after the new time give way. */
  assert_int_equal(vtk_write_rve("series", 3, 0.3, 3, &view), BASE_OK);
  const std::string text = text_of("series_3.pvd");
  for (int step = 1; step <= 3; step++)
    assert_true(text.find("file=\"series_3_" + std::to_string(step) + ".vtm\"") != std::string::npos);
  assert_true(text.find("series_3_4.vtm") == std::string::npos);
  assert_true(text.find("series_3_3.vtm") == text.rfind("series_3_3.vtm"));
  assert_true(text.find("</Collection>") != std::string::npos);
  assert_true(access("series_3.pvd.tmp", F_OK) != 0);
}

static void grid_is_the_same_for_every_number_of_ranks(void **) {
  /* A 3 x 3 patch of nodes dealt to the ranks in turn; every rank also shows foreign nodes, which must not count. */
  int index[27];
  double mass[9], node_velocity[27], temperature[9];
  unsigned char owned[9];
  for (int n = 0; n < 9; n++) {
    index[3 * n] = n % 3 - 1, index[3 * n + 1] = n / 3, index[3 * n + 2] = 0;
    owned[n] = n % ranks == rank;
    mass[n] = owned[n] ? 1.0 + n : -1.0;
    temperature[n] = 20.0 * n;
    for (int k = 0; k < 3; k++) node_velocity[3 * n + k] = n + 0.1 * k;
  }
  const MpmGridView view = {9, {0.5, 0.5, 0.5}, index, mass, node_velocity, temperature, owned};
  const double origin[3] = {10, 20, 0};
  assert_int_equal(vtk_write_grid(MPI_COMM_WORLD, "field", 5, 1.5, &view, origin), BASE_OK);
  if (rank != 0) return;
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName("field_grid_5.vtu");
  reader->Update();
  vtkUnstructuredGrid *grid = reader->GetOutput();
  assert_int_equal(grid->GetNumberOfPoints(), 9);
  assert_int_equal(grid->GetNumberOfCells(), 9 + 4); /* a vertex each and 2 x 2 cells */
  for (int n = 0; n < 9; n++) {
    assert_true(grid->GetPoint(n)[0] == 10 + 0.5 * (n % 3 - 1) && grid->GetPoint(n)[1] == 20 + 0.5 * (n / 3));
    assert_true(grid->GetPointData()->GetArray("mass")->GetTuple1(n) == 1.0 + n);
    assert_true(grid->GetPointData()->GetArray("temperature")->GetTuple1(n) == 20.0 * n);
    assert_true(grid->GetPointData()->GetArray("velocity")->GetComponent(n, 2) == n + 0.1 * 2);
  }
}

static void a_directory_that_does_not_exist_is_named_on_all_ranks(void **) {
  const RveView view = example();
  if (rank == 0) {
    assert_int_equal(vtk_write_rve("no_such_directory/rve", 1, 0.0, 1, &view), BASE_ERROR_FILE);
    assert_non_null(strstr(base_error_message(), "no_such_directory/rve_1_1.vtm"));
  }
  const MpmGridView grid = {};
  const double origin[3] = {0, 0, 0};
  assert_int_equal(vtk_write_grid(MPI_COMM_WORLD, "no_such_directory/g", 1, 0.0, &grid, origin), BASE_ERROR_FILE);
  assert_non_null(strstr(base_error_message(), "no_such_directory/g_grid_1.vtu"));
}

int main(int argc, char **argv) {
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(grains_contacts_and_cell_come_back_as_written),
      cmocka_unit_test(cell_of_a_packing_of_spheres_is_a_box),
      cmocka_unit_test(series_continues_after_a_restart),
      cmocka_unit_test(grid_is_the_same_for_every_number_of_ranks),
      cmocka_unit_test(a_directory_that_does_not_exist_is_named_on_all_ranks),
  };
  const int failures = cmocka_run_group_tests(tests, nullptr, nullptr);
  MPI_Finalize();
  return failures;
}
