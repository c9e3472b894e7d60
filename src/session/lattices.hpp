// Lattices between files, options and arrays in memory, for programs that compute with the library. As with a Session errors are values and nothing
// is printed; both calls are collective on `comm`, of which they work on a duplicate with the options of `settings` alone.
#pragma once
#include <string>
#include <vector>
#include "session/session.hpp"

namespace bs {

/// The lattice that the settings name (-bs_lattice_file, -bs_lattice_type) with all that they change of it (-bs_lattice_..., -bs_group_...,
/// -bs_anchor_..., -bs_spring_..., laws), complete and checked, whole on every rank, in the order of the input. A Session of it computes what one of
/// the settings does, to the bit on one rank; what they say beside the lattice (loads, motions, steps) is for the Session and without effect here.
/// `warnings`: of what, on the first rank. Errors: as of a run with these settings.
Error read_lattice(MPI_Comm comm, const Settings& settings, LatticeArrays* out, std::vector<std::string>* warnings = nullptr);

/// A lattice file (.h5, .hdf5) of `lattice`, which is the same on every rank, with what the settings change of it; one that is there is replaced
/// where they have -bs_overwrite. -bs_lattice_file reads it. Errors: no lattice, an impossible name (Exit::input); what cannot be written (Exit::io).
Error write_lattice(MPI_Comm comm, const LatticeArrays& lattice, const Settings& settings, const std::string& file,
                    std::vector<std::string>* warnings = nullptr);

}  // namespace bs
