// Calls of a session: its options, its errors, and silence of the libraries.
#pragma once
#include <petscsys.h>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/option_aliases.hpp"
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
      for (const auto& [name, value] : *some)
        PetscCall(PetscOptionsSetValue(table_, kept_name(name).c_str(), value.empty() ? nullptr : known_value(name, value).c_str()));
    PetscFunctionReturn(0);
  }
  PetscOptions get() const { return table_; }
  mutable bool in_force = false;  ///< during a call; always, where they are the caller's

 private:
  PetscOptions table_ = nullptr;
};

/// While it lives, a session's options are those in force, errors of PETSc's are its own, and HDF5 prints nothing. Nothing is changed where its
/// options are in force already: within an observer, and where they are the caller's.
class Inside {
 public:
  Inside(MPI_Comm comm, const OptionTable& options) {
    if (options.in_force) return;
    errors_.emplace(comm);
    quiet_.emplace();
    clear_error(comm);
    (void)PetscOptionsPush(options.get());
    pushed_ = &options;
    options.in_force = true;
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  ~Inside() {
    if (!pushed_) return;
    (void)PetscOptionsPop();
    pushed_->in_force = false;
  }

 private:
  std::optional<PetscErrors> errors_;
  const OptionTable* pushed_ = nullptr;  ///< null: they were in force before
  std::optional<QuietHdf5> quiet_;
};

/// A duplicate of `comm` with a context of its own, to be freed by the caller; `warned` is called with what is warned of on it.
inline MPI_Comm own_communicator(MPI_Comm comm, std::function<void(const std::string&)> warned) {
  MPI_Comm own = MPI_COMM_NULL;
  Listener listener;
  MPI_Comm_dup(comm, &own);
  drop_context(own);  // that of the caller's communicator
  listener.warning = std::move(warned);
  set_listener(own, listener);
  return own;
}

/// `options` from the settings of a session and those of a call.
inline Error filled(MPI_Comm comm, const Settings& settings, const Settings& more, OptionTable* options) {
  const PetscErrors errors(comm);
  clear_error(comm);
  return outcome(comm, options->fill(settings, more));
}

}  // namespace bs
