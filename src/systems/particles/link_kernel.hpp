// One spring with its damper between a particle and another end (particle or point): force and both derivatives.
#pragma once
#include <cmath>
#include <type_traits>
#include "network/network.hpp"
#include "physics/pair/springs/mixed.hpp"
#include "physics/whole/motion.hpp"
#include "systems/layout.hpp"

namespace bs {

/// A link as the loops see it: parameters of one spring.
struct LinkParameters {
  double stiffness, rest_length, damping;
  /// f() of what the law takes beyond stiffness and rest length: nothing.
  template <class F>
  auto with_more(F&& f) const noexcept {
    return f();
  }
};

/// The same of a link with a law of its own.
struct MixedLinkParameters : LinkParameters {
  SpringRow row;
  template <class F>
  auto with_more(F&& f) const noexcept {
    return f(row);
  }
};

/// Vector between the ends, its length, and the relative velocity.
template <int d>
struct LinkGeometry {
  double dx[d], w[d], length;
  /// `a` and `b`: position and velocity (2d numbers) of this end and of the other.
  LinkGeometry(const double* a, const double* b) noexcept {
    double square = 0;
    for (int c = 0; c < d; ++c) {
      dx[c] = a[c] - b[c];
      w[c] = a[d + c] - b[d + c];
      square += dx[c] * dx[c];
    }
    length = std::sqrt(square);
  }
};

/// Displacement and velocity all anchors share at one moment.
template <int d>
struct AnchorShift {
  double s[3] = {0, 0, 0}, ds[3] = {0, 0, 0};
  AnchorShift(const Motion& motion, double t) { motion.at(t, s, ds); }
};

/// Position and velocity of the point of an anchor.
template <int d>
struct AnchorEnd {
  double y[Layout{d}.block()];
  AnchorEnd(const AnchorShift<d>& shift, const Anchors& anchors, PetscInt k) {
    for (int c = 0; c < d; ++c) {
      y[c] = anchors.point[k * 3 + c] + shift.s[c];
      y[d + c] = shift.ds[c];
    }
  }
};

/// Spring law `Spring` (rest length > 0; zero rest length has its own law) and damper `Damper` of one link.
template <int d, class Spring, class Damper>
struct LinkKernel {
  using Parameters = std::conditional_t<Spring::mixed, MixedLinkParameters, LinkParameters>;
  /// Whether the law has a direction to act in: at zero length only a zero rest length with a simple damper has.
  static bool defined(const LinkGeometry<d>& g, const Parameters& p) noexcept {
    return g.length > 0 || (p.rest_length == 0 && (p.damping == 0 || Damper::regular_at_zero));
  }
  /// Whether it exerts forces anywhere: broken springs, and those that a diluted lattice lacks, do not.
  static bool acts(const Parameters& p) noexcept { return p.damping != 0 || rate(p) != 0; }
  /// Adds the force on this end to f[d].
  static void force(const LinkGeometry<d>& g, const Parameters& p, double* f) noexcept {
    if (p.rest_length == 0) spring_force<d, ZeroRestSpring>(g.dx, g.length, p.stiffness, 0.0, f);
    else p.with_more([&](const auto&... more) { spring_force<d, Spring>(g.dx, g.length, p.stiffness, p.rest_length, f, more...); });
    if (p.damping != 0) Damper::template force<d>(g.dx, g.length, g.w, p.damping, f);
  }
  /// Adds df/dx and df/dv of this end to K and D (d x d); the other end's are the negatives. `positive`: without the
  /// negative transverse rate of a compressed spring and the negative axial one of a softening spring.
  template <bool positive = false>
  static void tangent(const LinkGeometry<d>& g, const Parameters& p, double* K, double* D) noexcept {
    if (p.rest_length == 0) spring_dfdx<d, ZeroRestSpring>(g.dx, g.length, p.stiffness, 0.0, K);
    else p.with_more([&](const auto&... more) { spring_dfdx<d, Spring, positive>(g.dx, g.length, p.stiffness, p.rest_length, K, more...); });
    if (p.damping != 0) {
      if constexpr (!positive) Damper::template dfdx<d>(g.dx, g.length, g.w, p.damping, K);
      Damper::template dfdv<d>(g.dx, g.length, p.damping, D);
    }
  }
  /// Rates of the symmetric part of -(b df/dv + c df/dx) along and across the link; `positive` as above, and without what a
  /// damper owes to its ends' places.
  template <bool positive = false>
  static SpringTangent rates(const LinkGeometry<d>& g, const Parameters& p, double b, double c) noexcept {
    SpringTangent rate = p.rest_length == 0 ? spring_tangent<ZeroRestSpring>(g.length, p.stiffness, 0.0) : p.with_more([&](const auto&... more) {
      return spring_tangent<Spring, positive>(g.length, p.stiffness, p.rest_length, more...);
    });
    rate.axial *= c;
    rate.transverse *= c;
    if (p.damping != 0) Damper::template add_rates<d, positive>(g.dx, g.length, g.w, p.damping, b, c, &rate);
    return rate;
  }
  static double energy(const LinkGeometry<d>& g, const Parameters& p) noexcept {
    if (p.rest_length == 0) return ZeroRestSpring::energy(g.length, p.stiffness, 0.0);
    return p.with_more([&](const auto&... more) { return Spring::energy(g.length, p.stiffness, p.rest_length, more...); });
  }
  /// Of the spring alone, positive where it pulls [N].
  static double tension(const LinkGeometry<d>& g, const Parameters& p) noexcept {
    if (p.rest_length == 0) return ZeroRestSpring::tension(g.length, p.stiffness, 0.0);
    return p.with_more([&](const auto&... more) { return Spring::tension(g.length, p.stiffness, p.rest_length, more...); });
  }
  /// pull[d] = d(T u)/dp of the number `of` (law.hpp).
  static void pull_change(const LinkGeometry<d>& g, const Parameters& p, int of, double* pull) noexcept {
    const double change = p.rest_length == 0 ? ZeroRestSpring::tension_change(of, g.length, p.stiffness, 0.0) : p.with_more([&](const auto&... more) {
      return Spring::tension_change(of, g.length, p.stiffness, p.rest_length, more...);
    });
    for (int c = 0; c < d; ++c) pull[c] = g.length > 0 ? change * g.dx[c] / g.length : 0;
  }
  /// Energy that the spring has lost so far [J].
  static double dissipated(const Parameters& p) noexcept {
    if constexpr (Spring::mixed) return Spring::dissipated(p.stiffness, p.row);
    else return 0 * p.stiffness;
  }
  /// What the link adds to an incremental potential beyond its slope, for changes dd, dw of dx and w:
  ///   sigma (e(dx + dd) - e(dx) - e'.dd) + R(w + dw) - R(w) - R'.dw
  static double beyond_slope(const LinkGeometry<d>& g, const double* dd, const double* dw, const Parameters& p, double sigma) noexcept {
    const double spring = p.rest_length == 0
                              ? spring_energy_beyond_slope<d, ZeroRestSpring>(g.dx, g.length, dd, p.stiffness, 0.0)
                              : p.with_more([&](const auto&... more) {
                                  return spring_energy_beyond_slope<d, Spring>(g.dx, g.length, dd, p.stiffness, p.rest_length, more...);
                                });
    return sigma * spring + (p.damping != 0 ? Damper::template dissipation_beyond_slope<d>(g.dx, g.length, dw, p.damping) : 0.0);
  }
  /// Force per length along the spring, for estimates [N/m].
  static double rate(const Parameters& p) noexcept {
    return p.with_more([&](const auto&... more) { return spring_rate<Spring>(p.stiffness, p.rest_length, more...); });
  }
};

}  // namespace bs
