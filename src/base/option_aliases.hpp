// Names of PETSc's options that changed between its versions: either is understood, whichever PETSc is linked.
#pragma once
#include <petscsys.h>
#include <functional>
#include <string>
#include <vector>

namespace bs {

/// Local. The name (with its dash) that the program keeps of an option: -ts_dt for -ts_time_step, any other as it is.
std::string kept_name(const std::string& name);

/// Local. The value that the PETSc linked here knows: l2 or secant of -snes_linesearch_type.
std::string known_value(const std::string& name, const std::string& value);

/// Local. Replaces names in the words of the command line by those that are kept.
void translate_old_and_new_names(int argc, char** argv);

/// Collective. The same for the options in force. Of an option under both names that among `words`, the command line, holds; error (exit 2) where
/// neither is there.
PetscErrorCode unify_option_names(MPI_Comm comm, const std::vector<std::string>& words = {});

/// Collective. Calls `read`, a reader of PETSc's TS, while the options in force have the names that it reads.
PetscErrorCode with_names_of_petsc(MPI_Comm comm, const std::function<PetscErrorCode()>& read);

}  // namespace bs
