// Options by groups of particles, such as -bs_motion_NAME.
#pragma once
#include <petscsys.h>
#include <string>
#include <utility>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// Place of a group among the lattice's, and the text of its option.
using GroupOptions = std::vector<std::pair<std::size_t, std::string>>;

/// Collective. The options that begin with `begin` ("bs_motion_") and go on with a group's name, in the order of the groups; `title` and `help`: for
/// -help. Error (exit 2): there is no group of that name.
PetscErrorCode read_options_of_groups(MPI_Comm comm, const Lattice& lattice, const std::string& begin, const char* title, const char* help,
                                      GroupOptions* out);

}  // namespace bs
