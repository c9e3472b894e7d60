// Hinge between two triangles that share an edge: bending stiffness of sheets and shells made of springs.
//
//   E = k (theta - theta_0)^2 / 2,   theta = atan2((n_2 x n_1).e/|e|, n_1.n_2)
//
// The ends are the edge's p_0, p_1, then the wings' p_2, p_3. With e = p_1 - p_0, u_1 = p_2 - p_0, u_2 = p_3 - p_0 the wings have the normals
// n_1 = e x u_1 and n_2 = u_2 x e: theta is 0 where the wings are flat, positive where the second one rises on the side of n_1, and lies in
// (-pi, pi]; a hinge that is folded through pi begins anew on the other side. With l = |e| and m_i = n_i/|n_i|^2 (R. Bridson, S. Marino, R. Fedkiw,
// Simulation of clothing with folds and wrinkles, 2003; R. Tamstorf, E. Grinspun, Discrete bending forces and their Jacobians, 2013)
//   dtheta/du_1 = l m_1,  dtheta/du_2 = l m_2,  dtheta/de = -(t_1 l m_1 + t_2 l m_2),  t_i = u_i.e/l^2
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include "lattice/spring_laws.hpp"
#include "physics/vector.hpp"

namespace bs {

/// In three dimensions only: the functions for two are there because loops are compiled for both, and are never called.
struct Hinge {
  static constexpr const char* title = "hinge";
  static constexpr int ends = 4, parameters = 2;
  static constexpr double PI = 3.14159265358979323846;

  static InteractionSchema schema() {
    return {title,
            "hinge",
            "quads",
            ends,
            0,
            {{"stiffness", "hinge stiffness", "N m/rad^2", {1, 2, -2}}, {"rest_angle", "rest angle", "rad"}},
            bad_parameter,
            3,
            place_fault,
            true,
            {{0, 1}, {0, 2}, {1, 2}, {0, 3}, {1, 3}}};
  }
  /// Which parameter (its index) is impossible, and what to write; -1: none.
  static int bad_parameter(const double* p, int, const char** remedy) {
    *remedy = "write a finite number >= 0";
    if (!(std::isfinite(p[0]) && p[0] >= 0)) return 0;
    *remedy = "write an angle above -pi and at most pi = 3.141592653589793 [rad]; 0 is flat";
    return p[1] > -PI && p[1] <= PI ? -1 : 1;
  }
  static const char* place_fault(int, const double* const* x, const double* p) { return fault<3>(x, p); }

  /// Null, or why there is no force with the ends at x[0], ..., x[3].
  template <int d>
  static const char* fault(const double* const* x, const double*) noexcept {
    constexpr double NEAR = 1e-10;  // of the wing's sides: its plane is not known any more
    if constexpr (d < 3) return "two dimensions";
    const Geometry g(x);
    if (!(g.l > 0)) return "an edge of zero length";
    for (int w = 0; w < 2; ++w)
      if (!(g.size[w] > NEAR * g.l * norm<3>(g.u[w]))) return w == 0 ? "a first wing without area" : "a second wing without area";
    return nullptr;
  }

  template <int d>
  static double energy(const double* const* x, const double* p) noexcept {
    const double off = Geometry(x).theta() - p[1];
    return 0.5 * p[0] * off * off;
  }

  /// theta - theta_0, which `moment` = dE/dtheta belongs to.
  template <int d>
  static double change(const double* const* x, const double* p, double* moment) noexcept {
    const double change = Geometry(x).theta() - p[1];
    *moment = p[0] * change;
    return change;
  }

  /// f: (ends, d), overwritten.
  template <int d>
  static void force(const double* const* x, const double* p, double* f) noexcept {
    const Geometry g(x);
    g.exert(p[0] * (g.theta() - p[1]), ends * d, f);
  }
  /// The same of df/dp[of]: that of the moment, theta - theta_0 by k and -k by theta_0.
  template <int d>
  static void force_change(const double* const* x, const double* p, int of, double* f) noexcept {
    const Geometry g(x);
    g.exert(of == 0 ? g.theta() - p[1] : -p[0], ends * d, f);
  }

