// Directions by the absolute values of curvatures, against their closed form.
#include "linalg/condensed/absolute.hpp"
#include <petscksp.h>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include "base/handle.hpp"

using namespace bs;

namespace {

constexpr PetscInt N = 24;
// S = D^1/2 H D^1/2 and P = D, where H = 3 I + a p p^T + c q q^T with p = (1, 1, ...)/sqrt(N), q = (1, -1, ...)/sqrt(N)
double weight(PetscInt i) { return 1 + 0.5 * std::sin(1.0 + static_cast<double>(i)); }
double right_side(PetscInt i) { return std::cos(2.0 * static_cast<double>(i)) + 0.3; }
double entry(PetscInt i, PetscInt j, double base, double a, double c) { return (i == j ? base : 0) + (a + ((i + j) % 2 ? -c : c)) / N; }

struct Problem {
  double a, c;
  MatHandle S, D;
  VecHandle b, w;
  PCHandle P;
  AbsoluteSolve::Outcome outcome;

  Problem(double a_, double c_) : a(a_), c(c_) {
    PetscInt begin = 0, end = 0;
    REQUIRE(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, N, N, N, nullptr, N, nullptr, S.out()) == 0);
    REQUIRE(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, N, N, 1, nullptr, 0, nullptr, D.out()) == 0);
    REQUIRE(MatCreateVecs(S, b.out(), w.out()) == 0);
    REQUIRE(MatGetOwnershipRange(S, &begin, &end) == 0);
    for (PetscInt i = begin; i < end; ++i) {
      for (PetscInt j = 0; j < N; ++j) REQUIRE(MatSetValue(S, i, j, std::sqrt(weight(i) * weight(j)) * entry(i, j, 3, a, c), INSERT_VALUES) == 0);
      REQUIRE(MatSetValue(D, i, i, weight(i), INSERT_VALUES) == 0);
      REQUIRE(VecSetValue(b, i, right_side(i), INSERT_VALUES) == 0);
    }
    for (Mat A : {S.get(), D.get()}) {
      REQUIRE(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY) == 0);
      REQUIRE(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY) == 0);
    }
    REQUIRE(VecAssemblyBegin(b) == 0);
    REQUIRE(VecAssemblyEnd(b) == 0);
    REQUIRE(PCCreate(PETSC_COMM_WORLD, P.out()) == 0);
    REQUIRE(PCSetType(P, PCJACOBI) == 0);
    REQUIRE(PCSetOperators(P, D, D) == 0);
    REQUIRE(PCSetUp(P) == 0);
  }

  void solve(AbsoluteSolve* solver, const AbsoluteSolve::Demand& demand) { REQUIRE(solver->solve(S, P, b, w, demand, &outcome) == 0); }

  /// The largest difference of w from D^-1/2 |H|^-1 D^-1/2 b.
  double error() const {
    PetscInt begin = 0, end = 0;
    const PetscScalar* found = nullptr;
    const double base = 1.0 / 3, by_a = 1 / std::abs(3 + a) - base, by_c = 1 / std::abs(3 + c) - base;
    double worst = 0;
    REQUIRE(VecGetOwnershipRange(w, &begin, &end) == 0);
    REQUIRE(VecGetArrayRead(w, &found) == 0);
    for (PetscInt i = begin; i < end; ++i) {
      double expected = 0;
      for (PetscInt j = 0; j < N; ++j) expected += entry(i, j, base, by_a, by_c) * right_side(j) / std::sqrt(weight(i) * weight(j));
      worst = std::max(worst, std::abs(found[i - begin] - expected));
    }
    REQUIRE(VecRestoreArrayRead(w, &found) == 0);
    REQUIRE(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD) == 0);
    return worst;
  }
};

}  // namespace

TEST_CASE("a direction goes along negative curvature by its absolute value") {
  AbsoluteSolve solver;
  for (const double a : {-5.0, -1.0, -3.5}) {  // H has the eigenvalues 3 + a, 1 and 3
    Problem problem(a, -2);
    problem.solve(&solver, {1e-12, 1e-12, 100});
    CHECK(problem.outcome.sound);
    CHECK(problem.outcome.negative == (3 + a < 0));
    CHECK(problem.outcome.iterations <= 4);                              // as many as eigenvalues, and one for rounding
    CHECK(problem.error() < (problem.outcome.negative ? 1e-7 : 1e-12));  // columns are in single precision
  }
}

TEST_CASE("the loose tolerance of a direction is for negative curvature alone") {
  AbsoluteSolve solver;
  Problem definite(-1, -2), indefinite(-5, -2);
  definite.solve(&solver, {1e-12, 0.9, 100});
  CHECK(definite.error() < 1e-12);
  indefinite.solve(&solver, {1e-12, 0.9, 100});
  CHECK(indefinite.outcome.negative);
  CHECK(indefinite.error() > 1e-6);
  PetscScalar slope = 0;
  REQUIRE(VecDot(indefinite.b, indefinite.w, &slope) == 0);
  CHECK(slope > 0);  // downhill all the same
}

