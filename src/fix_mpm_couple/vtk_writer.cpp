/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "vtk_writer.h"

#include "rank_agree.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <unistd.h>
#include <vector>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkCompositeDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkIdTypeArray.h>
#include <vtkInformation.h>
#include <vtkIntArray.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLMultiBlockDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

namespace {

void add_array(vtkDataSetAttributes *attributes, const char *name, int width, size_t n, const double *value) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(width);
  array->SetNumberOfTuples((vtkIdType)n);
  for (size_t k = 0; k < n * (size_t)width; k++) array->SetValue((vtkIdType)k, value[k]);
  attributes->AddArray(array);
}

void add_array(vtkDataSetAttributes *attributes, const char *name, const std::vector<int> &value) {
  vtkNew<vtkIntArray> array;
  array->SetName(name);
  for (int v : value) array->InsertNextValue(v);
  attributes->AddArray(array);
}

/* As the packing header says: a cell that is one deep in z, everything at z = 0. */
bool is_plane(const RveView &view) {
  const double *h = view.cell;
  if (h[8] != 1.0 || h[2] != 0.0 || h[5] != 0.0 || h[6] != 0.0 || h[7] != 0.0) return false;
  for (int i = 0; i < view.grains; i++)
    if (view.position[3 * i + 2] != 0.0) return false;
  for (int c = 0; c < view.contacts; c++)
    if (view.branch[3 * c + 2] != 0.0) return false;
  return true;
}

void fill_grains(const RveView &view, vtkPolyData *grains) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  for (int i = 0; i < view.grains; i++) {
    const vtkIdType id = points->InsertNextPoint(view.position + 3 * i);
    vertices->InsertNextCell(1, &id);
  }
  grains->SetPoints(points);
  grains->SetVerts(vertices);
  const size_t n = (size_t)view.grains;
  add_array(grains->GetPointData(), "radius", 1, n, view.radius);
  if (view.velocity) add_array(grains->GetPointData(), "velocity", 3, n, view.velocity);
  if (view.spin) add_array(grains->GetPointData(), "spin", 3, n, view.spin);
}

void add_line(const double *start, const double *branch, double factor, vtkPoints *points, vtkCellArray *lines) {
  const vtkIdType id[2] = {points->InsertNextPoint(start),
                           points->InsertNextPoint(start[0] + factor * branch[0], start[1] + factor * branch[1],
                                                   start[2] + factor * branch[2])};
  lines->InsertNextCell(2, id);
}

void fill_contacts(const RveView &view, vtkPolyData *contacts) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  std::vector<double> normal, shear;
  std::vector<int> bond, number;
  for (int c = 0; c < view.contacts; c++) {
    const double *b = view.branch + 3 * c;
    const double *xi = view.position + 3 * view.pair[2 * c], *xj = view.position + 3 * view.pair[2 * c + 1];
    double gap = 0.0, length = 0.0;
    for (int k = 0; k < 3; k++) gap += std::fabs(xj[k] - xi[k] - b[k]), length += std::fabs(b[k]);
    const int pieces = gap > 1e-6 * length ? 2 : 1; /* the second grain's image lies in a neighbouring cell */
    add_line(xi, b, pieces == 2 ? 0.5 : 1.0, points, lines);
    if (pieces == 2) add_line(xj, b, -0.5, points, lines);
    for (int k = 0; k < pieces; k++) {
      normal.push_back(view.force_normal[c]);
      shear.insert(shear.end(), view.force_shear + 3 * c, view.force_shear + 3 * c + 3);
      bond.push_back(view.bond ? view.bond[c] : 0);
      number.push_back(c);
    }
  }
  contacts->SetPoints(points);
  contacts->SetLines(lines);
  add_array(contacts->GetCellData(), "force_normal", 1, normal.size(), normal.data());
  add_array(contacts->GetCellData(), "force_shear", 3, normal.size(), shear.data());
  add_array(contacts->GetCellData(), "bond", bond);
  add_array(contacts->GetCellData(), "contact", number);
}

