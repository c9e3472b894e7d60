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

/// N particles and S springs in d dimensions, rows behind one another. What may be empty says so; units as in Lattice.
struct LatticeArrays {
  int dim = 3;                           ///< d = 1, 2, 3
  std::vector<double> position;          ///< (N, d) [m]
  std::vector<double> velocity;          ///< (N, d) [m/s]; empty: at rest
  std::vector<double> mass;              ///< (N) [kg]
  std::vector<std::uint8_t> fixed;       ///< (N) 1: fixed; empty: none is
  std::vector<std::int64_t> id;          ///< (N) the caller's numbers; empty: the rows
  std::vector<std::int64_t> springs;     ///< (S, 2) rows of the particles at the ends, counted from 0
  std::vector<double> stiffness;         ///< (S) [N/m], strain law [N]
  std::vector<double> rest_length;       ///< (S) [m]; NaN, and empty: the initial distance
  std::vector<double> damping;           ///< (S) [kg/s]; empty: 0
  std::vector<double> area;              ///< (S) cross-sections, for stresses [m^2]; empty: none
  std::vector<Column> particle_columns;  ///< of lattice/columns.hpp: radius, drag (N), force (N, d); `path` may be empty
  std::vector<Column> spring_columns;    ///< (S) what laws of springs take and carry (lattice/spring_laws.hpp)
  std::vector<Column> break_columns;     ///< (S) critical_strain, critical_force, critical_energy, and broken: 1 or 0
  std::vector<Group> groups;             ///< particles under a name
  PeriodicBox box;                       ///< without periodic directions: none
  std::vector<std::int64_t> shift;       ///< (S, d) the box that the second end is in; empty: the nearest image
  AnchorArrays anchors;
  std::vector<InteractionArrays> interactions;  ///< each kind once; those that are left out have none

  std::string spring_law, damping_law;  ///< by name; empty: not said, hooke and axial
  std::vector<std::string> laws;        ///< where springs have laws of their own: their names,
  std::vector<std::int64_t> law;        ///< (S) and each spring's place among these; empty: all obey spring_law
  bool rest_at_zero_length = false;     ///< a spring of zero length exerts no force instead of being an error
  /// Options that go with the lattice, of those that an .xsp scene implies ("-bs_gravity", "0,-9.8"): in force where the settings name none.
  std::vector<std::pair<std::string, std::string>> implied_options;
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
