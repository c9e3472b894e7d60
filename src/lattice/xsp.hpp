// Reads XSpringies scenes: masses and springs in a window, in pixels, seconds and masses of 1. A scene as its records say it, and what it means
// as a lattice.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// The window XSpringies opened: its size is not in the file.
constexpr double XSP_WIDTH = 642, XSP_HEIGHT = 550;

/// Reads the scene `text`, called `name` in messages, in a window of `width` x `height` pixels with the origin at the
/// bottom left. On success `*out` is the whole scene: d = 2, hooke springs with axial damping, spring ends as rows in
/// the order of the file's mass records, the file's ids in out->id, forces that are on as out->implied_options. A mass
/// < 0 in the file is a fixed particle of that size, 0 is 1; springs to unknown masses or from a mass to itself are
/// dropped with a warning. On failure returns false and sets `*error` to one line "name:line: what is wrong".
bool parse_xsp(const std::string& text, const std::string& name, double width, double height, Lattice* out, std::string* error);

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

/// Radius [px] of a particle of mass > 0, for forces 2 and 3: max(1, min(64, trunc(2 ln(4 m + 1)))).
inline double xsp_radius(double mass) noexcept { return std::max(1.0, std::min(64.0, std::trunc(2 * std::log(4 * mass + 1)))); }

/// All options that a scene may imply: a lattice file that was made of one holds them.
inline constexpr const char* XSP_OPTIONS[] = {"-bs_viscosity",
                                              "-bs_gravity",
                                              "-bs_xsp_center_of_mass",
                                              "-bs_xsp_center_of_mass_damping",
                                              "-bs_xsp_attraction",
                                              "-bs_xsp_attraction_exponent",
                                              "-bs_xsp_center_particle",
                                              "-bs_xsp_attraction_center",
                                              "-bs_xsp_walls",
                                              "-bs_xsp_walls_exponent",
                                              "-bs_xsp_walls_sides",
                                              "-bs_xsp_walls_box",
                                              "-ts_dt"};

/// The scene as a lattice; `name` and the window as in parse_xsp.
Lattice xsp_lattice(const XspScene& scene, const std::string& name, double width, double height);

}  // namespace bs
