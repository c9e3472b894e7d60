// Search for files by name: those installed with the program (option files, meshes) are found from any folder.
#pragma once
#include <petscsys.h>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// Folders that hold the program's own options/ and meshes/, in the order in which they are searched: PREFIX/share/
/// backspring of an installed program PREFIX/bin/backspring, and what the build folder links to.
std::vector<std::string> shared_folders();

/// Before PetscInitialize, on every rank. Replaces NAME of every "-options_file NAME" (and -options_file_yaml) that does
/// not exist by the first that is a file among FOLDER/NAME and FOLDER/{options,options/problems,options/solvers}/NAME of
/// the shared folders, NAME with and without .yaml. Returns the error message for one that is not found; empty if all are.
std::string find_option_files(int argc, char** argv);

/// Collective. To be called for every file that is read because `option` names it. Replaces `name` of an input file that is no file by the first that
/// is one: beside an option file given, in a shared folder, in meshes/ of one; otherwise `name` stays as it is. Remembers it. Ends the run with exit
/// code 2 where a checkpoint brought the option and the file lies elsewhere (base/recalled.hpp).
PetscErrorCode find_input(MPI_Comm comm, const std::string& option, std::string* name);

/// Local. The inputs found so far: option and path, in order; an option can name several.
const std::vector<std::pair<std::string, std::string>>& input_files();

/// Where find_input looks for `name`, in words.
std::string input_places(const std::string& name);

}  // namespace bs
