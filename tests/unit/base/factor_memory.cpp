#include "base/factor_memory.hpp"
#include <catch2/catch.hpp>
#include "base/handle.hpp"

using namespace bs;

/// A grid of n x n nodes, each tied to its four neighbours and to the ground.
static MatHandle grid(PetscInt n) {
  MatHandle A;
  REQUIRE(MatCreateSeqAIJ(PETSC_COMM_SELF, n * n, n * n, 5, nullptr, A.out()) == 0);
  for (PetscInt row = 0; row < n * n; ++row) {
    REQUIRE(MatSetValue(A, row, row, 5, INSERT_VALUES) == 0);
    for (const PetscInt step : {PetscInt(1), n}) {
      if (step == 1 ? row % n == n - 1 : row + n >= n * n) continue;
      REQUIRE(MatSetValue(A, row, row + step, -1, INSERT_VALUES) == 0);
      REQUIRE(MatSetValue(A, row + step, row, -1, INSERT_VALUES) == 0);
    }
  }
  REQUIRE(assemble(A) == 0);
  REQUIRE(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE) == 0);
  return A;
}

TEST_CASE("factors for which MUMPS has too little work space are made again with more") {
  constexpr PetscInt N = 60;
  MatHandle A = grid(N);
  for (const bool given : {false, true}) {
    KSPHandle ksp;
    PC pc;
    Mat factors = nullptr;
    REQUIRE(KSPCreate(PETSC_COMM_SELF, ksp.out()) == 0);
    REQUIRE(KSPSetOptionsPrefix(ksp, "narrow_") == 0);
    REQUIRE(KSPSetOperators(ksp, A, A) == 0);
    REQUIRE(KSPSetType(ksp, KSPPREONLY) == 0);
    REQUIRE(KSPGetPC(ksp, &pc) == 0);
    REQUIRE(PCSetType(pc, PCCHOLESKY) == 0);
    REQUIRE(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS) == 0);
    REQUIRE(PCFactorSetUpMatSolverType(pc) == 0);
    REQUIRE(PCFactorGetMatrix(pc, &factors) == 0);
    REQUIRE(MatMumpsSetIcntl(factors, MUMPS_WORK_SPACE, -60) == 0);
    REQUIRE(MatMumpsSetIcntl(factors, 24, 1) == 0);
    if (given) REQUIRE(PetscOptionsSetValue(nullptr, "-narrow_mat_mumps_icntl_14", "-60") == 0);
    REQUIRE(set_up_solver(ksp) == 0);
    REQUIRE(PetscOptionsClearValue(nullptr, "-narrow_mat_mumps_icntl_14") == 0);
    MemoryLack lack;
    REQUIRE(find_memory_lack(PETSC_COMM_SELF, pc, &lack) == 0);
    CHECK(lack.yes == given);  // what the user sets stays, and is named
    if (given) {
      CHECK(lack.infog == -9);
      CHECK(lack.remedy().find("-narrow_mat_mumps_icntl_14") != std::string::npos);
      continue;
    }
    PetscInt kept = 0;
    REQUIRE(PCFactorGetMatrix(pc, &factors) == 0);
    REQUIRE(MatMumpsGetIcntl(factors, 24, &kept) == 0);
    CHECK(kept == 1);
    VecHandle x, b;
    PetscReal off = 0;
    REQUIRE(MatCreateVecs(A, x.out(), b.out()) == 0);
    REQUIRE(VecSet(x, 2) == 0);
    REQUIRE(MatMult(A, x, b) == 0);
    REQUIRE(KSPSolve(ksp, b, x) == 0);
    REQUIRE(VecShift(x, -2) == 0);
    REQUIRE(VecNorm(x, NORM_INFINITY, &off) == 0);
    CHECK(off < 1e-12);
  }
}
