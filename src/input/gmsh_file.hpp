// What can be told about a Gmsh file before DMPlex reads it, and the reading itself, on one rank.
#pragma once
#include <petscdmplex.h>
#include <string>

namespace bs {

/// Local. One line that says why `path` is no Gmsh mesh that can be read; empty if nothing is wrong.
std::string fault_of_gmsh(const std::string& path);

/// Local (PETSC_COMM_SELF). Reads the mesh with its edges, in three dimensions of space unless the user has set
/// -dm_plex_gmsh_spacedim; *error is PETSc's reason where that failed, and *mesh is null then.
PetscErrorCode plex_from_gmsh(const std::string& path, DM* mesh, std::string* error);

}  // namespace bs
