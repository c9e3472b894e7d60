// Options that a checkpoint brought and not the user. A checkpoint may be somebody else's: what it names is not written, and read only where the user
// already is.
#pragma once
#include <petscsys.h>
#include <string>

namespace bs {

struct RecalledOption {
  std::string from, folder;    ///< the checkpoint, and where its run was started
  std::string written, value;  ///< as they stand in it
  bool own;                    ///< it names the trajectory or the checkpoint that this run goes on with
};

/// Local. From now on `option` (with its dash, in any case) counts as brought by a checkpoint.
void note_recalled(MPI_Comm comm, const std::string& option, const RecalledOption& of);

/// Local. The value of `option` for the next checkpoint: a file of the run's own keeps the name it had where the run was started, as all others do.
std::string value_to_save(MPI_Comm comm, const std::string& option, const std::string& value);

/// Local. Whether a checkpoint brought it, and the folder in which the run of that checkpoint was started; empty if none brought it.
bool is_recalled(MPI_Comm comm, const std::string& option);
std::string folder_of_recalled(MPI_Comm comm, const std::string& option);

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
