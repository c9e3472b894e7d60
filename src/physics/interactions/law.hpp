// The data that a law of several ends (2, 3, 4, ...) provides. Its numbers come from a table of named parameters; its functions see
// the places of all its ends at once.
//
//   ends, parameters                how many; schema(): names, units, what is impossible
//   fault<d>(x, p)                  null, or why there is no force with the ends at x[0], ..., x[ends - 1]
//   energy<d>(x, p)                 [J]
//   force<d>(x, p, f)               on every end, (ends, d)
//   tangent<d, positive>(x, p, K)   df_a/dx_b for all pairs of ends, (ends d, ends d); positive: such that -K is semidefinite
//   energy_beyond_slope<d>(x, dx, p)  E(x + dx) - E(x) + f.dx, free of cancellation
//   rates<d>(x, p, rate)            sizes of -df_a/dx_a [N/m], for estimates of rounding errors
//
// Forces depend on places alone, tangents are symmetric. (History of an element would be more numbers in its row of the table.)
#pragma once
#include <string>
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
  int ends;
  std::vector<InteractionParameter> parameters;
  /// Which parameter is impossible in `dim` dimensions (its index, and what to write); -1: none.
  int (*bad_parameter)(const double* p, int dim, const char** remedy);
  int least_dim;  ///< dimensions of space it needs
  /// Null, or why there is no force with the ends at x.
  const char* (*fault)(int dim, const double* const* x, const double* p);
};

}  // namespace bs
