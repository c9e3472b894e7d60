#include "input/gmsh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/fault.hpp"
#include "base/handle.hpp"
#include "input/gmsh_file.hpp"
#include "input/gmsh_scan.hpp"
#include "input/validate.hpp"
#include "network/footprint.hpp"

namespace bs {

namespace {

using DMHandle = Handle<DM, DMDestroy>;

/// The whole mesh, on rank 0.
struct Mesh {
  int dim = 0;
  bool curved = false;              ///< elements have nodes besides their corners
  std::vector<double> position;     ///< (N, dim)
  std::vector<std::int64_t> pairs;  ///< (M, 2)
};

/// Vertices and their coordinates, as many as the mesh has.
PetscErrorCode take_vertices(DM dm, Mesh* mesh) {
  PetscInt first, last, dim, offset;
  PetscSection section;
  Vec coordinates;
  const PetscScalar* ax;

  PetscFunctionBegin;
  PetscCall(DMPlexGetDepthStratum(dm, 0, &first, &last));
  PetscCall(DMGetCoordinateDim(dm, &dim));
  PetscCall(DMGetCoordinateSection(dm, &section));
  PetscCall(DMGetCoordinatesLocal(dm, &coordinates));
  PetscCall(VecGetArrayRead(coordinates, &ax));
  mesh->dim = static_cast<int>(dim);
  mesh->position.reserve(static_cast<std::size_t>(last - first) * static_cast<std::size_t>(dim));
  for (PetscInt v = first; v < last; ++v) {
    PetscCall(PetscSectionGetOffset(section, v, &offset));
    for (PetscInt k = 0; k < dim; ++k) mesh->position.push_back(PetscRealPart(ax[offset + k]));
  }
  PetscCall(VecRestoreArrayRead(coordinates, &ax));
  PetscFunctionReturn(0);
}

/// Edges as pairs of vertices; of several on the same two vertices, the first.
PetscErrorCode take_edges(DM dm, Mesh* mesh) {
  PetscInt first_vertex, last_vertex, first, last, ends;
  const PetscInt* cone;
  std::vector<std::int64_t> all;

  PetscFunctionBegin;
  PetscCall(DMPlexGetDepthStratum(dm, 0, &first_vertex, &last_vertex));
  PetscCall(DMPlexGetDepthStratum(dm, 1, &first, &last));
  for (PetscInt e = first; e < last; ++e) {
    PetscCall(DMPlexGetConeSize(dm, e, &ends));
    PetscCall(DMPlexGetCone(dm, e, &cone));
    if (ends != 2) continue;
    all.push_back(cone[0] - first_vertex);
    all.push_back(cone[1] - first_vertex);
  }
  const auto key = [&all](std::size_t e) { return std::minmax(all[2 * e], all[2 * e + 1]); };
  std::vector<std::size_t> order(all.size() / 2);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&key](std::size_t a, std::size_t b) {
    const auto [a0, a1] = key(a);
    const auto [b0, b1] = key(b);
    return a0 != b0 ? a0 < b0 : a1 < b1;
  });
  std::vector<bool> keep(order.size(), true);
  for (std::size_t k = 1; k < order.size(); ++k)
    if (key(order[k]) == key(order[k - 1])) keep[order[k]] = false;
  for (std::size_t e = 0; e < keep.size(); ++e)
    if (keep[e]) mesh->pairs.insert(mesh->pairs.end(), {all[2 * e], all[2 * e + 1]});
  PetscFunctionReturn(0);
}

/// Keeps the `dim` leading components. Returns what is wrong: there are fewer, or one that is dropped varies.
std::string drop_components(Mesh* mesh, int dim) {
  const std::size_t old = static_cast<std::size_t>(mesh->dim), d = static_cast<std::size_t>(dim);
  const std::size_t count = mesh->position.size() / old;
  if (d > old) return format("-bs_lattice_dim %d: the mesh has %zu coordinates", dim, old);
  double extent[3] = {0, 0, 0};
  for (std::size_t k = 0; k < old; ++k) {
    double lo = INFINITY, hi = -INFINITY;
    for (std::size_t p = 0; p < count; ++p) {
      lo = std::min(lo, mesh->position[p * old + k]);
      hi = std::max(hi, mesh->position[p * old + k]);
    }
    extent[k] = hi - lo;
  }
  const double size = *std::max_element(extent, extent + 3);
  for (std::size_t k = d; k < old; ++k)
    if (extent[k] > 1e-12 * size)
      return format("-bs_lattice_dim %d drops %c, which varies by %g over the mesh; write -bs_lattice_dim %zu", dim, "xyz"[k], extent[k], k + 1);
  for (std::size_t p = 0; p < count; ++p)
    for (std::size_t k = 0; k < d; ++k) mesh->position[p * d + k] = mesh->position[p * old + k];
  mesh->position.resize(count * d);
  mesh->dim = dim;
  return {};
}

/// The file as text, looked through before DMPlex sees it. Returns what is wrong; empty if nothing.
std::string inspect(const std::string& path, GmshScan* scan) {
  std::string text;
  const std::string error = read_gmsh_text(path, &text);
  if (!error.empty()) return error;
  std::string fault = fault_of_gmsh(text);
  if (fault.empty()) {
    *scan = scan_gmsh(text);
    fault = scan->fault;
  }
  return fault.empty() ? fault : path + ": " + fault;
}

