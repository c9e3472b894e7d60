// Search for files by name: those installed with the program (option files, meshes) are found from any folder. Text files, read once and given to
// every rank.
#pragma once
#include <petscsys.h>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// Local. Whether a file of this name exists and is not a folder.
bool is_file(const std::string& name);

/// The folder part of a file's path; "." where the path has none.
std::string folder_of(const std::string& file);

/// Folders that hold the program's own options/ and meshes/, in the order in which they are searched: PREFIX/share/
/// backspring of an installed program PREFIX/bin/backspring, and what the build folder links to.
std::vector<std::string> shared_folders();

/// Local. The folders of the option files given, where find_input looks first.
void set_option_folders(MPI_Comm comm, const std::vector<std::string>& folders);

/// Collective. To be called for every file that is read because `option` names it. Where there is no file `name`, replaces it by the first file of
/// that name beside the option files given, in a shared folder or in its meshes/; where there is none, leaves `name` as it is. Keeps the name for
/// input_files(). Ends the run with exit code 2 where the option comes from a checkpoint and the file lies outside the folders that a checkpoint may
/// name (base/option_names.hpp).
PetscErrorCode find_input(MPI_Comm comm, const std::string& option, std::string* name);

/// Local. The inputs found so far: option and path, in order; an option can name several.
const std::vector<std::pair<std::string, std::string>>& input_files(MPI_Comm comm);

/// Where find_input looks for `name`, in words.
std::string input_places(MPI_Comm comm, const std::string& name);

/// What examine_file found on this rank.
struct FileStatus {
  std::string error;    ///< one line, empty if it is a readable file
  long long bytes = 0;  ///< its size
};

/// Local. Whether `path` is a file that can be read, and its size.
FileStatus examine_file(MPI_Comm comm, const std::string& path);

/// Collective. Rank 0 reads the whole file, every rank gets it. Errors (exit 2): missing, a folder, unreadable, above
/// 1 GB.
PetscErrorCode read_text_file(MPI_Comm comm, const std::string& path, std::string* text);

}  // namespace bs
