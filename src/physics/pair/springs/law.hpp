// The data that every spring law provides besides its formulas (registry.hpp).
#pragma once
#include <array>
#include "lattice/spring_laws.hpp"

namespace bs {

/// What holds unless a law says otherwise. A law has, for length l, stiffness k, rest length L and p = its parameters, then its
/// history (no argument p where it has neither):
///   energy(l, k, L, p), tension = dE/dl, tension_over_length, stiffness = dT/dl,
///   energy_beyond_slope(l, s, k, L, p) = e(l + s) - e(l) - T(l) s, free of cancellation,
///   tension_change(of, l, k, L, p) = dT/dk (of = 0), dT/dL (of = 1), dT/dp[of - 2], at the history as it is;
/// a law with history also commit(l, k, L, p), which takes the state at l for the one the next step begins with, and
/// dissipated(k, p), the energy [J] lost so far. Its other functions begin with the history as it was committed last: within a
/// step T is a function of l alone, and e in energy_beyond_slope is its integral. A law that relaxes takes after p the time
/// [s] since then, in commit() that of the whole step; in statics it is 0.
struct SpringLawTraits {
  static constexpr std::array<SpringParameter, 0> parameters{};
  static constexpr std::array<SpringHistory, 0> history{};
  static constexpr bool mixed = false;            ///< the law is looked up spring by spring
  static constexpr bool regular_at_zero = false;  ///< else it has no direction at l = 0
  static constexpr bool zero_rest = true;         ///< L = 0 is the linear law of zero rest length; else L = 0 is refused
  static constexpr bool softens = false;          ///< the rate along the spring may be negative, or less than the one across it
  static constexpr bool relaxes = false;          ///< T changes with time at constant l
};

template <class Law>
constexpr bool takes_more = Law::parameters.size() + Law::history.size() > 0;

/// f() of what the law takes beyond k and L.
template <class Law, class F>
auto with_more([[maybe_unused]] const double* more, [[maybe_unused]] double elapsed, F&& f) {
  if constexpr (Law::relaxes) return f(more, elapsed);
  else if constexpr (takes_more<Law>) return f(more);
  else return f();
}

/// Area under a tension that rises by `slope` per length between l + low and l + high, and not elsewhere, above its value at l:
/// the integral of T(l + x) - T(l) over x from 0 to s.
inline double ramp_beyond_slope(double s, double low, double high, double slope) noexcept {
  const auto within = [&](double x) { return x < low ? low : x > high ? high : x; };
  const double a = within(0), b = within(s), rise = b - a;
  return slope * rise * (0.5 * rise + (s - b));
}

}  // namespace bs
