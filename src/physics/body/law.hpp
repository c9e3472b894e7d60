// What a particle law sees: one particle at one moment. What the laws' readers of options share. No PETSc.
//
// A law is a struct, named in ParticleLaws (registry.hpp). It must have
//   static constexpr const char* title         the name in messages and in the summary of options
//   static constexpr Potential potential       what the force derives from
//   template <class V> void options(V& o)      reads the options of the law
//   bool active() const                        whether the options ask for the force; an inactive law is never evaluated
//   std::string describe() const               one line with the values in use, for the header of a run
// and, as templates over the dimension d of the particle p (a Point<d>),
//   double energy(p)                           potential energy [J]; 0 without a potential
//   bool force(p, f)                           adds the force to f[d]; false where it is singular
//   void dfdx(p, K), dfdv(p, D)                add the derivatives by position and velocity to d x d matrices, row by row
// Optional members, each found by its name:
//   double dissipation_beyond_slope(p, dv)     with Potential::of_velocity required: R(v + dv) - R(v) - R'(v).dv
//   double load                                set by statics to the load factor; a law without it acts in full from the start
//   static constexpr bool varies_in_time       true where the force depends on p.t
//   double fluid[3]                            velocity of the fluid, for the energy that a drag supplies
//   static constexpr std::size_t column        the column of the particles that the law reads by p.column(column)
//   bool given                                 set where the lattice has that column: the law then acts without an option
#pragma once
#include <string>
#include "base/text.hpp"
#include "lattice/columns.hpp"

namespace bs {

/// One particle in d dimensions. x and v point at d numbers each.
template <int d>
struct Point {
  double t;             ///< time [s]
  double m;             ///< mass [kg]
  ParticleNumbers own;  ///< its other numbers
  const double* x;      ///< position [m]
  const double* v;      ///< velocity [m/s]

  /// Its number at place k of `particle_parameters`.
  double column(std::size_t k) const noexcept { return own[k]; }
};

/// What a law's force derives from: nothing; a potential energy E(x) that is linear in x; any other E(x); or a dissipation potential R(v) with
/// f = -dR/dv. A law with `none` is taken for a drag (is_drag in registry.hpp), and the line search cannot use energies while it acts.
enum class Potential { none, linear, of_position, of_velocity };

/// The type Range of base/options.hpp, taken from V::real so that a law's header need not include PETSc.
template <class R, class V>
R last_argument(bool (V::*)(const char*, const char*, double&, R));
template <class V>
using RangeOf = decltype(last_argument(&V::real));

/// "(0, 0, -9.81)", `count` numbers.
inline std::string vector_text(const double* values, int count) {
  std::string text = "(";
  for (int i = 0; i < count; ++i) text += (i ? ", " : "") + short_number(values[i]);
  return text + ")";
}

/// ", fluid at (1, 0) m/s", or nothing where the fluid is at rest.
inline std::string fluid_text(const double (&velocity)[3], int count) {
  if (velocity[0] == 0 && velocity[1] == 0 && velocity[2] == 0) return {};
  return ", fluid at " + vector_text(velocity, count) + " m/s";
}

/// Up to three components; those left out are 0. `count` becomes how many were given. Returns whether it was present.
template <class V>
bool read_vector(V& o, const char* name, const char* help, double (&values)[3], int& count) {
  if (!o.reals(name, help, values, 3, &count)) return false;
  for (int i = count; i < 3; ++i) values[i] = 0;
  return true;
}

/// The velocity of the fluid, which several laws take.
template <class V>
void read_fluid(V& o, double (&velocity)[3], int& count) {
  read_vector(o, "-bs_fluid_velocity", "velocity x[,y[,z]] of the fluid, for sphere and shape drag [m/s]", velocity, count);
}

/// An option that only works together with another must not be ignored silently.
template <class V>
void require(V& o, bool given, const char* user, const char* needed) {
  if (!given) o.fail(std::string("option ") + user + " needs " + needed + ": give it too");
}

}  // namespace bs
