#include "base/collective.hpp"
#include "linalg/eigen/standard_form.hpp"

#include <petscblaslapack.h>
#include <cmath>
#include "linalg/rigid_modes.hpp"

namespace bs {
namespace {

using Vectors = std::vector<VecHandle>;

/// Centre of the points x (n, d) and the mean distance from it, of all ranks.
PetscErrorCode measure(MPI_Comm comm, const std::vector<double>& x, std::size_t d, double* centre, double* radius) {
  const std::size_t points = x.size() / d;
  double sums[5] = {0, 0, 0, 0, static_cast<double>(points)};
  PetscFunctionBegin;
  for (std::size_t k = 0; k < x.size(); ++k) sums[k % d] += x[k];
  PetscCall(sum_over_ranks(comm, sums, 5));
  for (int c = 0; c < 3; ++c) centre[c] = sums[c] / sums[4];
  for (std::size_t k = 0; k < x.size(); ++k) sums[3] += std::abs(x[k] - centre[k % d]);
  PetscCallMPI(MPI_Allreduce(&sums[3], radius, 1, MPI_DOUBLE, MPI_SUM, comm));
  *radius /= sums[4];
  PetscFunctionReturn(0);
}

/// Translations, then rotations about the centre, of the components that can move.
PetscErrorCode all_rigid(const StandardForm& form, Vectors* set) {
  const PetscInt d = form.linearised().dim(), n = form.linearised().points(), turns = d * (d - 1) / 2;
  const std::vector<double> x = form.linearised().positions();
  const Places places = [&x, d](PetscInt i) { return x.data() + i * d; };
  double centre[3] = {0, 0, 0}, radius = 0;
  VecHandle q, u;
  PetscFunctionBegin;
  PetscCall(form.create_full(q.out()));
  PetscCall(form.create_vector(u.out()));
  PetscCall(measure(form.comm(), x, static_cast<std::size_t>(d), centre, &radius));
  for (PetscInt k = 0; k < d + (radius > 0 ? turns : 0); ++k) {
    PetscReal size = 0;
    PetscCall(fill_rigid_mode(static_cast<int>(d), n, places, centre, radius, static_cast<int>(k), q));
    PetscCall(form.weigh(q, u));
    PetscCall(VecNorm(u, NORM_2, &size));
    PetscCall(add_orthonormal(u, size, set));
  }
  PetscFunctionReturn(0);
}

/// Eigenvectors of the small symmetric T (n, n), column by column in its place.
PetscErrorCode diagonalise(std::vector<double>* T, PetscBLASInt n) {
  std::vector<double> values(static_cast<std::size_t>(n)), work(static_cast<std::size_t>(8 * n));
  PetscBLASInt room = 8 * n, info = 0;
  PetscFunctionBegin;
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &n, T->data(), &n, values.data(), work.data(), &room, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's syev failed");
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode rigid_motions(StandardForm& form, Vec sizes, Vectors* u) {
  constexpr double NOTHING = 1e-11;  // of the forces single particles would feel
  Vectors set;
  VecHandle sum, force, each;
  PetscFunctionBegin;
  u->clear();
  PetscCall(all_rigid(form, &set));
  const std::size_t n = set.size();
  std::vector<double> T(n * n);
  PetscCall(form.create_vector(sum.out()));
  PetscCall(form.create_vector(force.out()));
  PetscCall(form.create_vector(each.out()));
  for (std::size_t k = 0; k < n; ++k) {
    PetscCall(form.multiply(set[k], force));
    for (std::size_t l = 0; l < n; ++l) PetscCall(VecDot(force, set[l], &T[k * n + l]));
  }
  if (n > 0) PetscCall(diagonalise(&T, static_cast<PetscBLASInt>(n)));
  for (std::size_t k = 0; k < n; ++k) {
    PetscReal size = 0, left = 0;
    PetscCall(VecZeroEntries(sum));
    for (std::size_t l = 0; l < n; ++l) PetscCall(VecAXPY(sum, T[k * n + l], set[l]));
    PetscCall(form.multiply(sum, force));
    PetscCall(VecPointwiseMult(each, sizes, sum));
    PetscReal length = 0;
    PetscCall(VecNorm(force, NORM_2, &left));
    PetscCall(VecNorm(each, NORM_2, &size));
    PetscCall(VecNorm(sum, NORM_2, &length));
    if (left <= NOTHING * size) PetscCall(add_orthonormal(sum, length, u));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
