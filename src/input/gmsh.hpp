// Lattices from Gmsh meshes: a particle on every vertex, a spring on every edge of an element.
#pragma once
#include <petscsys.h>
#include <string>

#include "lattice/generator.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Reads a .msh file (2.2 or 4.1, text or binary) through DMPlex on rank 0 and hands each rank its chunk.
/// Masses, stiffness, damping, rest-length factor and d (the leading components, 0: 3) come from `spec`; each edge gives
/// one spring, also where several line elements lie on it. Particles are in the order of DMPlex's vertices.
///
/// Errors (exit 2): not a mesh, truncated, another version, no edges, neither mass given, dropped components that vary.
PetscErrorCode read_gmsh(MPI_Comm comm, const std::string& path, const GeneratorSpec& spec, Lattice* out);

}  // namespace bs