/* The cell is centred: a grain sits at H s with s in [-1/2, 1/2). */
void fill_cell(const RveView &view, vtkPolyData *cell) {
  static const vtkIdType faces[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                        {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  const bool plane = is_plane(view);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int corner = 0; corner < (plane ? 4 : 8); corner++) {
    double x[3];
    const double s[3] = {(corner & 1) - 0.5, ((corner >> 1) & 1) - 0.5, plane ? 0.0 : ((corner >> 2) & 1) - 0.5};
    for (int i = 0; i < 3; i++)
      x[i] = view.cell[3 * i] * s[0] + view.cell[3 * i + 1] * s[1] + view.cell[3 * i + 2] * s[2];
    points->InsertNextPoint(x);
  }
  vtkNew<vtkCellArray> polygons;
  for (int face = 0; face < (plane ? 1 : 6); face++) polygons->InsertNextCell(4, faces[face]);
  cell->SetPoints(points);
  cell->SetPolys(polygons);
}

/* Silences VTK's own messages: the caller gets one of ours. */
class Quiet {
 public:
  Quiet() : before(vtkObject::GetGlobalWarningDisplay()) { vtkObject::GlobalWarningDisplayOff(); }
  ~Quiet() { vtkObject::SetGlobalWarningDisplay(before); }

 private:
  int before;
};

BaseStatus write_data(vtkXMLWriter *writer, vtkDataObject *data, const std::string &path) {
  FILE *probe = std::fopen(path.c_str(), "w");
  if (!probe) return base_error(BASE_ERROR_FILE, "cannot write %s: %s", path.c_str(), std::strerror(errno));
  std::fclose(probe);
  Quiet quiet;
  writer->SetInputDataObject(data);
  writer->SetFileName(path.c_str());
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  if (!writer->Write() || writer->GetErrorCode() != 0)
    return base_error(BASE_ERROR_FILE, "cannot write %s: the VTK library reports error %lu", path.c_str(),
                      writer->GetErrorCode());
  return BASE_OK;
}

std::string base_name(const std::string &path) {
  const size_t slash = path.rfind('/');
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

/* The lines of an older series that lie before `time`. Lines that are not ours, or cut short, are left out. */
std::string older_entries(const char *series, double time) {
  std::ifstream old(series);
  std::string kept, line;
  while (std::getline(old, line)) {
    double t;
    if (std::sscanf(line.c_str(), " <DataSet timestep=\"%lf\"", &t) == 1 && t < time &&
        line.find("/>") != std::string::npos)
      kept += line + "\n";
  }
  return kept;
}

/* One rank's nodes as the row of numbers that travels to rank 0. */
enum { ROW_I, ROW_J, ROW_K, ROW_MASS, ROW_VX, ROW_VY, ROW_VZ, ROW_TEMPERATURE, ROW_WIDTH };
typedef std::array<double, ROW_WIDTH> Row;

std::vector<double> owned_rows(const MpmGridView &view) {
  std::vector<double> rows;
  for (int n = 0; n < view.nodes; n++) {
    if (view.owned && !view.owned[n]) continue;
    for (int k = 0; k < 3; k++) rows.push_back(view.index[3 * n + k]);
    rows.push_back(view.mass[n]);
    for (int k = 0; k < 3; k++) rows.push_back(view.velocity[3 * n + k]);
    rows.push_back(view.temperature ? view.temperature[n] : 0.0);
  }
  return rows;
}

std::vector<double> gather(MPI_Comm comm, const std::vector<double> &mine) {
  int rank, ranks;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::vector<int> count((size_t)ranks), start((size_t)ranks);
  const int n = (int)mine.size();
  MPI_Gather(&n, 1, MPI_INT, count.data(), 1, MPI_INT, 0, comm);
  int total = 0;
  for (int r = 0; rank == 0 && r < ranks; r++) start[(size_t)r] = total, total += count[(size_t)r];
  std::vector<double> all((size_t)total);
  MPI_Gatherv(mine.data(), n, MPI_DOUBLE, all.data(), count.data(), start.data(), MPI_DOUBLE, 0, comm);
  return all;
}

/* Nodes sorted by index: the file does not depend on which rank held them. */
typedef std::map<std::array<int, 3>, Row> Nodes;
Nodes sort_nodes(const std::vector<double> &rows) {
  Nodes nodes;
  for (size_t r = 0; r + ROW_WIDTH <= rows.size(); r += ROW_WIDTH) {
    Row row;
    std::copy(rows.begin() + (long)r, rows.begin() + (long)r + ROW_WIDTH, row.begin());
    nodes[{(int)row[ROW_K], (int)row[ROW_J], (int)row[ROW_I]}] = row;
  }
  return nodes;
}

/* Cells whose corners are all active; a vertex for every node, so that none is invisible. */
void fill_cells(const Nodes &nodes, vtkUnstructuredGrid *grid) {
  bool plane = true;
  for (const auto &node : nodes) plane = plane && node.first[0] == 0;
  std::map<std::array<int, 3>, vtkIdType> id_of;
  vtkIdType next = 0;
  for (const auto &node : nodes) id_of[node.first] = next++;
  for (const auto &node : id_of) {
    static const int corner[8][3] = {{0, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 1, 0},
                                     {1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}};
    vtkIdType id[8];
    const int corners = plane ? 4 : 8;
    int found = 0;
    for (; found < corners; found++) {
      const auto at = id_of.find({node.first[0] + corner[found][0], node.first[1] + corner[found][1],
                                  node.first[2] + corner[found][2]});
      if (at == id_of.end()) break;
      id[found] = at->second;
    }
    if (found == corners) grid->InsertNextCell(plane ? VTK_QUAD : VTK_HEXAHEDRON, corners, id);
    grid->InsertNextCell(VTK_VERTEX, 1, &node.second);
  }
}

void fill_grid(const Nodes &nodes, bool thermal, const double spacing[3], const double origin[3],
               vtkUnstructuredGrid *grid) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  std::vector<double> mass, velocity, temperature;
  for (const auto &node : nodes) {
    const Row &row = node.second;
    points->InsertNextPoint(origin[0] + spacing[0] * row[ROW_I], origin[1] + spacing[1] * row[ROW_J],
                            origin[2] + spacing[2] * row[ROW_K]);
    mass.push_back(row[ROW_MASS]);
    velocity.insert(velocity.end(), row.begin() + ROW_VX, row.begin() + ROW_VZ + 1);
    temperature.push_back(row[ROW_TEMPERATURE]);
  }
  grid->SetPoints(points);
  fill_cells(nodes, grid);
  add_array(grid->GetPointData(), "mass", 1, mass.size(), mass.data());
  add_array(grid->GetPointData(), "velocity", 3, mass.size(), velocity.data());
  if (thermal) add_array(grid->GetPointData(), "temperature", 1, mass.size(), temperature.data());
}

}  // namespace

