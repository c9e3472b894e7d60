// Runner of the unit tests: PETSc is started once; a failure on any rank fails the run.
#define CATCH_CONFIG_RUNNER
#include <petscsys.h>
#include <catch2/catch.hpp>
#include <cstdlib>
#include "session/tasks.hpp"

int main(int argc, char** argv) {
  setenv("SCOTCH_PTHREAD_NUMBER", "1", 0);  // as the program: PTScotch's threads make partitions differ from run to run
  // Catch's flags are not PETSc's: PETSc sees an empty command line.
  int fake_argc = 1;
  char* fake_args[] = {argv[0], nullptr};
  char** fake_argv = fake_args;
  if (PetscInitialize(&fake_argc, &fake_argv, nullptr, nullptr) || bs::register_types()) return 1;
  int failed = Catch::Session().run(argc, argv), any = 0;
  MPI_Allreduce(&failed, &any, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  if (PetscFinalize()) return 1;
  return any ? 1 : 0;
}
