// The lattice of the options as a file: -bs_task generate.
#pragma once
#include <petscsys.h>
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Writes the lattice that the options name, made or read, complete and checked, to -bs_output, in the form that -bs_lattice_file reads.
/// `given`: the lattice, whole and the same on every rank; null: the options name one. Errors: no such file name, or a linear system (exit 2); what
/// cannot be written (exit 4).
PetscErrorCode write_lattice(MPI_Comm comm, const Lattice* given);

}  // namespace bs
