// What springs and particles carry by columns, on its way from the lattice's chunks to the network: each spring's law and what it takes, the numbers
// of particles.
#pragma once
#include <petscsys.h>
#include <vector>
#include "lattice/lattice.hpp"
#include "network/network.hpp"

namespace bs {

/// What the springs of a chunk take beyond stiffness and rest length, row by row.
class SpringRows {
 public:
  /// The lattice must outlive the object; its columns hold what its laws need.
  explicit SpringRows(const Lattice& lattice);
  int law(std::size_t k) const { return lattice_.law_by_row ? lattice_.spring_laws[k] : static_cast<int>(lattice_.spring_law); }
  /// The row's parameters, then its history, at most SPRING_WIDTH numbers; 0 where the lattice has no such column.
  void fill(std::size_t k, double* more) const;
  /// Its force per length, for estimates [N/m].
  double rate(std::size_t k) const;

 private:
  const Lattice& lattice_;
  std::vector<std::vector<const double*>> columns_;  ///< per law: where its numbers stand; null: nowhere
};

/// The law of anchors: the lattice's, or Hooke's where that one takes more than stiffness and rest length.
int anchor_law(const Lattice& lattice);

/// Collective. Gives the links of `net`, which are laid out, their laws; nothing where all springs are Hooke's or of the strain law.
PetscErrorCode give_laws(MPI_Comm comm, const Lattice& lattice, Network* net);

/// Collective. Gives the owned particles of `net`, which are laid out, the numbers in the lattice's columns.
PetscErrorCode give_columns(MPI_Comm comm, const Lattice& lattice, Network* net);

}  // namespace bs
