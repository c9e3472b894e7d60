// Quadratic drag with the measured coefficient of a shape.
#pragma once
#include <string>
#include <vector>

#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// A shape and its measured drag coefficient C_D, referred to the frontal area and taken as constant: values in common
/// use for high Reynolds numbers, for estimates.
struct Shape {
  const char* name;
  double drag_coefficient;
};
constexpr Shape shapes[] = {{"none", 0},
                            {"sphere", 0.47},
                            {"half_sphere", 0.42},
                            {"cone", 0.50},
                            {"cube", 1.05},
                            {"angled_cube", 0.80},
                            {"long_cylinder", 0.82},
                            {"short_cylinder", 1.15},
                            {"streamlined_body", 0.04},
                            {"streamlined_half_body", 0.09}};

/// f = -1/2 rho A C_D |u| u,  u = v - u_fluid
struct ShapeDrag {
  static constexpr const char* title = "shape drag";
  static constexpr Potential potential = Potential::of_velocity;
  int shape = 0;                ///< index into `shapes`; 0: none
  double drag_coefficient = 0;  ///< C_D [1]; off: 0
  double rho = 0;               ///< density of the fluid [kg/m^3]
  double area = 0;              ///< frontal area A of a particle [m^2]
  double fluid[3] = {0, 0, 0};  ///< velocity of the fluid [m/s]
  int components = 1;           ///< how many of `fluid` were given

  template <class V>
  void options(V& o) {
    using R = RangeOf<V>;
    std::vector<std::string> names;
    for (const Shape& s : shapes) names.emplace_back(s.name);
    const bool named = o.choice("-bs_shape_drag", "quadratic drag force with the measured drag coefficient of a shape", names, shape);
    drag_coefficient = shapes[shape].drag_coefficient;
    const bool own = o.real("-bs_shape_drag_coefficient", "shape drag: drag coefficient C_D used instead of that of a named shape, >= 0 [1]",
                            drag_coefficient, R::nonnegative);
    const bool density = o.real("-bs_shape_drag_rho", "shape drag: density of the fluid, > 0 [kg/m^3]", rho, R::positive);
    const bool frontal = o.real("-bs_shape_drag_area", "shape drag: frontal area of a particle, > 0 [m^2]", area, R::positive);
    read_fluid(o, fluid, components);
    const bool said = named || own;
    if (density) require(o, said, "-bs_shape_drag_rho", "-bs_shape_drag or -bs_shape_drag_coefficient");
    if (frontal) require(o, said, "-bs_shape_drag_area", "-bs_shape_drag or -bs_shape_drag_coefficient");
    if (drag_coefficient != 0) {
      const char* user = own ? "-bs_shape_drag_coefficient" : "-bs_shape_drag";
      require(o, density, user, "-bs_shape_drag_rho, the density of the fluid [kg/m^3]");
      require(o, frontal, user, "-bs_shape_drag_area, the frontal area of a particle [m^2]");
    }
  }
  bool active() const noexcept { return drag_coefficient != 0; }
  std::string describe() const {
    const bool own = drag_coefficient != shapes[shape].drag_coefficient;
    return "shape drag (" + std::string(own ? "own coefficient" : shapes[shape].name) + ") C_D = " + short_number(drag_coefficient) +
           ", rho = " + short_number(rho) + " kg/m^3, A = " + short_number(area) + " m^2" + fluid_text(fluid, components);
  }

  /// No potential: 0.
  template <int d>
  double energy(const Point<d>&) const noexcept {
    return 0;
  }
  /// R = k/3 s^3, k = 1/2 rho A C_D. With s' = s + e, and e - n.dv = (|dv|^2 - e n.dv)/(s + s') free of cancellation:
  ///   R(v + dv) - R(v) - R'(v).dv = k (s^2 (e - n.dv) + e^2 (s + e/3))
  template <int d>
  double dissipation_beyond_slope(const Point<d>& p, const double* dv) const noexcept {
    double u[d], after[d];
    const double s = relative<d>(p, u), k = 0.5 * rho * area * drag_coefficient;
    for (int i = 0; i < d; ++i) after[i] = u[i] + dv[i];
    const double sum = s + norm<d>(after);
    if (!(s > 0)) return k / 3 * sum * sum * sum;
    const double along = dot<d>(u, dv) / s, square = dot<d>(dv, dv), e = (2 * s * along + square) / sum;
    return k * (s * s * (square - e * along) / sum + e * e * (s + e / 3));
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    double u[d];
    const double s = relative<d>(p, u), k = 0.5 * rho * area * drag_coefficient;
    for (int i = 0; i < d; ++i) f[i] -= k * s * u[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  /// df/dv = -1/2 rho A C_D s (I + n n^T),  s = |u|, n = u/s;  at u = 0: 0
  template <int d>
  void dfdv(const Point<d>& p, double* D) const noexcept {
    double n[d];
    const double s = relative<d>(p, n), k = 0.5 * rho * area * drag_coefficient;
    if (!(s > 0)) return;
    for (int i = 0; i < d; ++i) n[i] /= s;
    add_tensor<d>(-k * s, -k * s, n, D);
  }

 private:
  /// u and its length.
  template <int d>
  double relative(const Point<d>& p, double* u) const noexcept {
    for (int i = 0; i < d; ++i) u[i] = p.v[i] - fluid[i];
    return norm<d>(u);
  }
};

}  // namespace bs
