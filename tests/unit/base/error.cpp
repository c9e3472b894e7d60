#include <catch2/catch.hpp>

#include <petscksp.h>

#include <vector>

#include "base/context.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

using namespace bs;

namespace {

int rank_in(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

/// A communicator of its own, without errors.
class Own {
 public:
  Own() { MPI_Comm_dup(MPI_COMM_WORLD, &comm); }
  ~Own() { MPI_Comm_free(&comm); }
  Own(const Own&) = delete;
  Own& operator=(const Own&) = delete;
  MPI_Comm comm = MPI_COMM_NULL;
};

PetscErrorCode wrong_type() {
  KSP ksp = nullptr;
  PetscFunctionBegin;
  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  const PetscErrorCode code = KSPSetType(ksp, "nonsense");
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(code);
}

PetscErrorCode inner(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscFunctionReturn(fail(comm, Exit::io, "inner"));
}

PetscErrorCode outer(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscCall(inner(comm));
  PetscFunctionReturn(0);
}

struct Counter {
  explicit Counter(int* of = nullptr) : alive(of) {}
  ~Counter() {
    if (alive) --*alive;
  }
  int* alive;
};

}  // namespace

TEST_CASE("an error keeps the smallest place") {
  Error fault;
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

TEST_CASE("all ranks hold the error of the smallest place, then of the lowest rank") {
  const Own own;
  int size = 1;
  MPI_Comm_size(own.comm, &size);
  const int rank = rank_in(own.comm);
  Error none, later, same;
  REQUIRE(fail_if_any(own.comm, none) == 0);
  REQUIRE_FALSE(last_error(own.comm));

  later.note(100 - rank, format("line %d", 100 - rank), Exit::io);
  REQUIRE(fail_if_any(own.comm, later) == ERR_FAILED);
  REQUIRE(last_error(own.comm).text == format("line %d", 100 - (size - 1)));
  REQUIRE(last_error(own.comm).exit == Exit::io);

  if (rank == size - 1) same.text = format("of rank %d", rank);  // only the last rank brings one, without a place
  REQUIRE(fail_if_any(own.comm, same) == ERR_FAILED);
  REQUIRE(last_error(own.comm).text == format("of rank %d", size - 1));
  REQUIRE(last_error(own.comm).exit == Exit::input);

  same.text = format("rank %d", rank);
  same.where = 5;
  REQUIRE(fail_if_any(own.comm, same) == ERR_FAILED);
  REQUIRE(last_error(own.comm).text == "rank 0");
  clear_error(own.comm);
  REQUIRE_FALSE(last_error(own.comm));
}

TEST_CASE("an error travels up as a value, and disturbs no other communicator") {
  const Own one, other;
  const PetscErrors handler(one.comm);
  std::vector<std::string> heard;
  Listener listener;
  listener.error = [&](const Error& error, bool alone) { heard.push_back(error.text + (alone ? " alone" : "")); };
  set_listener(one.comm, listener);
  REQUIRE(outer(one.comm) == ERR_FAILED);
  REQUIRE(last_error(one.comm).text == "inner");
  REQUIRE(last_error(one.comm).exit == Exit::io);
  REQUIRE_FALSE(last_error(other.comm));
  REQUIRE(fail_here(one.comm, Exit::input, "mine") == ERR_FAILED);
  REQUIRE(heard == std::vector<std::string>{"inner", "mine alone"});
  set_listener(one.comm, {});
}

TEST_CASE("errors of PETSc's are values in the words of a user, with the kind of the phase") {
  const Own own;
  const PetscErrors handler(own.comm);
  set_phase(own.comm, Exit::solve);
  REQUIRE(wrong_type() == PETSC_ERR_ARG_UNKNOWN_TYPE);
  REQUIRE(last_error(own.comm).text == "Unable to find requested KSP type nonsense (in KSPSetType): -help lists the valid names");
  REQUIRE(last_error(own.comm).exit == Exit::solve);
  clear_error(own.comm);
  (void)PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  REQUIRE(wrong_type() == PETSC_ERR_ARG_UNKNOWN_TYPE);
  (void)PetscPopErrorHandler();
  REQUIRE_FALSE(last_error(own.comm));
}

TEST_CASE("a context is that of the communicator and its duplicates, and goes with the last of them") {
  int alive = 1;
  MPI_Comm comm, twin;
  MPI_Comm_dup(MPI_COMM_WORLD, &comm);
  held_by<Counter>(comm).alive = &alive;
  MPI_Comm_dup(comm, &twin);
  REQUIRE(&held_by<Counter>(twin) == &held_by<Counter>(comm));
  MPI_Comm_free(&comm);
  REQUIRE(alive == 1);
  MPI_Comm_free(&twin);
  REQUIRE(alive == 0);
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
