#include "lattice/xsp.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"

namespace bs {

namespace {

void add_masses(const XspScene& scene, Lattice* out) {
  const std::int64_t n = static_cast<std::int64_t>(scene.masses.size());
  Column radius{"radius", "", {}};
  out->particles = {0, n, n};
  for (const XspMass& m : scene.masses) {
    const bool fixed = m.mass < 0;
    const double mass = m.mass == 0 ? 1.0 : std::abs(m.mass);
    out->id.push_back(m.id);
    out->position.insert(out->position.end(), {m.x, m.y});
    out->velocity.insert(out->velocity.end(), {fixed ? 0.0 : m.vx, fixed ? 0.0 : m.vy});
    out->mass.push_back(mass);
    radius.value.push_back(xsp_radius(mass));
    out->fixed.push_back(fixed ? 1 : 0);
  }
  out->particle_columns.push_back(std::move(radius));
}

/// Counts the springs that were dropped for one reason, and keeps the first of them.
struct Dropped {
  std::int64_t count = 0;
  const XspSpring* first = nullptr;
  void add(const XspSpring& s) {
    if (count++ == 0) first = &s;
  }
  void warn(const std::string& name, const std::string& reason, Lattice* out) const {
    if (count == 0) return;
    out->warnings.push_back(name + ":" + std::to_string(first->line) + ": spring " + std::to_string(first->id) + " " + reason + ": dropped" +
                            (count > 1 ? ", and " + std::to_string(count - 1) + " more like it" : std::string()));
  }
};

void add_springs(const XspScene& scene, const std::string& name, Lattice* out) {
  Dropped unknown, self;
  std::int64_t missing = 0;
  for (const XspSpring& s : scene.springs) {
    const auto a = scene.row_of.find(s.a), b = scene.row_of.find(s.b);
    if (a == scene.row_of.end() || b == scene.row_of.end()) {
      if (unknown.count == 0) missing = a == scene.row_of.end() ? s.a : s.b;
      unknown.add(s);
    } else if (s.a == s.b) {
      self.add(s);
    } else {
      out->pairs.insert(out->pairs.end(), {a->second, b->second});
      out->stiffness.push_back(s.stiffness);
      out->damping.push_back(s.damping);
      out->rest_length.push_back(s.rest_length);
    }
  }
  const std::int64_t m = static_cast<std::int64_t>(out->stiffness.size());
  out->springs = {0, m, m};
  unknown.warn(name, "ends at mass " + std::to_string(missing) + ", which does not exist", out);
  self.warn(name, "joins mass " + std::to_string(self.count ? self.first->a : 0) + " to itself", out);
}

std::string pair_of(double a, double b) { return plain_number(a + 0.0) + "," + plain_number(b + 0.0); }  // no -0

/// Sets the centre C of forces 1 and 2: a particle, or the middle of the window.
void add_center(const XspScene& scene, const std::string& name, double width, double height, Lattice* out) {
  if (!scene.force[1].on && !scene.force[2].on) return;
  const auto row = scene.row_of.find(scene.center);
  if (row != scene.row_of.end()) {
    out->implied_options.emplace_back("-bs_xsp_center_particle", std::to_string(row->second));
    return;
  }
  if (scene.center != -1)
    out->warnings.push_back(name + ": cent " + std::to_string(scene.center) + " names no mass: the middle of the window is the centre");
  out->implied_options.emplace_back("-bs_xsp_attraction_center", pair_of(width / 2, height / 2));
}

void add_walls(const XspScene& scene, double width, double height, Lattice* out) {
  if (!scene.force[3].on || std::none_of(scene.wall, scene.wall + 4, [](bool there) { return there; })) return;
  std::string sides;
  for (int k = 0; k < 4; ++k) sides += std::string(k ? "," : "") + (scene.wall[k] ? "1" : "0");
  out->implied_options.emplace_back("-bs_xsp_walls", plain_number(scene.force[3].value));
  out->implied_options.emplace_back("-bs_xsp_walls_exponent", plain_number(scene.force[3].misc));
  out->implied_options.emplace_back("-bs_xsp_walls_sides", sides);
  out->implied_options.emplace_back("-bs_xsp_walls_box", "0," + plain_number(width) + ",0," + plain_number(height));
}

void add_forces(const XspScene& scene, const std::string& name, double width, double height, Lattice* out) {
  auto& options = out->implied_options;
  const double degree = std::acos(-1.0) / 180;
  if (scene.viscosity > 0) options.emplace_back("-bs_viscosity", plain_number(scene.viscosity));
  if (scene.force[0].on) {
    // g (sin w, -cos w), w from the downward direction
    const double g = scene.force[0].value, w = scene.force[0].misc * degree;
    options.emplace_back("-bs_gravity", pair_of(g * std::sin(w), -g * std::cos(w)));
  }
  if (scene.force[1].on) {
    options.emplace_back("-bs_xsp_center_of_mass", plain_number(scene.force[1].value));
    options.emplace_back("-bs_xsp_center_of_mass_damping", plain_number(scene.force[1].misc));
  }
  if (scene.force[2].on) {
    options.emplace_back("-bs_xsp_attraction", plain_number(scene.force[2].value));
    options.emplace_back("-bs_xsp_attraction_exponent", plain_number(scene.force[2].misc));
  }
  add_center(scene, name, width, height, out);
  add_walls(scene, width, height, out);
  if (scene.step > 0) options.emplace_back("-ts_dt", plain_number(scene.step));
}

/// Warns in one line of everything in the scene that is not modelled, and in another of unknown words.
void add_warnings(const XspScene& scene, const std::string& name, Lattice* out) {
  static const char* const side[4] = {"top", "left", "right", "bottom"};
  std::string walls;
  for (int k = 0; k < 4; ++k)
    if (scene.wall[k]) walls += (walls.empty() ? " (walls: " : ", ") + std::string(side[k]);
  std::vector<std::string> parts;
  if (!walls.empty()) parts.push_back("bounces" + walls + ")");
  if (scene.stickiness > 0) parts.push_back("stickiness (stck " + short_number(scene.stickiness) + ")");
  if (scene.force[4].on) parts.push_back("collisions (frce 4)");
  if (!parts.empty()) {
    std::string line = name + ": ignored, as not modelled: ";
    for (std::size_t k = 0; k < parts.size(); ++k) line += (k ? ", " : "") + parts[k];
    out->warnings.push_back(line);
  }
  if (!scene.unknown_words.empty()) {
    std::string line = name + ":" + std::to_string(scene.unknown_line) + ": unknown records skipped:";
    for (const std::string& word : scene.unknown_words) line += " " + word;
    out->warnings.push_back(line);
  }
}

}  // namespace

Lattice xsp_lattice(const XspScene& scene, const std::string& name, double width, double height) {
  Lattice out;
  out.dim = 2;
  out.source = name;
  add_masses(scene, &out);
  add_springs(scene, name, &out);
  out.spring_law = SpringLaw::hooke;
  out.damping_law = DampingLaw::axial;
  out.spring_law_given = out.damping_law_given = true;
  out.rest_at_zero_length = true;
  add_forces(scene, name, width, height, &out);
  add_warnings(scene, name, &out);
  return out;
}

}  // namespace bs
