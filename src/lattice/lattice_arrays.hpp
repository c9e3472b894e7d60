// A lattice in memory as plain arrays, for programs that hold one.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// A springs to given points, or to points that move as given.
struct AnchorArrays {
  std::vector<std::int64_t> particle;  ///< (A) rows of particles, counted from 0
  std::vector<double> point;           ///< (A, d) [m]
  std::vector<double> stiffness;       ///< (A) [N/m], strain law with a rest length [N]
  std::vector<double> rest_length;     ///< (A) [m]; empty: 0
  std::vector<double> damping;         ///< (A) [kg/s]; empty: 0
};

/// n interactions of one kind between several particles each. The kinds are the groups of a lattice file, "angles", "hinges"; interaction_schemas()
/// says of each how many ends it has and which parameters, in that order.
struct InteractionArrays {
  std::string kind;
  std::vector<std::int64_t> ends;     ///< (n, ends) rows of particles, counted from 0
  std::vector<double> parameter;      ///< (n, parameters)
  std::vector<std::int64_t> shift;    ///< (n, ends, d) the box each end is in; empty: the nearest images
  std::vector<Column> break_columns;  ///< (n) critical_change, critical_moment, critical_energy, and broken: 1 or 0
};

/// N particles and S springs in d dimensions. May be empty: velocity (at rest), fixed (none is), rest_length (the initial distances), damping (0),
/// shift (the nearest images); `path` of columns, too. Options that go with the lattice are of those that an .xsp scene implies.
struct LatticeArrays : LatticeNumbers {
  std::vector<std::int64_t> springs;  ///< (S, 2) rows of the particles at the ends, counted from 0
  std::vector<double> area;           ///< (S) cross-sections, for stresses [m^2]; empty: none
  AnchorArrays anchors;
  std::vector<InteractionArrays> interactions;  ///< each kind once; those that are left out have none
  std::string spring_law, damping_law;          ///< by name; empty: not said, hooke and axial
  std::vector<std::string> laws;                ///< where springs have laws of their own: their names,
  std::vector<std::int64_t> law;                ///< (S) and each spring's place among these; empty: all obey spring_law
};

/// The `source` of lattices that were made of arrays.
inline constexpr const char* IN_MEMORY = "lattice in memory";

/// The whole lattice of `arrays`; false and `error` where sizes do not fit one another, or names, flags or the box mean nothing. Other values are
/// judged when a model is made of it.
bool lattice_of(LatticeArrays arrays, Lattice* out, std::string* error);

/// The arrays of a lattice that is whole.
LatticeArrays arrays_of(Lattice whole);

/// What is wrong with `arrays`, as above; empty: nothing.
std::string fault_of(const LatticeArrays& arrays);

}  // namespace bs
