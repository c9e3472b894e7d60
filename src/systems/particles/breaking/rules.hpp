// Which parts break, and when: options and the lattice's limits.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>
#include "lattice/columns.hpp"
#include "lattice/lattice.hpp"

namespace bs {

struct BreakRules {
  enum Side { tension, compression, both };
  enum Scatter { none, weibull, uniform };
  /// The same for all springs whose lattice gives none; infinite: no limit.
  double limit[BREAK_LIMITS] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::infinity()};
  Side side = tension;
  bool worst = false;      ///< one part at a time, that of the largest excess; else every one past its limit
  Scatter scatter = none;  ///< of the limits, by a factor for each part
  double width = 0;        ///< Weibull modulus, or half width of the uniform distribution
  std::int64_t seed = 0;
  std::vector<std::string> spared;  ///< groups whose parts do not break
  bool notched = false;
  double notch[4] = {0, 0, 0, 0};  ///< from (x, y) to (x, y) [m]: springs that cross it at the start are broken

  /// Collective. Reads the -bs_break_ options. Errors (exit 2): values out of range; groups that the lattice has not; limits of the lattice that are
  /// no number > 0 or inf.
  PetscErrorCode read(MPI_Comm comm, const Lattice& lattice);
  /// Whether some spring may break.
  bool active(const Lattice& lattice) const;
  /// Factor of the limits of the spring of that row:
  ///   Weibull (-ln(1 - U))^(1/M);  uniform 1 + W (2U - 1);  U uniform in [0, 1) by the row
  double factor(std::int64_t row) const;
  /// For the header; empty where nothing breaks.
  std::string describe(const Lattice& lattice) const;
};

}  // namespace bs
