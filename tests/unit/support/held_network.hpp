// A lattice made from options with what holds its particles and strains its box, and a state whose entries tell where they belong.
#pragma once
#include <petscvec.h>
#include <cmath>

#include "base/handle.hpp"
#include "input/load.hpp"
#include "network/network.hpp"
#include "options.hpp"
#include "systems/layout.hpp"
#include "systems/particles/constraints/constraints.hpp"

namespace bs {

struct HeldNetwork {
  Lattice lattice;
  Constraints constraints;
  Network net;
  VecHandle y;

  explicit HeldNetwork(const OptionTexts& texts) {
    const Given given(texts);
    NetworkOptions options;
    REQUIRE(load_lattice(PETSC_COMM_WORLD, &lattice) == 0);
    REQUIRE(read_network_options(PETSC_COMM_WORLD, &options) == 0);
    REQUIRE(constraints.read(PETSC_COMM_WORLD, &lattice) == 0);
    REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
    REQUIRE(constraints.create(&net) == 0);
    REQUIRE(VecCreateMPI(PETSC_COMM_WORLD, net.n * 2 * net.dim, PETSC_DETERMINE, y.out()) == 0);
    REQUIRE(VecSetBlockSize(y, 2 * net.dim) == 0);
    fill(0);
  }
  /// Entry k of the state of the particle with that global index; any number for any `turn`.
  double entry(PetscInt global, PetscInt k, int turn) const { return std::sin(1.3 * static_cast<double>(global * 2 * net.dim + k) + turn); }
  void fill(int turn) {
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArray(y, &a) == 0);
    for (PetscInt i = 0; i < net.n; ++i)
      for (PetscInt k = 0; k < 2 * net.dim; ++k) a[i * 2 * net.dim + k] = entry(net.first + i, k, turn);
    REQUIRE(VecRestoreArray(y, &a) == 0);
  }
};

}  // namespace bs
