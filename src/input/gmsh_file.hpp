// Checks of a Gmsh file before DMPlex reads it, and the reading itself, on one rank.
#pragma once
#include <petscdmplex.h>
#include <string>

namespace bs {

/// Local. Reads the whole file; returns one line that says why it cannot be read, or nothing.
std::string read_gmsh_text(const std::string& path, std::string* text);

/// Local (PETSC_COMM_SELF). Reads the mesh with its edges, in three dimensions of space unless the user has set
/// -dm_plex_gmsh_spacedim; *error is PETSc's reason where that failed, and *mesh is null then.
PetscErrorCode plex_from_gmsh(const std::string& path, DM* mesh, std::string* error);

}  // namespace bs
