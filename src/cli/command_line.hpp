// Checks of the command line and of option files, which PETSc itself does not check, before it reads them. What -help prints.
#pragma once
#include <string>
#include <vector>

namespace bs {

/// Before PetscInitialize, on every rank. Replaces NAME of every "-options_file NAME" (and -options_file_yaml) that does
/// not exist by the first that is a file among FOLDER/NAME and FOLDER/{options,options/problems,options/solvers}/NAME of
/// the shared folders (base/find_file.hpp), NAME with and without .yaml; adds the folders of the files to `folders`. Returns the error message for
/// one that is not found; empty if all are.
std::string find_option_files(int argc, char** argv, std::vector<std::string>* folders);

/// Local. One line that says what is wrong with the option files named by -options_file and -options_file_yaml on the
/// command line or in PETSC_OPTIONS: missing, a folder, unreadable, or no YAML that holds options; empty if nothing is.
/// Call before PetscInitialize: PETSc's own reader names neither file nor line.
std::string fault_of_option_files(int argc, const char* const* argv);

/// Local. One line about YAML text that PETSc would refuse or misread, beginning with `name` and the line; or nothing.
std::string fault_of_yaml(const std::string& text, const std::string& name);

/// Local. Those of `words` that are neither options nor values of one: PETSc ignores them silently.
std::vector<std::string> stray_words(const std::vector<std::string>& words);

/// Local. One line about the first of `words` that is an option written in the form of other programs, -option=value or
/// --option; or nothing.
std::string fault_of_form(const std::vector<std::string>& words);

// What -help prints: the program's own options first, then those of PETSc under a heading of their own.

/// Local. Replaces --help and -h by -help, and --version by -bs_version, in the words of the command line.
void translate_common_flags(int argc, char** argv);

/// Local. Where the command line has -help, all that PETSc prints is collected from now on; before PetscInitialize.
void collect_help(int argc, const char* const* argv);

/// Local. What is collected from now on is of runs that -help makes of other tasks and models: only the program's own options that were not listed
/// before are taken of it.
void collect_help_of_others();

/// Local. Prints what was collected on this rank, the program's own sections first.
void print_help();

}  // namespace bs
