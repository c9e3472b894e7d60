// What -bs_task names, as sessions do it: before a task reads its options, and where it only lists them.
#pragma once
#include <set>
#include <string>
#include <vector>
#include "session/session.hpp"

namespace bs {

/// Registers the program's own types of TS, PC and line searches; after PetscInitialize.
PetscErrorCode register_types();

/// Collective. Once for a table of options, while it is in force and before the program's are read: types that they may name are registered, those
/// that a checkpoint brings (-bs_restart) are taken, names of another PETSc's are made this one's, and files that PETSc's viewers are to write and
/// tolerances of its solvers are looked at.
PetscErrorCode take_up_options(MPI_Comm comm);

/// A task with one of the kinds of model that it has, as the options name them.
struct Variant {
  const char *task, *model;
};

/// All of them. A task without a model has no option that others have not.
const std::vector<Variant>& variants();

/// Collective. The task reads its options as under -help, `more` being given, and computes nothing. Those of `more` that it has not asked for stay in
/// `left`, unless that is null.
PetscErrorCode rehearse(MPI_Comm comm, const Variant& variant, const Settings& more = {}, std::set<std::string>* left = nullptr);

}  // namespace bs
