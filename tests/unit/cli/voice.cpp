// What is said of errors, and the exit codes made of them.
#include <catch2/catch.hpp>

#include <petscksp.h>

#include "cli/voice.hpp"
#include "spoken.hpp"

using namespace bs;

TEST_CASE("errors and warnings are said once, from rank 0, in one line") {
  const Handled handled;
  const bool first = rank_of(PETSC_COMM_WORLD) == 0;
  Caught error;
  REQUIRE(fail(PETSC_COMM_WORLD, Exit::solve, "no\nconvergence") == ERR_FAILED);
  REQUIRE(error.text() == (first ? "backspring: error: no convergence\n" : ""));
  REQUIRE(exit_code_of(PETSC_COMM_WORLD, ERR_FAILED) == 3);
  REQUIRE(exit_code_of(PETSC_COMM_WORLD, 0) == 0);
  Caught warning;
  REQUIRE(warn(PETSC_COMM_WORLD, "ignored_input", "collisions are ignored") == 0);
  REQUIRE(warning.text() == (first ? "backspring: warning: collisions are ignored\n" : ""));
}

TEST_CASE("an error of one rank's is said by it") {
  if (size_of(PETSC_COMM_WORLD) > 1) return;  // several ranks end in MPI_Abort
  const Handled handled;
  KSP ksp = nullptr;
  set_phase(PETSC_COMM_WORLD, Exit::solve);
  Caught said;
  REQUIRE(KSPCreate(PETSC_COMM_SELF, &ksp) == 0);
  const PetscErrorCode code = KSPSetType(ksp, "nonsense");
  REQUIRE(KSPDestroy(&ksp) == 0);
  REQUIRE(said.text() == "backspring: error: Unable to find requested KSP type nonsense (in KSPSetType): -help lists the valid names\n");
  set_phase(PETSC_COMM_WORLD, Exit::input);
  REQUIRE(exit_code_of(PETSC_COMM_WORLD, code) == 3);
}
