// The options that are given, also those whose names the user makes up, and the files that they name.
#pragma once
#include <petscsys.h>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// Local. Whether `option` (with its dash) is given. It counts as used from then on.
bool is_given(const std::string& option);

/// Local. The time at which motions start: -ts_init_time, or 0 [s].
PetscErrorCode read_start_time(PetscReal* time);

/// Local. The words of PETSC_OPTIONS.
std::vector<std::string> words_of_environment();

/// Local. Whether the flag `option` (with its dash) is given and not switched off. is_given() is for options that are no flags.
PetscErrorCode is_on(const char* option, bool* yes);
/// Local. The first of them that is on; empty if none is. All count as used.
PetscErrorCode first_on(std::initializer_list<const char*> options, std::string* first);

/// Local. Puts it among the options, with that value or with none, unless it is there. Set here it does not count as used.
PetscErrorCode set_unless_given(const std::string& option, const char* value);

/// Collective. PetscInitialize with the words of a command line, without the files .petscrc and petscrc that PETSc would read from the home folder
/// and from the working folder: they may be somebody else's, and an option can load code (-dll_append). `-skip_petscrc false` among the words asks
/// for them. `help`: what -help begins with, or null. Once: PETSc keeps the words.
PetscErrorCode start_petsc(const std::vector<char*>& words, const char* help);

/// Collective. PetscFinalize, which tells of unused options where -options_left asks for it; since 3.20 it would in any case.
PetscErrorCode end_petsc();

/// Local. Its value, empty where it has none; `otherwise` where it is not given.
std::string value_of(const std::string& option, const std::string& otherwise = "");

/// Names (without dash) and values of all options, in their order in PETSc's table, which is the same on every rank.
PetscErrorCode options_in_force(std::vector<std::pair<std::string, std::string>>* options);

/// What follows `begin` (without the dash) in the names of the options that begin with it and are given, in their order in PETSc's
/// table, which is the same on every rank.
PetscErrorCode option_endings(const std::string& begin, std::vector<std::string>* endings);

/// Collective. Ends the run with exit code 4, before anything is computed, where a value of the form [ascii|binary|...]:FILE[:...] of an option of
/// PETSc's, such as -log_view :F, names a file that cannot be written; with 2 where PETSc would find at the very end that it cannot read a value.
PetscErrorCode check_viewers(MPI_Comm comm);

/// Collective. Ends the run with exit code 2 where a tolerance of PETSc's solvers, under whatever prefix, is negative or no number, or a relative one
/// not below 1: since 3.22 some negative numbers are PETSc's words for "as before", which it takes without a word.
PetscErrorCode check_tolerances(MPI_Comm comm);

}  // namespace bs
