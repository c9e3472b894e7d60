// The loops of PairForcesOf along a line of states; included by physics_impl.hpp alone.
#pragma once
#include <cmath>
#include <limits>
#include "systems/particles/physics_impl.hpp"

namespace bs {

// A spring between two particles counts half from either end, as in energies(); that to a held end, too.
template <int d, class Damper>
void PairForcesOf<d, Damper>::beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma,
                                           PotentialChange* change) const {
  const AnchorShift shift(motion_, t);
  const Links& links = net_.links;
  PotentialChange sum;
  for (PetscInt i = 0; i < net_.n; ++i) {
    const double *y = state.at(i), *z = line.at(i);
    double dd[d], dw[d], dx[d], dv[d];
    with_law(law_[i], [&](auto law) {
      using Spring = decltype(law);
      if constexpr (!Spring::mixed)
        if (plain_[i]) sum.value += 0.5 * sigma * plain_beyond_slope<d, Spring>(links, i, y, state.at(0), line.at(0), lambda);
    });
    if (!plain_[i])
      for_links(i, state, [&](auto kernel, PetscInt e, const LinkGeometry<d>& g, const auto& p) {
        const double* other = line.at(links.other[e]);
        for (int c = 0; c < d; ++c) {
          dd[c] = lambda * (z[c] - other[c]);
          dw[c] = lambda * (z[d + c] - other[d + c]);
        }
        sum.value += 0.5 * kernel.beyond_slope(g, dd, dw, p, sigma);
      });
    if (net_.fixed[i]) continue;
    for (int c = 0; c < d; ++c) {
      dx[c] = lambda * z[c];
      dv[c] = lambda * z[d + c];
      sum.value += 0.5 * sigma * net_.inertia[i] * dv[c] * dv[c];
    }
    for_anchors(i, y, shift, [&](auto kernel, PetscInt, const LinkGeometry<d>& g, const auto& p) {
      if (kernel.defined(g, p)) sum.value += kernel.beyond_slope(g, dx, dv, p, sigma);
    });
    const Point<d> point = point_of(i, t, state);
    for_each_law(laws_, [&](const auto& law) {
      if (law.active()) add_law(law, point, dx, dv, sigma, &sum);
    });
  }
  change->value += sum.value;
  change->noise += sum.noise;
}

template <int d, class Damper>
template <class Law>
void PairForcesOf<d, Damper>::add_law(const Law& law, const Point<d>& point, const double* dx, const double* dv, double sigma, PotentialChange* sum) {
  if constexpr (Law::potential == Potential::of_velocity) {
    sum->value += law.template dissipation_beyond_slope<d>(point, dv);
  } else if constexpr (Law::potential == Potential::of_position) {
    // a difference of energies: their rounding errors stay
    double after[d], f[d] = {};
    for (int c = 0; c < d; ++c) after[c] = point.x[c] + dx[c];
    const Point<d> there{point.t, point.m, point.own, after, point.v};
    const double before_energy = law.template energy<d>(point), after_energy = law.template energy<d>(there);
    const bool has = law.template force<d>(point, f);
    sum->value += has ? sigma * (after_energy - before_energy + dot<d>(f, dx)) : std::numeric_limits<double>::infinity();
    sum->noise += sigma * 4 * std::numeric_limits<double>::epsilon() * (std::abs(before_energy) + std::abs(after_energy));
  }
}

template <int d, class Damper>
std::string PairForcesOf<d, Damper>::lacks_potential() const {
  std::string what;
  for_each_law(laws_, [&](const auto& law) {
    using Law = std::decay_t<decltype(law)>;
    if (law.active() && Law::potential == Potential::none) what = Law::title;
  });
  return what;
}

template <int d, class Damper>
bool PairForcesOf<d, Damper>::depends_on_place() const {
  bool some = false;
  for_each_law(laws_, [&](const auto& law) {
    using Law = std::decay_t<decltype(law)>;
    some = some || (law.active() && Law::potential == Potential::of_position);
  });
  return some;
}

}  // namespace bs
