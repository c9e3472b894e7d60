// An XSpringies scene as its records say it, and what it means as a lattice.
#pragma once
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "lattice/lattice.hpp"

namespace bs {

struct XspMass {
  std::int64_t id;
  int line;
  double x, y, vx, vy, mass;  ///< mass as written: < 0 fixed, 0 means 1
};

struct XspSpring {
  std::int64_t id, a, b;  ///< a, b: ids of masses
  int line;
  double stiffness, damping, rest_length;
};

/// `frce k`: a force of the scene, off where the file has none.
struct XspForce {
  bool on = false;
  double value = 0, misc = 0;
};

struct XspScene {
  std::vector<XspMass> masses;
  std::unordered_map<std::int64_t, std::int64_t> row_of;  ///< id of a mass -> its row
  std::vector<XspSpring> springs;
  XspForce force[5];
  std::int64_t center = -1;  ///< id of the mass that is the centre of forces 1 and 2; -1: the window's middle
  double viscosity = 0, step = 0, stickiness = 0;
  bool wall[4] = {false, false, false, false};  ///< top, left, right, bottom
  std::vector<std::string> unknown_words;       ///< the first few, each once
  int unknown_line = 0;                         ///< where the first of them is
};

/// Radius [px] of a particle, for forces 2 and 3.
double xsp_radius(double mass);

/// The scene as a lattice; `name` and the window as in parse_xsp.
Lattice xsp_lattice(const XspScene& scene, const std::string& name, double width, double height);

}  // namespace bs
