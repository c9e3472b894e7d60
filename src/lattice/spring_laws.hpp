// The laws of springs and dampers as readers, writers and checks see them; their formulas are in physics/pair.
#pragma once
#include <cstddef>
#include <string>
#include <utility>
#include <vector>
#include "lattice/columns.hpp"

namespace bs {

/// A number of each spring beyond stiffness and rest length. `name` is that of the dataset /springs/NAME, of the trajectory's
/// /connectivity/bonds_NAME and, for a whole lattice, of the option -bs_spring_NAME.
struct SpringParameter {
  const char *name, *meaning, *unit;
  Powers powers;          ///< what `unit` is made of
  bool nonnegative;       ///< else any finite number
  bool needed;            ///< else 0 where it is not given; of a law's parameters at least one must be
  bool positive = false;  ///< 0 is refused, too
};

/// A number that a spring carries from step to step; 0 at first, or /springs/NAME. Written as /backspring/NAME.
struct SpringHistory {
  const char *name, *unit;
  Powers powers;
};

/// A law of springs; its place in the list is what lattices and checkpoints hold.
struct SpringLawInfo {
  const char *name, *title;
  std::vector<SpringParameter> parameters;
  std::vector<SpringHistory> history;
  bool zero_rest, softens, relaxes;
  std::size_t width() const { return parameters.size() + history.size(); }
};

/// The most numbers that any law takes beyond stiffness and rest length.
inline constexpr std::size_t SPRING_WIDTH = 4;

/// All laws of springs.
const std::vector<SpringLawInfo>& spring_laws();
std::vector<std::string> spring_law_names();

/// The force per length of a spring of the law at `place`, for estimates [N/m]; more: its parameters, then its history.
double spring_rate_at_rest(std::size_t place, double k, double L, const double* more);

/// Name and formula of all laws of dampers.
const std::vector<std::pair<std::string, std::string>>& damper_laws();
std::vector<std::string> damper_law_names();

/// Every parameter that some law takes, each name once.
std::vector<SpringParameter> spring_parameters();

/// All histories that some law has, each name once.
std::vector<SpringHistory> spring_histories();

// The interactions of several particles as readers, writers and checks see them; their laws are in physics/interactions.

/// One column of a law's table.
struct InteractionParameter {
  const char *name, *label, *unit;  ///< of the dataset; in messages
  Powers powers = {};               ///< what `unit` is made of
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
  bool turns = false;                           ///< it has an angle and a moment, which can be limited (turn_limits)
  std::vector<std::pair<int, int>> sides = {};  ///< ends between which a spring may lie whose break can break it, too
};

/// What no law exceeds: records of fixed size travel between ranks.
inline constexpr int MOST_ENDS = 4, MOST_INTERACTION_PARAMETERS = 4;

/// One for each kind; a lattice's interactions are in this order.
const std::vector<InteractionSchema>& interaction_schemas();

}  // namespace bs