  /// K = -(k grad theta grad theta' + k (theta - theta_0) H): (ends d, ends d) row-major, overwritten. `positive`: -K positive semidefinite, without
  /// H.
  template <int d, bool positive>
  static void tangent(const double* const* x, const double* p, double* K) noexcept {
    constexpr int N = ends * d;
    const Geometry g(x);
    double slope[12];
    g.gradient(slope);
    for (int r = 0; r < N; ++r)
      for (int c = 0; c < N; ++c) K[r * N + c] = -p[0] * slope[r] * slope[c];
    if constexpr (!positive && d == 3) {
      const double moment = p[0] * (g.theta() - p[1]);
      for (int c = 0; c < N; ++c) {
        double z[12] = {}, Hz[12];
        z[c] = 1;
        g.second(z, Hz);
        for (int r = 0; r < N; ++r) K[r * N + c] -= moment * Hz[r];
      }
      for (int r = 0; r < N; ++r)
        for (int c = 0; c < r; ++c) K[r * N + c] = K[c * N + r] = 0.5 * (K[r * N + c] + K[c * N + r]);
    }
  }

  // With g the slope of theta along dx and s its change, E changes by k (s^2/2 + (theta - theta_0)(s - g)) beyond its slope. Of short steps
  // s - g = int_0^1 (1 - tau) dx.H(x + tau dx).dx dtau is free of cancellation; of long ones the difference is.
  /// E(x + dx) - E(x) + f.dx; infinite where there is no value.
  template <int d>
  static double energy_beyond_slope(const double* const* x, const double* const* dx, const double* p) noexcept {
    constexpr double SHORT = 0.05;  // of the shortest of edge and heights: eight points are then exact to rounding
    if constexpr (d < 3) return 0;
    const Geometry g(x);
    double slope[12], step[12], along = 0, largest = 0;
    g.gradient(slope);
    for (int k = 0; k < 12; ++k) {
      step[k] = dx[k / 3][k % 3] - dx[0][k % 3];
      along += slope[k] * step[k];
      largest = std::max(largest, std::abs(step[k]));
    }
    const double theta = g.theta();
    double change, beyond;
    if (largest <= SHORT * std::min({g.l, g.size[0] / g.l, g.size[1] / g.l})) {
      beyond = second_part(x, step);
      change = along + beyond;
      const double turn = theta + change > PI ? -2 * PI : theta + change <= -PI ? 2 * PI : 0;
      change += turn;
      beyond += turn;
    } else {
      change = moved(x, step, 1).theta() - theta;
      beyond = change - along;
    }
    const double value = p[0] * (0.5 * change * change + (theta - p[1]) * beyond);
    return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
  }

  /// Sizes of -df_k/dx_k [N/m].
  template <int d>
  static void rates(const double* const* x, const double* p, double* rate) noexcept {
    double slope[12];
    Geometry(x).gradient(slope);
    for (int k = 0; k < ends; ++k) rate[k] = p[0] * dot<3>(slope + 3 * k, slope + 3 * k);
  }

 private:
  static void cross(const double* a, const double* b, double* out) noexcept {
    for (int c = 0; c < 3; ++c) out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
  }

