// The law of each spring by its row: one instantiation of the loops for all lattices that hold more than Hooke's or the strain law.
#pragma once
#include "physics/pair/springs/registry.hpp"

namespace bs {

/// What a spring of some law carries: the law's place in the registry; its parameters, then its history; the time since that was so [s].
struct SpringRow {
  int law;
  const double* more;
  double elapsed = 0;
};

struct MixedSpring : SpringLawTraits {
  static constexpr const char *name = "mixed", *title = "of each spring";
  static constexpr bool mixed = true, softens = true;

  /// f(law[, more]) of the row's law.
  template <class F>
  static double of_row(const SpringRow& row, F&& f) noexcept {
    double value = 0;
    with_spring_law(row.law,
                    [&](auto law) { value = with_more<decltype(law)>(row.more, row.elapsed, [&](auto... more) { return f(law, more...); }); });
    return value;
  }
  static double energy(double l, double k, double L, const SpringRow& row) noexcept {
    return of_row(row, [&](auto law, auto... more) { return law.energy(l, k, L, more...); });
  }
  static double energy_beyond_slope(double l, double s, double k, double L, const SpringRow& row) noexcept {
    return of_row(row, [&](auto law, auto... more) { return law.energy_beyond_slope(l, s, k, L, more...); });
  }
  static double tension(double l, double k, double L, const SpringRow& row) noexcept {
    return of_row(row, [&](auto law, auto... more) { return law.tension(l, k, L, more...); });
  }
  static double tension_change(int of, double l, double k, double L, const SpringRow& row) noexcept {
    return of_row(row, [&](auto law, auto... more) { return law.tension_change(of, l, k, L, more...); });
  }
  static double tension_over_length(double l, double k, double L, const SpringRow& row) noexcept {
    return of_row(row, [&](auto law, auto... more) { return law.tension_over_length(l, k, L, more...); });
  }
  static double stiffness(double l, double k, double L, const SpringRow& row) noexcept {
    return of_row(row, [&](auto law, auto... more) { return law.stiffness(l, k, L, more...); });
  }
  /// Takes the state at length l, the end of a step of length h, for the one the next step begins with.
  static void commit(double l, double k, double L, int place, double* more, double h) noexcept {
    with_spring_law(place, [&](auto law) {
      if constexpr (decltype(law)::relaxes) law.commit(l, k, L, more, h);
      else if constexpr (decltype(law)::history.size() > 0) law.commit(l, k, L, more);
    });
  }
  /// Energy lost so far [J].
  static double dissipated(double k, const SpringRow& row) noexcept {
    double value = 0;
    with_spring_law(row.law, [&](auto law) {
      if constexpr (decltype(law)::history.size() > 0) value = law.dissipated(k, row.more);
    });
    return value;
  }
};

}  // namespace bs
