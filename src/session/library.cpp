// Start and end of MPI and PETSc for programs without a command line.
#include "session/session.hpp"

namespace bs {

Library::Library() {
  int running = 0;
  PetscBool there = PETSC_FALSE;
  MPI_Initialized(&running);
  if (!running) {
    int provided = 0;
    mpi_ = MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided) == MPI_SUCCESS;
  }
  there_ = PetscInitialized(&there) == 0 && there;
  if (there_ || !(running || mpi_)) return;
  // before PetscInitialize, which would read files of options and catch signals
  if (PetscOptionsSetValue(nullptr, "-skip_petscrc", nullptr) || PetscOptionsSetValue(nullptr, "-no_signal_handler", nullptr)) return;
  petsc_ = there_ = PetscInitializeNoArguments() == 0;
}

Library::~Library() {
  if (petsc_) (void)PetscFinalize();
  if (mpi_) MPI_Finalize();
}

}  // namespace bs
