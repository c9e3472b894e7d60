// Matrices and vectors from files, distributed by rows as they are read.
#pragma once
#include <petscmat.h>
#include <string>
#include <vector>

namespace bs {

/// Collective. `path`: Matrix Market text (.mtx, or a first line that begins with %%MatrixMarket) or PETSc binary
/// (.bin, .petsc, .dat). Rank 0 reads it and hands each piece of it to the owners of its rows at once. `option` is named in messages. Exit code 2
/// if it cannot be read.
PetscErrorCode load_matrix(MPI_Comm comm, const std::string& path, const std::string& option, Mat* out);

/// Collective. Fills `x`, whose layout is set, from Matrix Market (one column), PETSc binary (a Vec), or CSV: a number
/// a line, or `name,value` with a header; `names` receives the names, if there are any (on every rank).
PetscErrorCode load_vector(MPI_Comm comm, const std::string& path, const std::string& option, Vec x, std::vector<std::string>* names);

}  // namespace bs