extern "C" BaseStatus vtk_series_add(const char *series, double time, const char *file) {
  const std::string kept = older_entries(series, time), temporary = std::string(series) + ".tmp";
  FILE *out = std::fopen(temporary.c_str(), "w");
  if (!out) return base_error(BASE_ERROR_FILE, "cannot write %s: %s", temporary.c_str(), std::strerror(errno));
  std::fprintf(out, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n%s",
               kept.c_str());
  std::fprintf(out, "<DataSet timestep=\"%.17g\" part=\"0\" file=\"%s\"/>\n", time, base_name(file).c_str());
  std::fprintf(out, "</Collection>\n</VTKFile>\n");
  bool good = std::fflush(out) == 0 && fsync(fileno(out)) == 0;
  good = std::fclose(out) == 0 && good;
  if (!good || std::rename(temporary.c_str(), series) != 0) {
    const int reason = errno;
    std::remove(temporary.c_str());
    return base_error(BASE_ERROR_FILE, "cannot write %s: %s", series, std::strerror(reason));
  }
  return BASE_OK;
}

extern "C" BaseStatus vtk_write_rve(const char *prefix, int64_t step, double time, int64_t tag, const RveView *view) {
  const std::string series = std::string(prefix) + "_" + std::to_string(tag);
  const std::string path = series + "_" + std::to_string(step) + ".vtm";
  vtkNew<vtkPolyData> grains, contacts, cell;
  fill_grains(*view, grains);
  fill_contacts(*view, contacts);
  fill_cell(*view, cell);
  vtkNew<vtkMultiBlockDataSet> blocks;
  vtkPolyData *const block[3] = {grains, contacts, cell};
  const char *const name[3] = {"grains", "contacts", "cell"};
  for (unsigned k = 0; k < 3; k++) {
    blocks->SetBlock(k, block[k]);
    blocks->GetMetaData(k)->Set(vtkCompositeDataSet::NAME(), name[k]);
  }
  vtkNew<vtkXMLMultiBlockDataWriter> writer;
  TRY(write_data(writer, blocks, path));
  return vtk_series_add((series + ".pvd").c_str(), time, path.c_str());
}

extern "C" BaseStatus vtk_write_grid(MPI_Comm comm, const char *prefix, int64_t step, double time,
                                     const MpmGridView *view, const double origin[3]) {
  const std::vector<double> rows = gather(comm, owned_rows(*view));
  int rank, thermal = view->nodes > 0 && view->temperature, any_thermal = 0;
  MPI_Comm_rank(comm, &rank);
  MPI_Reduce(&thermal, &any_thermal, 1, MPI_INT, MPI_MAX, 0, comm);
  BaseStatus status = BASE_OK;
  if (rank == 0) {
    const std::string series = std::string(prefix) + "_grid", path = series + "_" + std::to_string(step) + ".vtu";
    vtkNew<vtkUnstructuredGrid> grid;
    fill_grid(sort_nodes(rows), any_thermal != 0, view->spacing, origin, grid);
    vtkNew<vtkXMLUnstructuredGridWriter> writer;
    status = write_data(writer, grid, path);
    if (status == BASE_OK) status = vtk_series_add((series + ".pvd").c_str(), time, path.c_str());
  }
  return rank_agree(comm, status, 0);
}
