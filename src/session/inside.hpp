// Calls of a session: its options, its errors, and silence of the libraries.
#pragma once
#include <petscsys.h>
#include "base/error.hpp"
#include "input/hdf5_file.hpp"
#include "session/session.hpp"

namespace bs {

/// Options of PETSc's that are a session's own.
class OptionTable {
 public:
  OptionTable() = default;
  OptionTable(const OptionTable&) = delete;
  OptionTable& operator=(const OptionTable&) = delete;
  ~OptionTable() { (void)PetscOptionsDestroy(&table_); }
  PetscErrorCode fill(const Settings& settings, const Settings& more) {
    PetscFunctionBegin;
    PetscCall(PetscOptionsCreate(&table_));
    for (const Settings* some : {&settings, &more})
      for (const auto& [name, value] : *some) PetscCall(PetscOptionsSetValue(table_, name.c_str(), value.empty() ? nullptr : value.c_str()));
    PetscFunctionReturn(0);
  }
  PetscOptions get() const { return table_; }
  mutable bool in_force = false;  ///< during a call

 private:
  PetscOptions table_ = nullptr;
};

/// While it lives, a session's options are those in force, errors of PETSc's are its own, and HDF5 prints nothing.
class Inside {
 public:
  Inside(MPI_Comm comm, const OptionTable& options) : errors_(comm), pushed_(!options.in_force) {
    clear_error(comm);
    options_ = &options;
    if (pushed_) (void)PetscOptionsPush(options.get());  // not twice, as within an observer: it would be its own predecessor
    options.in_force = true;
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  ~Inside() {
    if (!pushed_) return;
    (void)PetscOptionsPop();
    options_->in_force = false;
  }

 private:
  PetscErrors errors_;
  const OptionTable* options_ = nullptr;
  bool pushed_;
  QuietHdf5 quiet_;
};

/// The error that a call on `comm` ended with; without text where `code` is 0.
inline Error outcome(MPI_Comm comm, PetscErrorCode code) {
  if (code == 0) return {};
  Error error = last_error(comm);
  const char* generic = nullptr;
  if (error) return error;
  (void)PetscErrorMessage(code, &generic, nullptr);
  error.text = generic ? generic : "unknown error";
  error.exit = present_phase(comm);
  return error;
}

/// `options` from the settings of a session and those of a call.
inline Error filled(MPI_Comm comm, const Settings& settings, const Settings& more, OptionTable* options) {
  const PetscErrors errors(comm);
  clear_error(comm);
  return outcome(comm, options->fill(settings, more));
}

}  // namespace bs
