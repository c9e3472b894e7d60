// Small generated lattices, and the networks that this rank's chunk of them makes.
#pragma once
#include <catch2/catch.hpp>
#include <vector>

#include "input/remote.hpp"
#include "lattice/generator.hpp"
#include "network/network.hpp"
#include "spoken.hpp"

namespace bs {

/// Stiffnesses 70, 40, 20 by the shell of neighbours, unit spacing, masses 0.5.
inline GeneratorSpec lattice(LatticeType type, std::vector<std::int64_t> size, int dim) {
  GeneratorSpec spec;
  spec.type = type;
  spec.size = std::move(size);
  spec.dim = dim;
  spec.particle_mass = 0.5;
  spec.stiffness = {70.0, 40.0, 20.0};
  return spec;
}

/// This rank's chunk, its rows numbered over all ranks.
inline Lattice chunk_of_lattice(MPI_Comm comm, const GeneratorSpec& spec) {
  Lattice part = generate(spec, rank_of(comm), size_of(comm));
  REQUIRE(number_rows(comm, &part.springs) == 0);
  for (InteractionRows& kind : part.interactions) REQUIRE(number_rows(comm, &kind.rows) == 0);
  return part;
}

}  // namespace bs
