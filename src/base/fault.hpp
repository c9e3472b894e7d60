// What a user can mend: told once, in one line, with an exit code; never a stack trace.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <limits>
#include <string>

#include "base/format.hpp"

namespace bs {

/// Exit codes of the program (130 and 143 are added by signals).
enum class Exit : int { ok = 0, input = 2, solve = 3, io = 4 };

/// Error code that travels up through PetscCall once a fault has been told; prints nothing on the way.
constexpr PetscErrorCode ERR_TOLD = 20001;

/// One thing wrong. `where` orders faults found on several ranks (row or line number): the smallest is told.
struct Fault {
  std::int64_t where = std::numeric_limits<std::int64_t>::max();
  std::string text;  ///< what was read, where (file, line or dataset, id), and what to write instead
  Exit exit = Exit::input;
  explicit operator bool() const { return !text.empty(); }
  /// Keeps the fault of the smaller `where`.
  void note(std::int64_t at, std::string what, Exit code = Exit::input);
};

/// Collective. If any rank brings a fault, the one with the smallest `where` (then rank) is told once on stderr as
/// "backspring: error: TEXT" and every rank returns ERR_TOLD; else 0. Use as PetscCall(agree(comm, fault)).
PetscErrorCode agree(MPI_Comm comm, const Fault& fault);

/// Collective, the same fault on every rank: told once, returns ERR_TOLD.
PetscErrorCode tell(MPI_Comm comm, Exit exit, const std::string& text);

/// Collective. One line "backspring: warning: TEXT" on stderr, from rank 0.
PetscErrorCode warn(MPI_Comm comm, const std::string& text);

/// Not collective: what some ranks meet alone and must not wait for the others with. Rank 0 tells at once, another rank
/// after a second's wait; then, on several ranks, the program ends by MPI_Abort(exit). On one rank: returns ERR_TOLD.
PetscErrorCode tell_alone(Exit exit, const std::string& text);

/// Exit code of the fault that was told last (ok if none).
Exit told_exit();

/// Replaces PETSc's error handler: a PETSc error becomes one line from one rank; `phase_exit` is the exit code of such
/// an error in the present phase of the run (input while setting up, solve while stepping, io while writing).
/// On several ranks an untold PETSc error ends the program at once (MPI_Abort): it need not be collective. On one rank
/// it travels up to the caller. -bs_trace keeps PETSc's own traceback. HDF5's error stack is silenced.
PetscErrorCode install_error_handler();
/// The same for PetscInitialize itself: call before it.
void watch_start();
void set_phase(Exit phase_exit);
Exit present_phase();

/// The exit code of a run that ended with `code`: 0, told_exit(), or the phase's of a PETSc error (which on several
/// ranks ends in MPI_Abort here, if it has not yet). Functions whose name begins with "main" must not use PetscCall:
/// PETSc aborts there with the bare error code. Write: return finish(run(...)).
int finish(PetscErrorCode code);

}  // namespace bs
