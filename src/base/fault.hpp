// Errors that a user can correct: reported once, in one line, with an exit code; never with a stack trace.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <limits>
#include <string>
#include "base/text.hpp"

namespace bs {

/// Exit codes of the program (130 and 143 are added by signals).
enum class Exit : int { ok = 0, input = 2, solve = 3, io = 4 };

/// Error code that PetscCall passes up once a fault has been reported; it prints nothing on the way.
constexpr PetscErrorCode ERR_TOLD = 20001;

/// One fault. `where` (row or line number) orders faults found on several ranks: the smallest is reported.
struct Fault {
  std::int64_t where = std::numeric_limits<std::int64_t>::max();
  std::string text;  ///< what was read, where (file, line or dataset, id), and what to write instead
  Exit exit = Exit::input;
  explicit operator bool() const { return !text.empty(); }
  /// Keeps the fault of the smaller `where`.
  void note(std::int64_t at, std::string what, Exit code = Exit::input);
};

/// Collective. If any rank has a fault, the one with the smallest `where` (then rank) is reported once on stderr as
/// "backspring: error: TEXT" and every rank returns ERR_TOLD; else 0. Use as PetscCall(agree(comm, fault)).
PetscErrorCode agree(MPI_Comm comm, const Fault& fault);

/// Collective, with the same fault on every rank: it is reported once; returns ERR_TOLD.
PetscErrorCode tell(MPI_Comm comm, Exit exit, const std::string& text);

/// Collective. One line "backspring: warning: TEXT" on stderr, from rank 0.
PetscErrorCode warn(MPI_Comm comm, const std::string& text);

/// Not collective: for faults that occur on some ranks only, which must not wait for the others. Rank 0 reports at once, another rank
/// after waiting one second; then, on several ranks, the program ends by MPI_Abort(exit). On one rank: returns ERR_TOLD.
PetscErrorCode tell_alone(Exit exit, const std::string& text);

/// Exit code of the fault reported last (ok if none).
Exit told_exit();

/// Replaces PETSc's error handler: a PETSc error becomes one line from one rank; `phase_exit` is the exit code of such
/// an error in the present phase of the run (input while setting up, solve while stepping, io while writing).
/// On several ranks a PETSc error that has not been reported ends the program at once (MPI_Abort): it need not be collective. On one rank
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

/// Collective. The text of the fault with the smallest `where` (then rank) on every rank; empty if no rank has one. Nothing is reported.
PetscErrorCode shared_fault(MPI_Comm comm, const Fault& fault, std::string* text);

// Shared by fault.cpp, error_handler.cpp and their tests: how messages are printed.

/// "backspring: KIND: TEXT" on stderr as one line, control characters blanked.
void print_line(const char* kind, const std::string& text);

/// Records that a fault with this exit code has been reported.
void mark_told(Exit exit);

/// Resets that record, for tests.
void forget_faults();

}  // namespace bs
