// A law that the library does not have, as a program brings it along: the bond of Morse's potential between two atoms.
//
//   E = D (1 - s)^2,  s = exp(-a (l - l_0)):   tension dE/dl = 2 D a s (1 - s),   rate along d2E/dl2 = 2 D a^2 s (2 s - 1),   across dE/dl / l
//
// P. M. Morse, Phys. Rev. 34 (1929) 57. What each function has to give stands in physics/interactions/registry.hpp.
#pragma once
#include <algorithm>
#include <cmath>

#include <backspring/backspring.hpp>

struct MorseBond {
  static constexpr const char* title = "Morse bond";
  static constexpr int ends = 2, parameters = 3;

  /// Datasets /morse_bonds/pairs, depth, width, length of lattice files.
  static bs::InteractionSchema schema() {
    return {
        title, "morse_bond", "pairs", ends, 0, {{"depth", "depth D", "J"}, {"width", "width a", "1/m"}, {"length", "length l_0", "m"}}, bad_parameter,
        2,     place_fault};
  }
  static int bad_parameter(const double* p, int, const char** remedy) {
    *remedy = "write a finite number > 0";
    for (int k = 0; k < parameters; ++k)
      if (!(std::isfinite(p[k]) && p[k] > 0)) return k;
    return -1;
  }
  static const char* place_fault(int dim, const double* const* x, const double* p) { return dim == 2 ? fault<2>(x, p) : fault<3>(x, p); }

  template <int d>
  static const char* fault(const double* const* x, const double*) noexcept {
    return Bond<d>(x).l > 0 ? nullptr : "two atoms at one place";
  }
  template <int d>
  static double energy(const double* const* x, const double* p) noexcept {
    const double s = decay(Bond<d>(x).l, p);
    return p[0] * (1 - s) * (1 - s);
  }
  template <int d>
  static void force(const double* const* x, const double* p, double* f) noexcept {
    const Bond<d> bond(x);
    const double T = tension(bond.l, p);
    for (int c = 0; c < d; ++c) {
      f[c] = T * bond.u[c];
      f[d + c] = -f[c];
    }
  }
  template <int d, bool positive>
  static void tangent(const double* const* x, const double* p, double* K) noexcept {
    const Bond<d> bond(x);
    const double s = decay(bond.l, p), least = positive ? 0 : -1e300;
    const double along = std::max(least, 2 * p[0] * p[1] * p[1] * s * (2 * s - 1)), across = std::max(least, tension(bond.l, p) / bond.l);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) {
        const double uu = bond.u[r] * bond.u[c], B = along * uu + across * ((r == c) - uu);
        for (int a = 0; a < ends; ++a)
          for (int b = 0; b < ends; ++b) K[(a * d + r) * ends * d + b * d + c] = a == b ? -B : B;
      }
  }
  // With w = u.dx, the change of l beyond its slope is (|dx|^2 - w^2)/(l' + l + w); with q = 1 - exp(-a dl), E changes by 2 D s (1 - s) q + D s^2
  // q^2.
  template <int d>
  static double energy_beyond_slope(const double* const* x, const double* const* dx, const double* p) noexcept {
    const Bond<d> bond(x);
    double change[d], w = 0, square = 0, after = 0;
    for (int c = 0; c < d; ++c) {
      change[c] = dx[1][c] - dx[0][c];
      w += bond.u[c] * change[c];
      square += change[c] * change[c];
      after += (bond.l * bond.u[c] + change[c]) * (bond.l * bond.u[c] + change[c]);
    }
    const double beyond = (square - w * w) / (std::sqrt(after) + bond.l + w), dl = w + beyond;
    const double s = decay(bond.l, p), q = -std::expm1(-p[1] * dl);
    return 2 * p[0] * s * (1 - s) * (p[1] * beyond - exponential_beyond_slope(-p[1] * dl)) + p[0] * s * s * q * q;
  }
  template <int d>
  static void rates(const double* const*, const double* p, double* rate) noexcept {
    rate[0] = rate[1] = 2 * p[0] * p[1] * p[1];
  }

 private:
  template <int d>
  struct Bond {
    double u[d], l = 0;  ///< from the first atom to the second
    explicit Bond(const double* const* x) noexcept {
      for (int c = 0; c < d; ++c) {
        u[c] = x[1][c] - x[0][c];
        l += u[c] * u[c];
      }
      l = std::sqrt(l);
      for (double& one : u) one /= l;
    }
  };
  static double decay(double l, const double* p) noexcept { return std::exp(-p[1] * (l - p[2])); }
  static double tension(double l, const double* p) noexcept { return 2 * p[0] * p[1] * decay(l, p) * (1 - decay(l, p)); }
  /// exp(z) - 1 - z
  static double exponential_beyond_slope(double z) noexcept {
    if (std::abs(z) > 0.1) return std::expm1(z) - z;
    double sum = 0;
    for (int k = 14; k >= 2; --k) sum = (sum + 1) * z / k;
    return sum * z;
  }
};