TEST_CASE("there is no direction without a right side") {
  AbsoluteSolve solver;
  Problem problem(-5, -2);
  REQUIRE(VecZeroEntries(problem.b) == 0);
  problem.solve(&solver, {1e-12, 0.1, 100});
  CHECK_FALSE(problem.outcome.sound);
}

namespace {

/// S diagonal with these entries, P = 1, b = (1, 1, ...).
struct Diagonal {
  MatHandle S;
  VecHandle entries, b, w;
  PCHandle P;
  AbsoluteSolve::Outcome outcome;

  template <typename Entry>
  Diagonal(PetscInt n, Entry entry) {
    PetscInt begin = 0, end = 0;
    REQUIRE(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, n, entries.out()) == 0);
    REQUIRE(VecDuplicate(entries, b.out()) == 0);
    REQUIRE(VecDuplicate(entries, w.out()) == 0);
    REQUIRE(VecSet(b, 1) == 0);
    REQUIRE(VecGetOwnershipRange(entries, &begin, &end) == 0);
    for (PetscInt i = begin; i < end; ++i) REQUIRE(VecSetValue(entries, i, entry(i), INSERT_VALUES) == 0);
    REQUIRE(VecAssemblyBegin(entries) == 0);
    REQUIRE(VecAssemblyEnd(entries) == 0);
    REQUIRE(MatCreateAIJ(PETSC_COMM_WORLD, end - begin, end - begin, n, n, 1, nullptr, 0, nullptr, S.out()) == 0);
    REQUIRE(MatDiagonalSet(S, entries, INSERT_VALUES) == 0);
    REQUIRE(PCCreate(PETSC_COMM_WORLD, P.out()) == 0);
    REQUIRE(PCSetType(P, PCNONE) == 0);
    REQUIRE(PCSetOperators(P, S, S) == 0);
    REQUIRE(PCSetUp(P) == 0);
  }

  void solve(const AbsoluteSolve::Demand& demand) {
    AbsoluteSolve solver;
    REQUIRE(solver.solve(S, P, b, w, demand, &outcome) == 0);
  }

  /// |S w - b| / |b|
  double left() {
    PetscReal whole = 0, norm = 0;
    VecHandle r;
    REQUIRE(VecDuplicate(b, r.out()) == 0);
    REQUIRE(MatMult(S, w, r) == 0);
    REQUIRE(VecAXPY(r, -1, b) == 0);
    REQUIRE(VecNorm(r, NORM_2, &norm) == 0);
    REQUIRE(VecNorm(b, NORM_2, &whole) == 0);
    return norm / whole;
  }
};

/// Rises from 1 to 10^4 in n entries, evenly in its root.
double rising(PetscInt i, PetscInt n) { return std::pow(1 + 99.0 * static_cast<double>(i) / static_cast<double>(n - 1), 2); }

}  // namespace

TEST_CASE("conjugate gradients go on beyond the columns that are kept") {
  constexpr PetscInt n = 3000;
  Diagonal problem(n, [](PetscInt i) { return rising(i, n); });
  problem.solve({1e-10, 0.1, 2000});
  CHECK(problem.outcome.sound);
  CHECK_FALSE(problem.outcome.negative);
  CHECK(problem.outcome.iterations > AbsoluteSolve::KEPT);
  CHECK(problem.left() < 1e-9);
  problem.solve({1e-10, 0.1, 20});
  CHECK(problem.outcome.iterations == 20);
}

TEST_CASE("negative curvature that shows late leaves the direction found before it") {
  constexpr PetscInt n = 3000;
  // hardly seen by b, so that it takes many iterations
  Diagonal problem(n, [](PetscInt i) { return i == 0 ? -1e-3 : rising(i, n); });
  REQUIRE(VecSetValue(problem.b, 0, 1e-7, INSERT_VALUES) == 0);
  REQUIRE(VecAssemblyBegin(problem.b) == 0);
  REQUIRE(VecAssemblyEnd(problem.b) == 0);
  problem.solve({1e-12, 0.1, 2000});
  PetscScalar slope = 0;
  REQUIRE(VecDot(problem.b, problem.w, &slope) == 0);
  CHECK(problem.outcome.sound);
  CHECK(problem.outcome.negative);
  CHECK(problem.outcome.iterations > AbsoluteSolve::KEPT);
  CHECK(slope > 0);
  CHECK(problem.left() < 1e-3);
}

TEST_CASE("curvature of either sign counts by a hundredth at least where some is negative") {
  const double entries[] = {-2, 1e-3, -1e-3, 0.5};
  Diagonal problem(4, [&](PetscInt i) { return entries[i]; });
  problem.solve({1e-12, 1e-12, 100});
  const double expected[] = {0.5, 100, 100, 2};
  const PetscScalar* w = nullptr;
  PetscInt begin = 0, end = 0;
  REQUIRE(VecGetOwnershipRange(problem.w, &begin, &end) == 0);
  REQUIRE(VecGetArrayRead(problem.w, &w) == 0);
  for (PetscInt i = begin; i < end; ++i) CHECK(std::abs(w[i - begin] - expected[i]) < 1e-4 * expected[i]);  // columns are in single precision
  REQUIRE(VecRestoreArrayRead(problem.w, &w) == 0);
}
