// The tables of a lattice in an HDF5 file, of a trajectory or of a lattice file: where the readers of input/ look for them. And in its fingerprint.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "base/hash.hpp"
#include "input/hdf5_layout.hpp"
#include "lattice/lattice.hpp"
#include "network/network.hpp"
#include "systems/system.hpp"

namespace bs {

/// Collective. All that the lattice holds and a file of the layout `names` keeps once, moved out of it; the same datasets on every rank. A lattice
/// file keeps places, velocities, histories of springs, what is broken and the box, too, which are frames of a trajectory.
PetscErrorCode take_tables(MPI_Comm comm, const Hdf5Layout& names, Lattice* lattice, std::vector<Dataset>* out);

/// What a lattice file says of the lattice in attributes of /, by name.
std::vector<std::pair<std::string, std::string>> root_attributes(const Lattice& lattice);

/// ", 12 angle springs", or nothing.
std::string count_text(const Network& net);

// The numbers of tables that a lattice's fingerprint is summed over.

/// The interactions of the lattice's chunk. Nothing changes where there are none.
void add_to_fingerprint(const Lattice& lattice, RowSum* sum);

/// A table's number by its name, so that the order of columns does not matter.
inline std::uint64_t table_of(const std::string& name) {
  std::uint64_t table = 0;
  for (const char c : name) table = 131 * table + static_cast<unsigned char>(c);
  return table;
}

inline constexpr std::uint64_t INTERACTION_TABLES = 32;  ///< two of each kind, its ends and its numbers; those below are of springs and particles

/// Of numbers that may be given anew (lattice/lattice.hpp).
inline std::uint64_t numbers_table(const std::string& name) {
  if (const int kind = interaction_number(name).kind; kind >= 0) return INTERACTION_TABLES + 2 * static_cast<std::uint64_t>(kind) + 1;
  return name == "mass" ? 2 : name == "stiffness" ? 6 : name == "rest_length" ? 7 : name == "damping" ? 8 : 1000 + table_of(name);
}

}  // namespace bs