/// Everything that happens on rank 0 alone; what the user can mend goes to `fault`.
PetscErrorCode read_here(const std::string& path, const GeneratorSpec& spec, Mesh* mesh, Fault* fault) {
  DMHandle dm;
  GmshScan scan;
  std::string error = inspect(path, &scan);

  PetscFunctionBegin;
  fault->note(0, error);
  if (*fault) PetscFunctionReturn(0);
  PetscCall(plex_from_gmsh(path, dm.out(), &error));
  if (!dm) {
    fault->note(0, format("%s: DMPlex cannot read this mesh (%s); write it again by Gmsh, or make an .h5 of it by "
                          "postprocess/convert.py",
                          path.c_str(), error.c_str()));
    PetscFunctionReturn(0);
  }
  mesh->curved = scan.curved;
  PetscCall(take_vertices(dm, mesh));
  PetscCall(take_edges(dm, mesh));
  if (mesh->pairs.empty()) error = "has no elements with edges; write lines, triangles, tetrahedra or other elements";
  else error = lone_line(scan, static_cast<std::int64_t>(mesh->position.size()) / mesh->dim, mesh->pairs);
  if (error.empty()) error = drop_components(mesh, spec.dim > 0 ? spec.dim : mesh->dim);
  if (!error.empty()) fault->note(0, path + ": " + error);
  PetscFunctionReturn(0);
}

/// Hands each rank its rows of a table (total, width) of rank 0.
template <class T>
PetscErrorCode scatter_rows(MPI_Comm comm, const std::vector<T>& all, const Rows& rows, int width, MPI_Datatype type, std::vector<T>* mine) {
  PetscMPIInt size;
  MPI_Datatype row;
  std::vector<PetscMPIInt> counts, starts;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  for (PetscMPIInt r = 0; r < size; ++r) {
    const Rows chunk = split_rows(rows.total, r, size);
    counts.push_back(static_cast<PetscMPIInt>(chunk.count));
    starts.push_back(static_cast<PetscMPIInt>(chunk.first));
  }
  mine->resize(static_cast<std::size_t>(rows.count * width));
  PetscCallMPI(MPI_Type_contiguous(width, type, &row));
  PetscCallMPI(MPI_Type_commit(&row));
  PetscCallMPI(MPI_Scatterv(all.data(), counts.data(), starts.data(), row, mine->data(), static_cast<PetscMPIInt>(rows.count), row, 0, comm));
  PetscCallMPI(MPI_Type_free(&row));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_gmsh(MPI_Comm comm, const std::string& path, const GeneratorSpec& spec, Lattice* out) {
  PetscMPIInt rank, size;
  Mesh mesh;
  Fault fault;
  std::vector<double> springs, anchors;

  PetscFunctionBegin;
  *out = Lattice{};
  out->source = path;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (spec.particle_mass == 0 && spec.total_mass == 0)
    PetscCall(tell(comm, Exit::input,
                   path + ": a mesh has no masses; write -bs_lattice_particle_mass or "
                          "-bs_lattice_total_mass [kg]"));
  if (rank == 0) PetscCall(read_here(path, spec, &mesh, &fault));
  PetscCall(agree(comm, fault));
  std::int64_t head[4] = {mesh.dim, mesh.dim ? static_cast<std::int64_t>(mesh.position.size()) / mesh.dim : 0,
                          static_cast<std::int64_t>(mesh.pairs.size()) / 2, mesh.curved};
  PetscCallMPI(MPI_Bcast(head, 4, MPI_INT64_T, 0, comm));
  out->dim = static_cast<int>(head[0]);
  if (head[3])
    out->warnings.push_back(path +
                            ": elements of second or higher order: nodes between their corners are left out, springs join the "
                            "corners; postprocess/convert.py keeps them as particles");
  PetscCall(check_sizes(comm, path, head[1], out->dim, head[2], 0));
  PetscCall(reserve_lattice(comm, path, {head[1], head[2], 0, out->dim}));
  out->particles = split_rows(head[1], rank, size);
  out->springs = split_rows(head[2], rank, size);
  PetscCall(scatter_rows(comm, mesh.position, out->particles, out->dim, MPI_DOUBLE, &out->position));
  PetscCall(scatter_rows(comm, mesh.pairs, out->springs, 2, MPI_INT64_T, &out->pairs));

  const std::size_t n = static_cast<std::size_t>(out->particles.count), m = static_cast<std::size_t>(out->springs.count);
  out->velocity.assign(out->position.size(), 0.0);
  out->fixed.assign(n, 0);
  out->mass.assign(n, mass_of_each(spec, out->particles.total));
  out->stiffness.assign(m, repeated(spec.stiffness, 0));
  out->damping.assign(m, repeated(spec.damping, 0));
  PetscCall(initial_lengths(comm, *out, &springs, &anchors));
  for (const double length : springs) out->rest_length.push_back(length > 0 ? spec.rest_length_factor * length : NAN);
  PetscFunctionReturn(0);
}

}  // namespace bs
