// Spring of the angle that two arms enclose: bending stiffness of chains, of beams made of links and of molecules.
//
//   E = kappa (theta - theta_0)^2 / 2,   force on end k: f_k = -kappa (theta - theta_0) dtheta/dx_k
//
// with arms a = x_0 - x_1 and b = x_2 - x_1 from the middle particle, which is listed second. In two dimensions theta is counted
// counter-clockwise from a to b, 0 < theta < 2 pi, so that it passes through pi for any theta_0; in three, 0 < theta <= pi.
// All formulas use phi = pi - theta = atan2(S, C), C = -a.b, S = a x b (two dimensions) or |a x b| (three): nothing is divided by
// sin theta where theta_0 = pi.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "lattice/spring_laws.hpp"
#include "physics/vector.hpp"

namespace bs {

struct AngleSpring {
  static constexpr const char* title = "angle spring";
  static constexpr int ends = 3;
  static constexpr int parameters = 2;
  static constexpr double PI = 3.14159265358979323846;
  static constexpr double NEAR = 1e-10;  ///< [rad] from a singular angle: the arms' plane is not known any more

  static InteractionSchema schema() {
    return {title,
            "angle",
            "triples",
            ends,
            1,
            {{"stiffness", "angle stiffness", "N m/rad^2", {1, 2, -2}}, {"rest_angle", "rest angle", "rad"}},
            bad_parameter,
            2,
            place_fault,
            true,
            {{0, 1}, {1, 2}}};
  }
  /// Which parameter (its index) is impossible in `dim` dimensions, and what to write; -1: none.
  static int bad_parameter(const double* p, int dim, const char** remedy) {
    *remedy = "write a finite number >= 0";
    if (!(std::isfinite(p[0]) && p[0] >= 0)) return 0;
    *remedy = dim == 2 ? "write an angle between 0 and 2 pi [rad]" : "write an angle > 0 and at most pi = 3.141592653589793 [rad]";
    return p[1] > 0 && p[1] <= (dim == 2 ? 2 * PI : PI) && !(dim == 2 && p[1] == 2 * PI) ? -1 : 1;
  }
  static const char* place_fault(int dim, const double* const* x, const double* p) { return dim == 2 ? fault<2>(x, p) : fault<3>(x, p); }

  /// Null, or why there is no force with the ends at x[0], x[1], x[2].
  template <int d>
  static const char* fault(const double* const* x, const double* p) noexcept {
    const Geometry<d> g(x);
    if (!(g.la > 0 && g.lb > 0)) return "an arm of zero length";
    if (!(PI - std::abs(g.phi) > NEAR)) return "an angle of 0: its arms lie on each other";
    if (d == 3 && p[1] != PI && !(g.phi > NEAR)) return "a straight angle, where only a rest angle of pi = 3.141592653589793 has a direction";
    return nullptr;
  }

  template <int d>
  static double energy(const double* const* x, const double* p) noexcept {
    const double delta = Geometry<d>(x).deviation(p);
    return 0.5 * p[0] * delta * delta;
  }

  /// theta - theta_0, which `moment` = dE/dtheta belongs to.
  template <int d>
  static double change(const double* const* x, const double* p, double* moment) noexcept {
    const double change = Geometry<d>(x).deviation(p);
    *moment = p[0] * change;
    return change;
  }

  /// f: (ends, d), overwritten.
  template <int d>
  static void force(const double* const* x, const double* p, double* f) noexcept {
    const Geometry<d> g(x);
    exert(g, p[0] * g.deviation(p), f);
  }
  /// The same of df/dp[of]: that of the moment, theta - theta_0 by kappa and -kappa by theta_0.
  template <int d>
  static void force_change(const double* const* x, const double* p, int of, double* f) noexcept {
    const Geometry<d> g(x);
    exert(g, of == 0 ? g.deviation(p) : -p[0], f);
  }

