// The options that are given, also those whose names the user makes up, and the files that they name; those that a checkpoint brought.
#pragma once
#include <petscsys.h>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// Local. Whether `option` (with its dash) is given. It counts as used from then on.
bool is_given(const std::string& option);

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

// Options that a checkpoint brought and not the user. A checkpoint may be somebody else's: what it names is not written, and read only where the user
// already is.

/// Local. From now on `option` (with its dash, in any case) counts as brought by the checkpoint `from`. `own`: it names the trajectory or the
/// checkpoint that this run goes on with.
void note_recalled(MPI_Comm comm, const std::string& option, const std::string& from, bool own);

/// Local. Whether a checkpoint brought it.
bool is_recalled(MPI_Comm comm, const std::string& option);

/// Collective. Takes `option` out of PETSc's table if a checkpoint brought it, unless it was noted as the run's own; to be called by the reader of
/// every option that names something to write.
PetscErrorCode withdraw_recalled(MPI_Comm comm, const std::string& option);

/// Collective. One warning with every option that was left out so far; for those left out later there is a warning each, at once.
PetscErrorCode leave_out(MPI_Comm comm, const std::string& from, const std::string& option, const std::string& value);
PetscErrorCode warn_left_out(MPI_Comm comm);

/// Local. Why the file `path`, which `option` names, is not read: a checkpoint brought the option, and the file is not a regular one below the
/// working folder, the checkpoint's or one of the program's. Empty if it is read.
std::string fault_of_recalled_input(MPI_Comm comm, const std::string& option, const std::string& path);

}  // namespace bs
