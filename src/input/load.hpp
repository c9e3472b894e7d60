// From options to this rank's chunk of a lattice: a file or a generator, checked and complete.
#pragma once
#include <petscsys.h>

#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Reads the -bs_lattice_, -bs_spring_law, -bs_damping_law and -bs_anchor_ options and loads the lattice they
/// name. Afterwards the chunks are numbered, rest lengths filled in, values validated, warnings printed, and options the
/// input implies (an .xsp file's gravity, ...) are in the options database where the user set none: read the laws' own
/// options after this call. Every error in the input is reported (exit code 2) and returns ERR_FAILED.
/// `given`: a lattice in memory, whole and the same on every rank, in the place of one from a file: options that choose another source are refused.
PetscErrorCode load_lattice(MPI_Comm comm, Lattice* out, const Lattice* given = nullptr);

}  // namespace bs
