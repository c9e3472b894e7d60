// What a spring can bear, by name: for the readers of lattices and options and for the criterion of breaking.
#pragma once
#include "base/powers.hpp"

namespace bs {

/// A limit of each spring. `name` is that of the dataset /springs/NAME and of the trajectory's /connectivity/bonds_NAME.
struct BreakLimit {
  const char *name, *option, *meaning, *unit;
  Powers powers;          ///< what `unit` is made of
  const char* threshold;  ///< of the trajectory's /connectivity/bonds_NAME: the limit times the factor drawn for the spring
};

enum { BREAK_STRAIN, BREAK_FORCE, BREAK_ENERGY, BREAK_LIMITS };

inline constexpr BreakLimit break_limits[BREAK_LIMITS] = {
    {"critical_strain", "-bs_break_strain", "strain |l - L|/L", "1", {0, 0, 0}, "threshold_strain"},
    {"critical_force", "-bs_break_force", "force along the spring without its damper's", "N", {1, 1, -2}, "threshold_force"},
    {"critical_energy", "-bs_break_energy", "elastic energy", "J", {1, 2, -2}, "threshold_energy"},
};

/// Dataset /springs/broken and field /backspring/broken: 1 where a spring is broken, 0 elsewhere.
inline constexpr const char* BROKEN = "broken";

}  // namespace bs