  // Second derivatives of E by the arms, with p_a, p_b normal to the arms in their plane (dtheta/da = -p_a/|a|,
  // dtheta/db = p_b/|b|), n normal to the plane, D = theta - theta_0:
  //   E_aa = kappa (g_a g_a' + D (u_a p_a' + p_a u_a')/|a|^2 + P n n'/|a|^2),  g_a = dtheta/da;  E_bb alike with -D
  //   E_ab = kappa (g_a g_b' + Q n n'/(|a||b|)),   P = D cot theta,  Q = -D/sin theta
  // E is positive semidefinite without the terms in D u p' and the negative one of P + Q, P - Q.
  /// K: (ends d, ends d) row-major, df/dx, overwritten. `positive`: -K positive semidefinite, without what may be negative.
  template <int d, bool positive>
  static void tangent(const double* const* x, const double* p, double* K) noexcept {
    const Geometry<d> g(x);
    const double delta = positive ? 0 : g.deviation(p);
    double across[2] = {0, 0};
    if constexpr (d == 3) g.template out_of_plane<positive>(p, across);
    double aa[d * d], bb[d * d], ab[d * d];
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) {
        const double nn = d == 3 ? g.n[r] * g.n[c] : 0;
        aa[r * d + c] = p[0] / (g.la * g.la) * (g.pa[r] * g.pa[c] + delta * (g.ua[r] * g.pa[c] + g.pa[r] * g.ua[c]) + across[0] * nn);
        bb[r * d + c] = p[0] / (g.lb * g.lb) * (g.pb[r] * g.pb[c] - delta * (g.ub[r] * g.pb[c] + g.pb[r] * g.ub[c]) + across[0] * nn);
        ab[r * d + c] = p[0] / (g.la * g.lb) * (-g.pa[r] * g.pb[c] + across[1] * nn);
      }
    constexpr double of_a[3] = {1, -1, 0}, of_b[3] = {0, -1, 1};  // arms by ends
    for (int e = 0; e < 3; ++e)
      for (int o = 0; o < 3; ++o)
        for (int r = 0; r < d; ++r)
          for (int c = 0; c < d; ++c)
            K[(e * d + r) * 3 * d + o * d + c] = -(of_a[e] * of_a[o] * aa[r * d + c] + of_b[e] * of_b[o] * bb[r * d + c] +
                                                   of_a[e] * of_b[o] * ab[r * d + c] + of_b[e] * of_a[o] * ab[c * d + r]);
  }

  // E(phi + s) - E(phi) - E' g = kappa (s^2/2 + (phi - phi_0) (s - g)), s the change of phi and g its slope: with u, w the
  // changes of (S, C) across and along itself in units of |a||b|, s = atan2(u, 1 + w), and s - g = (s - u) + (u - g) is free of
  // cancellation since u - g comes from the terms of second order in dS and dC alone.
  /// What E changes by beyond its slope when end k moves by dx[k]: E(x + dx) - E(x) + f.dx; infinite where there is no value.
  template <int d>
  static double energy_beyond_slope(const double* const* x, const double* const* dx, const double* p) noexcept;

  /// Sizes of -df_k/dx_k [N/m].
  template <int d>
  static void rates(const double* const* x, const double* p, double* rate) noexcept {
    const Geometry<d> g(x);
    rate[0] = p[0] / (g.la * g.la);
    rate[1] = p[0] * (1 / g.la + 1 / g.lb) * (1 / g.la + 1 / g.lb);
    rate[2] = p[0] / (g.lb * g.lb);
  }

 private:
  template <int d>
  struct Geometry;
  /// f_k = -moment dtheta/dx_k
  template <int d>
  static void exert(const Geometry<d>& g, double moment, double* f) noexcept {
    for (int c = 0; c < d; ++c) {
      f[c] = moment / g.la * g.pa[c];
      f[2 * d + c] = -moment / g.lb * g.pb[c];
      f[d + c] = -f[c] - f[2 * d + c];
    }
  }
  template <int d>
  static void cross(const double* a, const double* b, double* out) noexcept {
    if constexpr (d == 2) {
      out[0] = a[0] * b[1] - a[1] * b[0];
    } else {
      for (int c = 0; c < 3; ++c) out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
    }
  }

