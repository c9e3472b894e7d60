// Bodies that nothing holds: particles tied to one another, but to no fixed particle and no anchor.
#pragma once
#include <cstdint>
#include <vector>
#include "base/handle.hpp"
#include "network/network.hpp"

namespace bs {

/// Where bodies that nothing holds are: their forces do not say, so that what solvers leave there by chance is taken back.
class FreeBodies {
 public:
  /// Collective. Finds the bodies that springs as they are tie together, and how many of all ranks are held along no axis. `load`: (n, d) forces that
  /// depend on neither place nor time. Where those of a free body add up to more than rounding, and nothing else `may_hold` it, the run ends with
  /// exit code 2. `net` must outlive the object; `springs`, here and below, is another number wherever springs are others (Terms::version()).
  PetscErrorCode count(const Network& net, std::uint64_t springs, const std::vector<double>& load, bool may_hold, PetscInt* free);
  /// Collective. Every body that nothing may hold moves, in `to`, to where its centre of mass X follows the map A (d, d):  X(to) = A X(from),  along
  /// the axes that nothing of it is held along. States of blocks (x, v); v is the change of x over `h`, and changes with it.
  PetscErrorCode pull_back(std::uint64_t springs, const double* A, double h, Vec from, Vec to);

 private:
  PetscErrorCode find();
  PetscErrorCode find_held();
  PetscErrorCode add_up(std::vector<double>* values) const;

  const Network* net_ = nullptr;
  std::vector<PetscInt> label_;     ///< of each body of this rank: the smallest global index of its particles, ascending
  std::vector<PetscInt> body_;      ///< (n) of each owned particle, by its place among those of this rank; -1: it is fixed
  std::vector<double> mass_;        ///< of each body of this rank, whole [kg]
  std::vector<std::uint8_t> held_;  ///< bit c: of each body, some particle is held along axis c
  VecHandle whole_, mine_;          ///< a number of each body: at the rank of its label, and of those of this rank
  ScatterHandle scatter_;
  std::uint64_t found_ = 0;  ///< the springs, by their version, that the bodies are of
  bool adrift_ = false;      ///< no force depends on where a body is that nothing holds
  bool any_ = false;         ///< some body of any rank is free along some axis
};

}  // namespace bs