  struct Geometry {
    double e[3], u[2][3], n[2][3], l, size[2], t[2];
    explicit Geometry(const double* const* x) noexcept {
      for (int c = 0; c < 3; ++c) {
        e[c] = x[1][c] - x[0][c];
        u[0][c] = x[2][c] - x[0][c];
        u[1][c] = x[3][c] - x[0][c];
      }
      l = norm<3>(e);
      cross(e, u[0], n[0]);
      cross(u[1], e, n[1]);
      for (int w = 0; w < 2; ++w) {
        size[w] = norm<3>(n[w]);
        t[w] = dot<3>(u[w], e) / (l * l);
      }
    }
    double theta() const noexcept {
      double both[3];
      cross(n[1], n[0], both);
      const double angle = std::atan2(dot<3>(both, e) / l, dot<3>(n[0], n[1]));
      return angle == -PI ? PI : angle;
    }
    /// By the ends, from that by the arms: (e, u_1, u_2) belong to p_1, p_2, p_3, and p_0 has minus their sum.
    static void to_ends(const double* by_e, const double (*by_u)[3], double* out) noexcept {
      for (int c = 0; c < 3; ++c) {
        out[3 + c] = by_e[c];
        out[6 + c] = by_u[0][c];
        out[9 + c] = by_u[1][c];
        out[c] = -(by_e[c] + by_u[0][c] + by_u[1][c]);
      }
    }
    /// dtheta/dx: (4, 3)
    void gradient(double* out) const noexcept {
      double by_e[3], by_u[2][3];
      for (int c = 0; c < 3; ++c) {
        for (int w = 0; w < 2; ++w) by_u[w][c] = l * n[w][c] / (size[w] * size[w]);
        by_e[c] = -(t[0] * by_u[0][c] + t[1] * by_u[1][c]);
      }
      to_ends(by_e, by_u, out);
    }
    /// f = -moment dtheta/dx, `count` numbers
    void exert(double moment, int count, double* f) const noexcept {
      double slope[12];
      gradient(slope);
      for (int k = 0; k < count; ++k) f[k] = -moment * slope[k];
    }
    // The gradient's derivative along z, with dn_1 = de x u_1 + e x du_1, dn_2 = du_2 x e + u_2 x de,
    //   d(l m_i) = (e.de/l) m_i + l (dn_i - 2 m_i n_i.dn_i)/|n_i|^2,   dt_i = (e.du_i + u_i.de - 2 t_i e.de)/l^2
    /// H z: z, out (4, 3).
    void second(const double* z, double* out) const noexcept {
      double de[3], du[2][3], by_e[3] = {0, 0, 0}, by_u[2][3], a[3], b[3];
      for (int c = 0; c < 3; ++c) {
        de[c] = z[3 + c] - z[c];
        du[0][c] = z[6 + c] - z[c];
        du[1][c] = z[9 + c] - z[c];
      }
      const double stretch = dot<3>(e, de);
      for (int w = 0; w < 2; ++w) {
        const double square = size[w] * size[w], sign = w == 0 ? 1 : -1;
        const double dt = (dot<3>(e, du[w]) + dot<3>(u[w], de) - 2 * t[w] * stretch) / (l * l);
        cross(de, u[w], a);
        cross(e, du[w], b);
        for (int c = 0; c < 3; ++c) a[c] = sign * (a[c] + b[c]);
        const double along = 2 * dot<3>(n[w], a) / square;
        for (int c = 0; c < 3; ++c) {
          by_u[w][c] = (stretch / l * n[w][c] + l * (a[c] - along * n[w][c])) / square;
          by_e[c] -= dt * l * n[w][c] / square + t[w] * by_u[w][c];
        }
      }
      to_ends(by_e, by_u, out);
    }
  };

  static Geometry moved(const double* const* x, const double* step, double part) noexcept {
    double place[12];
    const double* at[4];
    for (int k = 0; k < 12; ++k) place[k] = x[k / 3][k % 3] - x[0][k % 3] + part * step[k];
    for (int k = 0; k < 4; ++k) at[k] = place + 3 * k;
    return Geometry(at);
  }

  /// int_0^1 (1 - tau) dx.H(x + tau dx).dx dtau by Gauss's rule of eight points.
  static double second_part(const double* const* x, const double* step) noexcept {
    constexpr double place[4] = {0.1834346424956498049, 0.5255324099163289858, 0.7966664774136267396, 0.9602898564975362317};
    constexpr double weight[4] = {0.3626837833783619830, 0.3137066458778872873, 0.2223810344533744705, 0.1012285362903762592};
    double sum = 0, Hz[12];
    for (int k = 0; k < 8; ++k) {
      const double tau = 0.5 + (k < 4 ? 0.5 : -0.5) * place[k % 4];
      moved(x, step, tau).second(step, Hz);
      double bent = 0;
      for (int c = 0; c < 12; ++c) bent += step[c] * Hz[c];
      sum += 0.5 * weight[k % 4] * (1 - tau) * bent;
    }
    return sum;
  }
};

}  // namespace bs
