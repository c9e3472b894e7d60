// What a program on the library does with the systems that are made on a communicator of its session, and where it leaves a function that computes
// forces.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace bs {

/// In the context of the communicator; all is false by default.
struct Client {
  bool moves_groups = false;     ///< it says where groups are whose motion is `given`
  bool gives_histories = false;  ///< histories are put into systems once these are made, as a restart does
  bool changes_numbers = false;  ///< systems have room for springs that exert nothing yet, and are given other numbers later
};

/// In the context of the communicator: asked for by every system of particles that is made on it. All functions are of particles at (x, v), (rows, d)
/// each, and of the time t [s], in an equilibrium the load factor; `row`: all of this rank's rows of the input, ascending, those of particles
/// that are fixed included, and those of other ranks that `between` couples to them, of which what is returned is not looked at. They must depend on
/// nothing else but what begin_step was told. Not collective: ranks ask at different times.
struct ForceCallback {
  using Rows = std::vector<std::int64_t>;
  using Pairs = std::vector<std::array<std::int64_t, 2>>;
  /// (rows, d, d) each, and (pairs, d, d) of what acts between particles.
  struct Blocks {
    double *K, *D, *K_between, *D_between;
  };
  /// Adds the forces to f, (rows, d) [N]. Empty: there are none.
  std::function<void(double t, const Rows& row, const double* x, const double* v, double* f)> force;
  /// Adds what the force on each particle changes by with its own place and velocity, df/dx to K [N/m] and df/dv to D [N s/m], and, pair by pair,
  /// what the force on the first changes by with the second; `pair`: those of `between` that this rank takes part in, by their places among the rows.
  /// Empty: the tangent has nothing of the forces, and Newton's method takes them as they were at the last iterate.
  std::function<void(double t, const Rows& row, const Pairs& pair, const double* x, const double* v, const Blocks& add)> tangent;
  /// Adds energies to E, (rows) [J], where the force on each particle is minus the gradient of the sum of all by its place. Empty: there is no
  /// potential.
  std::function<void(double t, const Rows& row, const double* x, double* E)> energy;
  /// Rows (i, j) of the input, the same on every rank: the force on i depends on where j is, or how fast. Empty: on i alone. Not in a periodic
  /// box.
  Pairs between = {};
  /// Once before every attempt at a step of length h from (x, v) at t, on every rank: what the forces draw or look up for a whole step. `number`
  /// counts steps from 1 on, `attempt` from 0: a step that was rejected is begun again from the same state, by another length. Forces are asked for
  /// at the start before the first of them. Empty: nothing.
  std::function<void(double t, double h, std::int64_t number, std::int64_t attempt, const Rows& row, const double* x, const double* v)> begin_step =
      {};
  /// The largest lambda > 0 for which the forces are as they should be all the way from x to x + lambda dx, infinite where there is none: steps of
  /// Newton's method, and what it begins with where the time stepper extrapolates (beuler, cn, theta, equilibria), are at most that long, so that
  /// nothing gets at once to the other side of what repels it. Empty: they may have any length.
  std::function<double(double t, const Rows& row, const double* x, const double* dx)> limit = {};
};

}  // namespace bs
