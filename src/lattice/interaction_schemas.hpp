// The interactions of several particles as readers, writers and checks see them; their laws are in physics/interactions.
#pragma once
#include <vector>

namespace bs {

/// One column of a law's table.
struct InteractionParameter {
  const char *name, *label, *unit;  ///< of the dataset; in messages
};

/// A law as readers, writers and checks see it.
struct InteractionSchema {
  const char* title;     ///< "angle spring"
  const char* group;     ///< singular; datasets of a lattice stand in /<group>s, of a trajectory as /connectivity/<group>s
  const char* topology;  ///< dataset of the rows of particles
  int ends, center;      ///< number of ends; the one that the nearest images of the others are sought at
  std::vector<InteractionParameter> parameters;
  /// Which parameter is impossible in `dim` dimensions (its index, and what to write); -1: none.
  int (*bad_parameter)(const double* p, int dim, const char** remedy);
  int least_dim;  ///< dimensions of space it needs
  /// Null, or why there is no force with the ends at x.
  const char* (*fault)(int dim, const double* const* x, const double* p);
};

/// What no law exceeds: records of fixed size travel between ranks.
inline constexpr int MOST_ENDS = 4, MOST_INTERACTION_PARAMETERS = 4;

/// One for each kind; a lattice's interactions are in this order.
const std::vector<InteractionSchema>& interaction_schemas();

}  // namespace bs
