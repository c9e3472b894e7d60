#include "linalg/coarse_choice.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bs {

namespace {

constexpr double THIN = 10;
constexpr double UNEVEN = 100;
constexpr double LINE = 1e-6;  // a body whose second extent is below this share of its length is a line
constexpr double FLAT = 1e-2;  // pairs count as not lying in a direction that has less than this share of the most frequent direction
constexpr double SHEAR = 0.1;  // least_resisted_strain below which some strain counts as not resisted

/// Computes the eigenvalues of the symmetric A (n, n) in ascending order; the rows of A become the eigenvectors.
PetscErrorCode diagonalise(double* A, PetscBLASInt n, double* values) {
  double work[64];
  PetscBLASInt room = 64, info = 0;
  PetscFunctionBegin;
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &n, A, &n, values, work, &room, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's syev failed");
  PetscFunctionReturn(0);
}

}  // namespace

// The energy of the uniform strain e is e.C e with C_abcd = sum over pairs of n_a n_b n_c n_d, n their directions. Strains across directions q_p that
// no pair lies in (a sheet's normal) do not count: of B_ab = sum n_a n_b = C_abcc the eigenvectors with small eigenvalues.
PetscErrorCode least_resisted_strain(const PairMatrix& S, double* ratio) {
  const PairPattern& pattern = S.pattern();
  const Graph& graph = S.graph();
  const int d = graph.dim;
  double C[81] = {}, B[9] = {}, size[3], strain[6][9], reduced[36], energy[6];
  int strains = 0;
  PetscFunctionBegin;
  const auto add = [&](PetscInt i, PetscInt j, double part) {
    double n[3] = {0, 0, 0}, square = 0;
    for (int c = 0; c < d; ++c) {
      n[c] = graph.start[static_cast<std::size_t>(j * d + c)] - graph.start[static_cast<std::size_t>(i * d + c)];
      square += n[c] * n[c];
    }
    for (int k = 0; k < 81 && square > 0; ++k) C[k] += part * n[k / 27] * n[k / 9 % 3] * n[k / 3 % 3] * n[k % 3] / (square * square);
  };
  pattern.for_near([&](PetscInt i, PetscInt j) { add(i, j, 1); });
  for (std::size_t r = 0; r < pattern.cut_row.size(); ++r)  // such pairs are met on both ranks: each counts half
    for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k) add(pattern.cut_row[r], pattern.n + pattern.ghost[k], 0.5);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, C, 81, MPI_DOUBLE, MPI_SUM, graph.comm));
  for (int k = 0; k < 81; ++k)
    if (k / 3 % 3 == k % 3) B[k / 9] += C[k];
  PetscCall(diagonalise(B, 3, size));
  *ratio = 1;
  for (int p = 0; p < 3; ++p)
    for (int q = p; q < 3; ++q) {
      if (!(size[p] > FLAT * size[2])) continue;
      for (int k = 0; k < 9; ++k)  // strains of norm 1
        strain[strains][k] = (B[3 * p + k / 3] * B[3 * q + k % 3] + B[3 * q + k / 3] * B[3 * p + k % 3]) * (p == q ? 0.5 : std::sqrt(0.5));
      ++strains;
    }
  if (strains == 0) PetscFunctionReturn(0);
  for (int a = 0; a < strains; ++a)
    for (int b = 0; b < strains; ++b) {
      reduced[a * strains + b] = 0;
      for (int k = 0; k < 81; ++k) reduced[a * strains + b] += strain[a][k / 9] * C[k] * strain[b][k % 9];
    }
  PetscCall(diagonalise(reduced, strains, energy));
  *ratio = std::max(0.0, energy[0]) / energy[strains - 1];
  PetscFunctionReturn(0);
}

/// Whether the body is thin but not a line, and its stiffnesses differ little.
static PetscErrorCode bends(const Graph& graph, bool* yes) {
  const int d = graph.dim;
  double low[8];  // lower and minus upper corner, smallest and minus largest stiffness
  double shortest = std::numeric_limits<double>::max(), longest = 0, second = 0;
  PetscFunctionBegin;
  std::fill_n(low, 8, std::numeric_limits<double>::max());
  for (PetscInt i = 0; i < graph.n; ++i)
    for (int c = 0; c < d; ++c) {
      const double x = graph.start[static_cast<std::size_t>(i * d + c)];
      low[c] = std::min(low[c], x);
      low[3 + c] = std::min(low[3 + c], -x);
    }
  if (graph.stiffest > 0) {
    low[6] = graph.softest;
    low[7] = -graph.stiffest;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, low, 8, MPI_DOUBLE, MPI_MIN, graph.comm));
  for (int c = 0; c < d; ++c) {
    const double extent = -low[3 + c] - low[c];
    shortest = std::min(shortest, extent);
    second = std::max(second, std::min(extent, longest));
    longest = std::max(longest, extent);
  }
  const bool even = low[6] < std::numeric_limits<double>::max() && -low[7] <= UNEVEN * low[6], line = second <= LINE * longest;
  *yes = d > 1 && even && !line && THIN * shortest <= longest;
  PetscFunctionReturn(0);
}

PetscErrorCode prefers_rigid_motions(const PairMatrix& S, bool* rigid) {
  double ratio = 1;
  PetscFunctionBegin;
  PetscCall(bends(S.graph(), rigid));
  if (!*rigid || !S.graph().interactions) PetscFunctionReturn(0);
  PetscCall(least_resisted_strain(S, &ratio));
  *rigid = ratio > SHEAR;
  PetscFunctionReturn(0);
}

}  // namespace bs
