// Walls that repel, "frce 3" of .xsp scenes.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>

#include "physics/body/law_options.hpp"
#include "physics/body/point.hpp"
#include "physics/body/xsp_power_law.hpp"

namespace bs {

/// From each wall that is there, away from it:  f = m value/max(1, gap)^p where gap >= 0, else 0;
/// gap = distance of the particle's centre from the wall, less its radius (from its mass). d = 1 has no top and bottom;
/// the third axis of d = 3 has no walls.
struct XspWalls {
  static constexpr const char* title = "repelling walls";
  static constexpr Potential potential = Potential::of_position;
  double value = 0;                              ///< acceleration at gap 1 [m^(1+p)/s^2]; < 0 attracts; off: 0
  double exponent = 0;                           ///< p [1]
  double box[4] = {0, 642, 0, 550};              ///< xmin, xmax, ymin, ymax [m]; the default is the window of .xsp scenes
  bool sides[4] = {false, false, false, false};  ///< is there a wall: top, left, right, bottom

  template <class V>
  void options(V& o) {
    o.real("-bs_xsp_walls",
           "walls of XSpringies: acceleration value/max(1, gap)^p away from each wall, with the gap measured from the particle's rim, 0 behind the "
           "wall; a negative value attracts, 0: none [pixel/s^2]",
           value);
    o.real("-bs_xsp_walls_exponent", "walls of XSpringies: exponent p [1]", exponent);
    int count = 4;
    o.reals("-bs_xsp_walls_box", "walls of XSpringies: positions xmin,xmax,ymin,ymax, each min < max [pixel]", box, 4, &count);
    if (count != 4 || !(box[0] < box[1]) || !(box[2] < box[3]))
      o.fail("option -bs_xsp_walls_box: needs xmin < xmax and ymin < ymax: give four numbers xmin,xmax,ymin,ymax [m]");
    double given[4] = {double(sides[0]), double(sides[1]), double(sides[2]), double(sides[3])};
    count = 4;
    o.reals("-bs_xsp_walls_sides", "walls of XSpringies: four numbers top,left,right,bottom, 1 for a wall on that side, 0 for none", given, 4,
            &count);
    for (int i = 0; i < 4; ++i) {
      if (count != 4 || (given[i] != 0 && given[i] != 1))
        o.fail("option -bs_xsp_walls_sides: needs four numbers, each 0 or 1: give top,left,right,bottom, e.g. 1,1,1,1");
      sides[i] = given[i] != 0;
    }
  }
  bool active() const noexcept { return value != 0 && (sides[0] || sides[1] || sides[2] || sides[3]); }
  std::string describe() const {
    constexpr const char* names[] = {"top", "left", "right", "bottom"};
    std::string text = "walls repel with " + short_number(value) + "/max(1, gap)^" + short_number(exponent) + " per mass:";
    for (int i = 0; i < 4; ++i)
      if (sides[i]) text += std::string(" ") + names[i];
    return text;
  }

  /// Continuous, 0 at gap 1 of a wall; constant behind it (the force jumps to 0 there).
  template <int d>
  double energy(const Point<d>& p) const noexcept {
    double sum = 0;
    each_wall<d>(p, [&](int, double, double gap) {
      const double s = std::max(1.0, gap);
      sum += (1 - std::max(0.0, std::min(1.0, gap))) - power_integral(1, s, exponent);
    });
    return p.m * value * sum;
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    each_wall<d>(p, [&](int axis, double away, double gap) {
      if (gap >= 0) f[axis] += away * p.m * value * std::pow(std::max(1.0, gap), -exponent);
    });
    return true;
  }
  /// df/dx = -m value p/gap^(p+1) where gap > 1, whichever way the wall looks; else 0
  template <int d>
  void dfdx(const Point<d>& p, double* K) const noexcept {
    each_wall<d>(p, [&](int axis, double, double gap) {
      if (gap > 1) K[d * axis + axis] -= p.m * value * exponent * std::pow(gap, -exponent - 1);
    });
  }
  template <int d>
  void dfdv(const Point<d>&, double*) const noexcept {}

 private:
  /// Calls wall(axis, direction away from the wall, gap) for each wall that is there.
  template <int d, class Wall>
  void each_wall(const Point<d>& p, Wall&& wall) const noexcept {
    const double radius = xsp_radius(p.m);
    if (sides[1]) wall(0, 1.0, p.x[0] - box[0] - radius);
    if (sides[2]) wall(0, -1.0, box[1] - radius - p.x[0]);
    if constexpr (d > 1) {
      if (sides[0]) wall(1, -1.0, box[3] - radius - p.x[1]);
      if (sides[3]) wall(1, 1.0, p.x[1] - box[2] - radius);
    }
  }
};

}  // namespace bs
