#include <catch2/catch.hpp>

#include <petscksp.h>

#include "base/fault.hpp"
#include "base/text.hpp"
#include "spoken.hpp"

using namespace bs;

TEST_CASE("a fault keeps the smallest place") {
  Fault fault;
  REQUIRE_FALSE(fault);
  fault.note(7, "seven");
  fault.note(9, "nine");
  REQUIRE(fault.text == "seven");
  fault.note(3, "three", Exit::io);
  REQUIRE(fault.text == "three");
  REQUIRE(fault.exit == Exit::io);
}

TEST_CASE("format takes texts of any length") {
  const std::string long_word(5000, 'x');
  REQUIRE(format("%s-%d", long_word.c_str(), 7) == long_word + "-7");
  REQUIRE(format("%s", "").empty());
}

TEST_CASE("agree tells the fault of the smallest place, then of the lowest rank, once") {
  const int rank = rank_of(PETSC_COMM_WORLD), size = size_of(PETSC_COMM_WORLD);
  Fault none, later, same;
  REQUIRE(agree(PETSC_COMM_WORLD, none) == 0);

  later.note(100 - rank, format("line %d", 100 - rank), Exit::io);
  Caught first;
  REQUIRE(agree(PETSC_COMM_WORLD, later) == ERR_TOLD);
  const std::string told = first.text();
  REQUIRE(told == (rank == 0 ? format("backspring: error: line %d\n", 100 - (size - 1)) : ""));
  REQUIRE(told_exit() == Exit::io);

  // Only the last rank brings one, without a place and with a newline in it.
  if (rank == size - 1) same.text = format("of rank\n%d", rank);
  Caught second;
  REQUIRE(agree(PETSC_COMM_WORLD, same) == ERR_TOLD);
  REQUIRE(second.text() == (rank == 0 ? format("backspring: error: of rank %d\n", size - 1) : ""));
  REQUIRE(told_exit() == Exit::input);

  same.text = format("rank %d", rank);
  same.where = 5;
  Caught third;
  REQUIRE(agree(PETSC_COMM_WORLD, same) == ERR_TOLD);
  REQUIRE(third.text() == (rank == 0 ? "backspring: error: rank 0\n" : ""));
}

TEST_CASE("tell and warn speak once, from rank 0") {
  const bool first = rank_of(PETSC_COMM_WORLD) == 0;
  Caught error;
  REQUIRE(tell(PETSC_COMM_WORLD, Exit::solve, "no convergence") == ERR_TOLD);
  REQUIRE(error.text() == (first ? "backspring: error: no convergence\n" : ""));
  REQUIRE(told_exit() == Exit::solve);
  REQUIRE(finish(ERR_TOLD) == 3);
  REQUIRE(finish(0) == 0);
  Caught warning;
  REQUIRE(warn(PETSC_COMM_WORLD, "collisions are ignored") == 0);
  REQUIRE(warning.text() == (first ? "backspring: warning: collisions are ignored\n" : ""));
}

static PetscErrorCode inner() {
  PetscFunctionBegin;
  PetscFunctionReturn(tell(PETSC_COMM_WORLD, Exit::input, "inner"));
}

static PetscErrorCode outer() {
  PetscFunctionBegin;
  PetscCall(inner());
  PetscFunctionReturn(0);
}

TEST_CASE("a told fault travels up in silence") {
  const Handled handled;
  Caught said;
  const PetscErrorCode code = outer();
  REQUIRE(said.text() == (rank_of(PETSC_COMM_WORLD) == 0 ? "backspring: error: inner\n" : ""));
  REQUIRE(code == ERR_TOLD);
}

static PetscErrorCode wrong_type() {
  KSP ksp = nullptr;
  PetscFunctionBegin;
  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  const PetscErrorCode code = KSPSetType(ksp, "nonsense");
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(code);
}

TEST_CASE("errors under a handler pushed above ours stay silent") {
  const Handled handled;
  (void)PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  Caught said;
  const PetscErrorCode code = wrong_type();
  (void)PetscPopErrorHandler();
  REQUIRE(said.text().empty());
  REQUIRE(code == PETSC_ERR_ARG_UNKNOWN_TYPE);
}

TEST_CASE("a PETSc error is one line with the phase's exit code") {
  if (size_of(PETSC_COMM_WORLD) > 1) return;  // several ranks end in MPI_Abort
  const Handled handled;
  forget_faults();
  set_phase(Exit::solve);
  Caught said;
  const PetscErrorCode code = wrong_type();
  REQUIRE(said.text() == "backspring: error: Unable to find requested KSP type nonsense (in KSPSetType): -help lists the valid names\n");
  REQUIRE(code == PETSC_ERR_ARG_UNKNOWN_TYPE);
  set_phase(Exit::io);
  REQUIRE(finish(code) == 3);
  set_phase(Exit::input);
  forget_faults();
}

TEST_CASE("edit distance and nearest name") {
  REQUIRE(edit_distance("", "abc") == 3);
  REQUIRE(edit_distance("kitten", "sitting") == 3);  // two replaced, one inserted
  REQUIRE(edit_distance("flaw", "lawn") == 2);       // one removed, one inserted
  REQUIRE(edit_distance("Dt", "dT") == 0);
  const std::set<std::string> names = {"-bs_gravity", "-bs_mass"};
  REQUIRE(nearest("-bs_gravty", names, 2) == "-bs_gravity");
  REQUIRE(nearest("-bs_gravty", names, 0).empty());
  REQUIRE(split(" a, b,,c ", ',') == std::vector<std::string>{"a", "b", "", "c"});
}
