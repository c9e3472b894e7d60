// Bodies that nothing holds: particles tied to one another, but to no fixed particle and no anchor.
#pragma once
#include <cstdint>
#include <vector>
#include "base/handle.hpp"
#include "network/ghost_copies.hpp"
#include "network/network.hpp"

namespace bs {

struct FreeBodies {
  PetscInt count = 0;
  std::int64_t driven_row = -1;  ///< smallest row in the input of a particle of a body that is driven; -1: none is
};

/// Collective. label: (n) the smallest global index in the particle's body, the same on every rank that has a part of it.
PetscErrorCode label_bodies(const Network& net, GhostCopies* copies, std::vector<double>* label);

/// Bit c of each owned particle: something beyond its body holds it along axis c.
std::vector<std::uint8_t> held_axes(const Network& net);

/// Collective. `load`: (n, d) forces that depend on neither place nor time; a body is driven where theirs add up to more than rounding.
PetscErrorCode find_free_bodies(const Network& net, const std::vector<double>& load, FreeBodies* out);

/// Where bodies that nothing holds are: their forces do not say, so that what solvers leave there by chance is taken back.
class BodyPlaces {
 public:
  /// Collective. Finds the bodies that springs as they are now tie together.
  PetscErrorCode create(const Network& net);
  /// Collective. Every body moves, in `to`, to where its centre of mass X follows the map A (d, d):  X(to) = A X(from),  along the axes that nothing
  /// of it is held along. States of blocks (x, v); v is the change of x over `h`, and changes with it.
  PetscErrorCode pull_back(const double* A, double h, Vec from, Vec to) const;

 private:
  PetscErrorCode add_up(std::vector<double>* values) const;

  const Network* net_ = nullptr;
  std::vector<PetscInt> body_;      ///< (n) of each owned particle, by its place among those of this rank; -1: it is fixed
  std::vector<double> mass_;        ///< of each body of this rank, whole [kg]
  std::vector<std::uint8_t> held_;  ///< bit c: of each body, some particle is held along axis c
  VecHandle whole_, mine_;          ///< a number of each body: at the rank of its label, and of those of this rank
  ScatterHandle scatter_;
  bool any_ = false;  ///< some body of any rank is free along some axis
};

}  // namespace bs
