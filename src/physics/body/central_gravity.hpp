// Gravity of point masses that do not move.
#pragma once
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -s G m M0 r/|r|^3,  E = -s G m M0/|r|,  r = x - x0; singular at r = 0;  s = 1, but in load steps
struct CentralGravity {
  static constexpr const char* title = "central gravity";
  static constexpr Potential potential = Potential::of_position;
  double G = 6.6743e-11;                    ///< constant of gravitation [m^3/(kg s^2)] (CODATA 2018)
  double M0 = 0;                            ///< central mass [kg]; off: 0
  double x0[3] = {0, 0, 0};                 ///< its place [m]
  int components = 1;                       ///< how many of x0 were given
  double load = 1;                          ///< s, the factor of the load step
  std::string place = "-bs_central_point";  ///< the option that gives x0

  /// The mass whose options have no name, whether it is given or not, and one more for every NAME.
  template <class V>
  static void options(V& o, std::vector<CentralGravity>* all) {
    CentralGravity one;
    const bool constant = o.real("-bs_central_G", "gravitational constant G, >= 0 [m^3/(kg s^2)]", one.G, RangeOf<V>::nonnegative);
    std::set<std::string> names{""};
    for (const std::string& name : o.names("-bs_central_M0_NAME", "one more mass that attracts every particle, with a NAME of its own, >= 0 [kg]"))
      names.insert("_" + lower(name));
    for (const std::string& name : o.names("-bs_central_point_NAME", "position x,y[,z] of the mass NAME [m]")) names.insert("_" + lower(name));
    bool some = false;
    all->clear();
    for (const std::string& name : names) {
      all->push_back(one);
      some = all->back().read(o, name) || some;
    }
    if (constant) require(o, some, "-bs_central_G", "-bs_central_M0");
  }
  bool active() const noexcept { return M0 != 0; }
  std::string describe() const { return "central gravity G M0 = " + short_number(G * M0) + " m^3/s^2 at " + vector_text(x0, components) + " m"; }

  template <int d>
  double energy(const Point<d>& p) const noexcept {
    double r[d];
    return -load * G * M0 * p.m / distance<d>(p, r);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    double r[d];
    const double l = distance<d>(p, r);
    const double q = load * G * M0 * p.m / (l * l * l);
    if (!std::isfinite(q)) return false;
    for (int i = 0; i < d; ++i) f[i] -= q * r[i];
    return true;
  }
  /// df/dx = -G m M0/|r|^3 (I - 3 u u^T),  u = r/|r|; adds nothing at r = 0
  template <int d>
  void dfdx(const Point<d>& p, double* K) const noexcept {
    double r[d];
    const double l = distance<d>(p, r);
    const double q = load * G * M0 * p.m / (l * l * l);
    if (!std::isfinite(q)) return;
    for (int i = 0; i < d; ++i) r[i] /= l;
    add_tensor<d>(-q, 3 * q, r, K);
  }
  template <int d>
  void dfdv(const Point<d>&, double*) const noexcept {}

 private:
  /// Whether the mass is given.
  template <class V>
  bool read(V& o, const std::string& name) {
    const std::string mass = "-bs_central_M0" + name;
    place += name;
    const bool given = o.real(mass.c_str(), "mass M0 that attracts every particle, >= 0; 0: none [kg]", M0, RangeOf<V>::nonnegative);
    const bool point = read_vector(o, place.c_str(), "position x,y[,z] of the mass M0 [m]", x0, components);
    if (point) require(o, given, place.c_str(), mass.c_str());
    return given;
  }
  template <int d>
  double distance(const Point<d>& p, double* r) const noexcept {
    for (int i = 0; i < d; ++i) r[i] = p.x[i] - x0[i];
    return norm<d>(r);
  }
};

}  // namespace bs
