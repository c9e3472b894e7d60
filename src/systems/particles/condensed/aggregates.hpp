// Groups of a rank's free particles that a coarse space moves as rigid bodies: compact, connected by springs, of about equal size.
// Groups overlap: a particle near the edge of its own has shares in those beside it, so that what the groups move by passes into each
// other smoothly. They depend on the lattice alone.
#pragma once
#include <cstdint>
#include <vector>
#include "systems/particles/condensed/spring_matrix.hpp"

namespace bs {

/// Shares of owned particles in groups, which sum to 1 for each that has any: compressed rows.
struct Shares {
  static constexpr int MOST = 8;  ///< of one particle
  std::vector<PetscInt> start;
  std::vector<std::int32_t> group;
  std::vector<float> share;
};

class Aggregates {
 public:
  /// Of about `particles` each, by halving the free particles across their longest extent at the start, then apart where no spring
  /// connects. `steps` of blending make them overlap. Particles tied to no other free one are in no group.
  void create(const SpringMatrix& S, PetscInt particles, int steps);
  PetscInt count() const { return count_; }
  const Shares& shares() const { return shares_; }

 private:
  void part(const SpringMatrix& S, PetscInt particles);
  void connect(const SpringMatrix& S, PetscInt least);
  void blend(const SpringMatrix& S, int steps);
  PetscInt count_ = 0;
  std::vector<std::int32_t> of_;  ///< the group of each owned particle; -1: none
  Shares shares_;
};

}  // namespace bs
