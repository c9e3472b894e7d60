// M, K = df/dx and D = df/dv as files, for other programs: -bs_write_matrices.
#pragma once
#include <string>
#include <vector>
#include "systems/model.hpp"

namespace bs {

/// Collective. Reads -bs_write_matrices; once, for every task.
PetscErrorCode read_matrix_options(MPI_Comm comm);

/// Local. What -bs_write_matrices gave, and the files that write_matrices() will write; empty: none.
const std::string& matrix_prefix(MPI_Comm comm);
std::vector<std::string> matrix_files(MPI_Comm comm);

/// Collective. A new vector: the state y with velocities of 0.
PetscErrorCode at_rest(Vec y, Vec* out);

/// Collective. Writes the matrices of `model` at (t, y), if that is asked for. A model that has none, or a file that cannot be written,
/// ends the run with exit code 2; a failure while writing with 4.
PetscErrorCode write_matrices(Model& model, double t, Vec y, bool overwrite);

}  // namespace bs
