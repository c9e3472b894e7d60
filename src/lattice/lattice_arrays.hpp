// A lattice in memory as plain arrays, for programs that hold one.
#pragma once
#include <cstdint>
#include <string>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// N particles and S springs in d dimensions, rows behind one another. What may be empty says so; units as in Lattice.
struct LatticeArrays {
  int dim = 3;                           ///< d = 1, 2, 3
  std::vector<double> position;          ///< (N, d) [m]
  std::vector<double> velocity;          ///< (N, d) [m/s]; empty: at rest
  std::vector<double> mass;              ///< (N) [kg]
  std::vector<std::uint8_t> fixed;       ///< (N) 1: fixed; empty: none is
  std::vector<std::int64_t> springs;     ///< (S, 2) rows of the particles at the ends, counted from 0
  std::vector<double> stiffness;         ///< (S) [N/m], strain law [N]
  std::vector<double> rest_length;       ///< (S) [m]; NaN, and empty: the initial distance
  std::vector<double> damping;           ///< (S) [kg/s]; empty: 0
  std::vector<Column> particle_columns;  ///< of lattice/columns.hpp: radius, drag (N), force (N, d); `path` may be empty
  std::vector<Column> spring_columns;    ///< those of springs
  std::vector<Group> groups;             ///< particles under a name
  PeriodicBox box;                       ///< without periodic directions: none
  std::vector<std::int64_t> shift;       ///< (S, d) the box that the second end is in; empty: the nearest image
};

/// The whole lattice of `arrays`; false and `error` where sizes do not fit one another. Values are judged when a model is made of it.
bool lattice_of(const LatticeArrays& arrays, Lattice* out, std::string* error);

}  // namespace bs
