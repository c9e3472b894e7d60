#include "linalg/rigid_modes.hpp"
#include <algorithm>
#include <array>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/vec_array.hpp"

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
  PetscCall(sum_over_ranks(graph.comm, sums.data(), 4));
  for (int c = 0; c < 3; ++c) centre[c] = sums[3] > 0 ? sums[c] / sums[3] : 0;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode fill_rigid_mode(int d, PetscInt n, const Places& position, const double* centre, double radius, int k, Vec mode) {
  constexpr int PLANES[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(mode));
  const WriteArray u(mode);
  for (PetscInt i = 0; i < n; ++i) {
    if (k < d) {
      u[i * d + k] = 1;
      continue;
    }
    const auto [a, b] = PLANES[k - d];
    u[i * d + a] = -(position(i)[b] - centre[b]) / radius;
    u[i * d + b] = (position(i)[a] - centre[a]) / radius;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode add_orthonormal(Vec u, PetscReal size, std::vector<VecHandle>* set) {
  constexpr double NOTHING = 1e-8;
  PetscReal length = 0;
  PetscFunctionBegin;
  for (int pass = 0; pass < 2; ++pass)  // the second takes out what rounding has left
    for (const VecHandle& other : *set) {
      PetscScalar share = 0;
      PetscCall(VecDot(u, other, &share));
      PetscCall(VecAXPY(u, -share, other));
    }
  PetscCall(VecNorm(u, NORM_2, &length));
  if (length <= NOTHING * size) PetscFunctionReturn(0);
  PetscCall(VecScale(u, 1 / length));
  set->emplace_back();
  PetscCall(copy_into(&set->back(), u));
  PetscFunctionReturn(0);
}

PetscErrorCode set_rigid_modes(const Graph& graph, const Places& position, Mat S) {
  const int d = graph.dim, count = graph.periodic ? d : d * (d + 1) / 2;  // a periodic box does not turn
  double centre[3];
  PetscReal size = 0;
  std::vector<VecHandle> owned;
  VecHandle mode;
  MatNullSpace space = nullptr;
  PetscFunctionBegin;
  PetscCall(find_centre(graph, position, centre));
  PetscCall(MatCreateVecs(S, mode.out(), nullptr));
  for (int k = 0; k < count; ++k) {
    PetscReal length = 0;
    PetscCall(fill_rigid_mode(d, graph.n, position, centre, 1, k, mode));
    {
      const WriteArray u(mode);
      for (PetscInt i = 0; i < graph.n * d; ++i)
        if (graph.fixed[i / d]) u[i] = 0;
      graph.clear_held(u.data());
    }
    PetscCall(VecNorm(mode, NORM_2, &length));
    size = k == 0 || k == d ? length : std::max(size, length);  // of translations [1], of rotations [m]
    PetscCall(add_orthonormal(mode, size, &owned));
  }
  const std::vector<Vec> modes(owned.begin(), owned.end());
  if (!modes.empty()) PetscCall(MatNullSpaceCreate(graph.comm, PETSC_FALSE, static_cast<PetscInt>(modes.size()), modes.data(), &space));
  PetscCall(MatSetNearNullSpace(S, space));
  PetscCall(MatNullSpaceDestroy(&space));
  PetscFunctionReturn(0);
}

}  // namespace bs
