// Groups of particles that options or a lattice file name.
#pragma once
#include <petscsys.h>
#include <string>
#include <utility>
#include <vector>

#include "base/options.hpp"
#include "input/hdf5_file.hpp"
#include "lattice/groups.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Names of groups with the texts of their options.
using GroupTexts = std::vector<std::pair<std::string, std::string>>;

/// Reads every -bs_group_NAME.
void read_group_options(Section& section, GroupTexts* out);

/// Collective. What they mean for a lattice of `total` particles in `dim` dimensions that extend along the first `axes` axes. Error (exit 2):
/// a text that chooses nothing known.
PetscErrorCode parse_groups(MPI_Comm comm, const GroupTexts& texts, int dim, int axes, std::int64_t total, std::vector<GroupSpec>* out);

/// Collective. /groups/NAME: rows of particles, integers, of a lattice or a trajectory whose particles' rows are known. Errors (exit 2):
/// names that are none, rows that are not there.
PetscErrorCode read_hdf5_groups(MPI_Comm comm, const Hdf5File& file, Lattice* lattice);

/// Collective. Error (exit 2): the lattice has no group of one of these names, which `option` gives.
PetscErrorCode require_groups(MPI_Comm comm, const std::string& option, const std::vector<std::string>& names, const Lattice& lattice);

/// Collective. Error (exit 2): a group without particles.
PetscErrorCode refuse_empty_groups(MPI_Comm comm, const Lattice& lattice);

}  // namespace bs
