// Where lattices and trajectories keep what in an HDF5 file, and what the file says about itself.
#pragma once
#include <petscsys.h>
#include <string>

#include "input/hdf5_file.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Where a kind of file keeps what.
struct Hdf5Layout {
  bool trajectory;
  std::string position, velocity, mass, fixed, id;
  std::string springs, pairs, stiffness, rest_length, damping;
  /// Where particles keep other numbers than these (lattice/columns.hpp).
  std::string particle_column(const std::string& name) const { return (trajectory ? "/particles/trajectory/" : "/particles/") + name; }
  /// Where springs keep other numbers than these: what laws take, and what they carry from step to step.
  std::string column(const std::string& name) const { return (trajectory ? "/connectivity/bonds_" : "/springs/") + name; }
  std::string history(const std::string& name) const { return trajectory ? "/backspring/" + name + "/value" : "/springs/" + name; }
};

/// The layout of `file`: a trajectory's where it has frames, else a lattice's.
const Hdf5Layout& layout_of(const Hdf5File& file);

/// Local. d of a trajectory whose positions have `columns` components: those written as padding do not count.
int box_dimension(const Hdf5File& file, int columns);

/// Collective. Sets the lattice's laws, and whether the file gives them. Error (exit 2): unknown law.
PetscErrorCode read_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* lattice);

/// Collective. The law of each spring, where the file gives one, into the lattice's chunk; whose rows are known. Errors (exit 2):
/// no names or unknown ones, numbers that name none.
PetscErrorCode read_row_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* lattice);

/// Local. Warns of members of a lattice's groups that are none of the schema: a misspelt name of an optional dataset
/// would otherwise go unseen.
void note_unknown_members(const Hdf5File& file, Lattice* lattice);

}  // namespace bs
