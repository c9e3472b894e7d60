#include "linalg/rigid_modes.hpp"
#include <algorithm>
#include <array>
#include <vector>
#include "base/handle.hpp"

namespace bs {
namespace {

/// Centre of the free points: rotations about a far origin would be translations but for rounding.
PetscErrorCode find_centre(const Graph& graph, const Places& position, double centre[3]) {
  std::array<double, 4> sums = {0, 0, 0, 0};
  PetscFunctionBegin;
  for (PetscInt i = 0; i < graph.n; ++i) {
    if (graph.fixed[i]) continue;
    for (int c = 0; c < graph.dim; ++c) sums[c] += position(i)[c];
    sums[3] += 1;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums.data(), 4, MPI_DOUBLE, MPI_SUM, graph.comm));
  for (int c = 0; c < 3; ++c) centre[c] = sums[3] > 0 ? sums[c] / sums[3] : 0;
  PetscFunctionReturn(0);
}

/// Mode k < d: u = e_k; k >= d, in the plane of axes (a, b): u_a = -(x_b - c_b), u_b = x_a - c_a.
PetscErrorCode fill_mode(const Graph& graph, const Places& position, const double* centre, int k, Vec mode) {
  constexpr int PLANES[3][2] = {{0, 1}, {1, 2}, {2, 0}};
  const PetscInt d = graph.dim;
  PetscScalar* u = nullptr;
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(mode));
  PetscCall(VecGetArray(mode, &u));
  for (PetscInt i = 0; i < graph.n; ++i) {
    if (graph.fixed[i]) continue;
    if (k < d) {
      u[i * d + k] = 1;
      continue;
    }
    const auto [a, b] = PLANES[k - d];
    u[i * d + a] = centre[b] - position(i)[b];
    u[i * d + b] = position(i)[a] - centre[a];
  }
  graph.clear_held(u);
  PetscCall(VecRestoreArray(mode, &u));
  PetscFunctionReturn(0);
}

/// Takes the parts along `others` out of the mode and makes its length 1; `moves`: something beyond rounding is left.
PetscErrorCode orthonormalise(std::vector<Vec>& others, Vec mode, double size, bool* moves) {
  constexpr double LEAST = 1e-8;
  const PetscInt count = static_cast<PetscInt>(others.size());
  std::vector<PetscScalar> along(others.size());
  PetscReal length = 0;
  PetscFunctionBegin;
  for (int pass = 0; pass < 2 && count > 0; ++pass) {  // the second takes out what rounding has left
    PetscCall(VecMDot(mode, count, others.data(), along.data()));
    for (PetscScalar& a : along) a = -a;
    PetscCall(VecMAXPY(mode, count, along.data(), others.data()));
  }
  PetscCall(VecNorm(mode, NORM_2, &length));
  *moves = length > LEAST * size;
  if (*moves) PetscCall(VecScale(mode, 1 / length));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode set_rigid_modes(const Graph& graph, const Places& position, Mat S) {
  const int d = graph.dim, count = graph.periodic ? d : d * (d + 1) / 2;  // a periodic box does not turn
  double centre[3], size = 0;
  std::vector<VecHandle> owned;
  std::vector<Vec> modes;
  MatNullSpace space = nullptr;
  PetscFunctionBegin;
  PetscCall(find_centre(graph, position, centre));
  for (int k = 0; k < count; ++k) {
    VecHandle mode;
    PetscReal length = 0;
    bool moves = false;
    PetscCall(MatCreateVecs(S, mode.out(), nullptr));
    PetscCall(fill_mode(graph, position, centre, k, mode));
    PetscCall(VecNorm(mode, NORM_2, &length));
    size = k == 0 || k == d ? length : std::max(size, length);  // of translations [1], of rotations [m]
    PetscCall(orthonormalise(modes, mode, size, &moves));
    if (!moves) continue;
    modes.push_back(mode);
    owned.push_back(std::move(mode));
  }
  if (!modes.empty()) PetscCall(MatNullSpaceCreate(graph.comm, PETSC_FALSE, static_cast<PetscInt>(modes.size()), modes.data(), &space));
  PetscCall(MatSetNearNullSpace(S, space));
  PetscCall(MatNullSpaceDestroy(&space));
  PetscFunctionReturn(0);
}

}  // namespace bs
