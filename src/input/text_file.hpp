// A text file, read once and given to every rank.
#pragma once
#include <petscsys.h>
#include <string>

namespace bs {

/// What a look at a path on this rank found.
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
