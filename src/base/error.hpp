// Errors that a user can correct, and warnings: values of a communicator, never the end of the process. What becomes of them, its owner decides.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>
#include "base/facts.hpp"
#include "base/text.hpp"

namespace bs {

/// Kinds of errors, by the exit codes of the program (130 and 143 are added by signals).
enum class Exit : int { ok = 0, input = 2, solve = 3, io = 4 };

/// Code that PetscCall passes up once an error is held by the communicator; it prints nothing on the way.
constexpr PetscErrorCode ERR_FAILED = 20001;

/// One error. `where` (row or line number) orders errors found on several ranks: the smallest counts.
struct Error {
  std::int64_t where = std::numeric_limits<std::int64_t>::max();
  std::string text;  ///< what was read, where (file, line or dataset, id), and what to write instead
  Exit exit = Exit::input;
  explicit operator bool() const { return !text.empty(); }
  /// Keeps the error of the smaller `where`.
  void note(std::int64_t at, std::string what, Exit code = Exit::input);
};

/// Collective, with the same error on every rank: the communicator holds it; returns ERR_FAILED.
PetscErrorCode fail(MPI_Comm comm, Exit exit, const std::string& text);

/// Collective. If any rank has an error, every rank holds the one with the smallest `where` (then rank) and returns ERR_FAILED; else 0.
/// Use as PetscCall(fail_if_any(comm, error)).
PetscErrorCode fail_if_any(MPI_Comm comm, const Error& error);

/// Not collective: for errors of some ranks only, which must not wait for the others. This rank holds it; returns ERR_FAILED. On several ranks the
/// others may wait for this one without end: the owner of the communicator has to end them (Listener).
PetscErrorCode fail_here(MPI_Comm comm, Exit exit, const std::string& text);

/// Collective. The text of the error with the smallest `where` (then rank) on every rank; empty if no rank has one. It is not held.
PetscErrorCode first_error(MPI_Comm comm, const Error& error, std::string* text);

/// Collective, and on rank 0 alone: something that is met and gone on with. The text is passed on once; `key` names it among the Warnings of the run.
PetscErrorCode warn(MPI_Comm comm, const std::string& key, const std::string& text);
PetscErrorCode warn_here(MPI_Comm comm, const std::string& key, const std::string& text);

/// Local. The error that `comm` holds, without text if there is none; the reference stays good as long as the communicator's context.
const Error& last_error(MPI_Comm comm);
void clear_error(MPI_Comm comm);

/// Local. The error of a call on `comm` that returned `code`: the one held, or what PETSc says of a code that came up alone; without text where
/// `code` is 0.
Error outcome(MPI_Comm comm, PetscErrorCode code);

/// What the owner of a communicator does at once with errors and warnings; by default nothing.
struct Listener {
  std::function<void(const Error&, bool alone)> error;      ///< on every rank; `alone`: on this rank only, the others know nothing
  std::function<void(const std::string& warning)> warning;  ///< on the first rank, or the one that warns
};
void set_listener(MPI_Comm comm, Listener listener);

/// Local. The kind that an error of PETSc's has from now on: input while setting up, solve while stepping, io while writing.
void set_phase(MPI_Comm comm, Exit phase);
Exit present_phase(MPI_Comm comm);

/// While it lives, errors of PETSc's become errors of `comm`: in the words of a user, with the kind of the present phase, the first one of several,
/// and no traceback is printed. They need not be collective (fail_here).
class PetscErrors {
 public:
  explicit PetscErrors(MPI_Comm comm) : comm_(comm) { (void)PetscPushErrorHandler(handle, this); }
  PetscErrors(const PetscErrors&) = delete;
  PetscErrors& operator=(const PetscErrors&) = delete;
  ~PetscErrors() { (void)PetscPopErrorHandler(); }

 private:
  static PetscErrorCode handle(MPI_Comm, int, const char*, const char*, PetscErrorCode, PetscErrorType, const char*, void*);
  MPI_Comm comm_;
  bool busy_ = false;
};

/// One list for a run, whatever its task: a warning is printed once, counted in the last line, named in the report, and stays with a run that is
/// continued from a checkpoint. It has those given before any run, of the input, and those given while it is the latest one.
class Warnings {
 public:
  explicit Warnings(MPI_Comm comm);
  Warnings(const Warnings&) = delete;
  Warnings& operator=(const Warnings&) = delete;
  ~Warnings();
  /// Collective. A second one of that key is left out.
  PetscErrorCode add(const std::string& key, const std::string& text);
  bool has(const std::string& key) const;
  /// Local, complete on rank 0.
  const std::vector<std::string>& keys() const { return keys_; }
  /// Collective.
  PetscErrorCode save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  MPI_Comm comm_;
  std::vector<std::string> keys_;
};

}  // namespace bs