  /// Arms, their directions u, the directions p across them in their plane, the plane's normal n (three dimensions), phi.
  template <int d>
  struct Geometry {
    double a[d], b[d], ua[d], ub[d], pa[d], pb[d], n[3], la, lb, phi;
    explicit Geometry(const double* const* x) noexcept {
      for (int c = 0; c < d; ++c) {
        a[c] = x[0][c] - x[1][c];
        b[c] = x[2][c] - x[1][c];
      }
      la = norm<d>(a);
      lb = norm<d>(b);
      for (int c = 0; c < d; ++c) {
        ua[c] = a[c] / la;
        ub[c] = b[c] / lb;
      }
      cross<d>(ua, ub, n);
      if constexpr (d == 2) {
        phi = std::atan2(n[0], -dot<d>(ua, ub));
        turn(ua, pa);
        turn(ub, pb);
      } else {
        phi = std::atan2(norm<d>(n), -dot<d>(ua, ub));
        make_normal();
        cross<d>(n, ua, pa);
        cross<d>(n, ub, pb);
      }
    }
    /// theta - theta_0
    double deviation(const double* p) const noexcept { return (PI - p[1]) - phi; }
    static void turn(const double* u, double* out) noexcept {
      out[0] = -u[1];
      out[1] = u[0];
    }
    /// n becomes a unit vector across both arms; straight arms have no plane, and any will do.
    void make_normal() noexcept {
      if (norm<3>(n) < 1e-14) {
        int least = 0;
        for (int c = 1; c < 3; ++c)
          if (std::abs(ua[c]) < std::abs(ua[least])) least = c;
        for (int c = 0; c < 3; ++c) n[c] = c == least ? 1.0 : 0.0;
      }
      for (int turns = 0; turns < 2; ++turns) {
        const double along = dot<3>(n, ua);
        for (int c = 0; c < 3; ++c) n[c] -= along * ua[c];
        const double size = norm<3>(n);
        for (int c = 0; c < 3; ++c) n[c] /= size;
      }
    }
    /// P and Q of the tangent: P = (phi - phi_0)/tan phi, Q = (phi - phi_0)/sin phi.
    template <bool positive>
    void out_of_plane(const double* p, double* PQ) const noexcept {
      const double ratio = phi > 0 ? (p[1] == PI ? phi : -deviation(p)) / std::sin(phi) : 1;
      PQ[0] = ratio * std::cos(phi);
      PQ[1] = ratio;
      if (!positive) return;
      const double sum = std::max(0.0, PQ[0] + PQ[1]) / 2, difference = std::max(0.0, PQ[0] - PQ[1]) / 2;
      PQ[0] = sum + difference;
      PQ[1] = sum - difference;
    }
  };

  /// atan2(u, 1 + w) - u
  static double arc_beyond(double u, double w) noexcept {
    if (!(1 + w > 0.5)) return std::atan2(u, 1 + w) - u;
    const double r = u / (1 + w), q = r * r;
    double rest = std::atan(r) - r;
    if (q < 0.01) {  // series: r^19 and what follows is below rounding
      rest = 0;
      for (int k = 17; k >= 3; k -= 2) rest = q * (rest + ((k - 1) / 2 % 2 ? -1.0 : 1.0) / k);
      rest *= r;
    }
    return rest - r * w;
  }
};

template <int d>
double AngleSpring::energy_beyond_slope(const double* const* x, const double* const* dx, const double* p) noexcept {
  constexpr int m = d == 2 ? 1 : 3;  // components of a cross product
  const Geometry<d> g(x);
  double da[d], db[d], N[3], part[3], first[3] = {0, 0, 0}, second[3], after[2] = {0, 0};
  for (int c = 0; c < d; ++c) {
    da[c] = (dx[0][c] - dx[1][c]) / g.la;
    db[c] = (dx[2][c] - dx[1][c]) / g.lb;
    after[0] += (g.ua[c] + da[c]) * (g.ua[c] + da[c]);
    after[1] += (g.ub[c] + db[c]) * (g.ub[c] + db[c]);
  }
  if (!(after[0] > 0 && after[1] > 0)) return std::numeric_limits<double>::infinity();
  cross<d>(g.ua, g.ub, N);
  cross<d>(g.ua, db, first);
  cross<d>(da, g.ub, part);
  cross<d>(da, db, second);
  for (int c = 0; c < m; ++c) first[c] += part[c];
  const double C = -dot<d>(g.ua, g.ub), dC2 = -dot<d>(da, db), dC = dC2 - dot<d>(g.ua, db) - dot<d>(da, g.ub);
  double S = N[0], dS = first[0] + second[0], dS2 = second[0];
  if constexpr (d == 3) {
    // |N + dN| - |N| and what of it is not n.first
    double dN[3], there[3];
    for (int c = 0; c < 3; ++c) {
      dN[c] = first[c] + second[c];
      there[c] = N[c] + dN[c];
    }
    S = norm<3>(N);
    const double sum = S + norm<3>(there), slope = S > 0 ? dot<3>(N, first) / S : 0;
    dS = sum > 0 ? (2 * dot<3>(N, dN) + dot<3>(dN, dN)) / sum : 0;
    dS2 = sum > 0 && S > 0 ? (2 * dot<3>(N, second) + dot<3>(dN, dN) - slope * dS) / sum : dS;
  }
  const double u = dS * C - dC * S, w = S * dS + C * dC, rest = arc_beyond(u, w), turn = u + rest;
  // across an angle of 0 the angle begins anew
  const double wrapped = d == 2 && std::abs(g.phi + turn) > PI ? (g.phi + turn > 0 ? -2 * PI : 2 * PI) : 0;
  const double change = turn + wrapped;
  return p[0] * (0.5 * change * change - g.deviation(p) * (rest + (dS2 * C - dC2 * S) + wrapped));
}

}  // namespace bs
