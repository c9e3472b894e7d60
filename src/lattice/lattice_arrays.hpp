// A lattice in memory as plain arrays, for programs that hold one.
#pragma once
#include <cstdint>
#include <string>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// A springs from particles to fixed points, or to points with a prescribed motion.
struct AnchorArrays {
  std::vector<std::int64_t> particle;  ///< (A) rows of particles, counted from 0
  std::vector<double> point;           ///< (A, d) [m]
  std::vector<double> stiffness;       ///< (A) [N/m], strain law with a rest length [N]
  std::vector<double> rest_length;     ///< (A) [m]; empty: 0
  std::vector<double> damping;         ///< (A) [kg/s]; empty: 0
};

/// n interactions of one kind between several particles. The kinds are named as the groups of a lattice file, "angles" and "hinges";
/// interaction_schemas() gives the number of ends and the parameters of each, in their order.
struct InteractionArrays {
  std::string kind;
  std::vector<std::int64_t> ends;     ///< (n, ends) rows of particles, counted from 0
  std::vector<double> parameter;      ///< (n, parameters)
  std::vector<std::int64_t> shift;    ///< (n, ends, d) the box each end is in; empty: the nearest images
  std::vector<Column> break_columns;  ///< (n) critical_change, critical_moment, critical_energy, and broken: 1 or 0
};

/// N particles and S springs in d dimensions. These may be empty: velocity (all at rest), fixed (none), rest_length (the initial distances), damping
/// (0), shift (the nearest images), and the `path` of columns. The lattice may bring options with it, of those that an .xsp scene can imply.
struct LatticeArrays : LatticeNumbers {
  std::vector<std::int64_t> springs;  ///< (S, 2) rows of the particles at the ends, counted from 0
  std::vector<double> area;           ///< (S) cross-sections, for stresses [m^2]; empty: none
  AnchorArrays anchors;
  std::vector<InteractionArrays> interactions;  ///< each kind at most once
  std::string spring_law, damping_law;          ///< by name; empty: hooke and axial
  std::vector<std::string> laws;                ///< names of the laws where springs have different ones
  std::vector<std::int64_t> law;                ///< (S) index of each spring's law in `laws`; empty: all obey spring_law
};

/// The `source` of lattices that were made of arrays.
inline constexpr const char* IN_MEMORY = "lattice in memory";

/// Makes the whole lattice of `arrays`; returns false and sets `error` where sizes do not match, or names, flags or the box are invalid. Other values
/// are checked when a model is made of it.
bool lattice_of(LatticeArrays arrays, Lattice* out, std::string* error);

/// The arrays of a lattice that is whole on this rank.
LatticeArrays arrays_of(Lattice whole);

/// The error in `arrays`, by the same checks; empty where there is none.
std::string fault_of(const LatticeArrays& arrays);

}  // namespace bs
