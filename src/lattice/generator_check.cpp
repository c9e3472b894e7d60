// What can be wrong with the description of a lattice.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "base/text.hpp"
#include "lattice/generator.hpp"

namespace bs {

namespace {

enum class Need { finite, nonnegative, positive };

bool holds(double value, Need need) {
  return std::isfinite(value) && (need == Need::finite || value > 0 || (need == Need::nonnegative && value == 0));
}

const char* words(Need need) { return need == Need::finite ? "a finite number" : need == Need::positive ? "a number > 0" : "a number >= 0"; }

std::string check_number(const char* option, double value, Need need) {
  if (holds(value, need)) return {};
  return std::string(option) + " " + short_number(value) + ": write " + words(need);
}

std::string check_list(const char* option, const std::vector<double>& list, std::size_t least, std::size_t most, Need need) {
  if (list.size() < least || list.size() > most)
    return std::string(option) + " has " + how_many(static_cast<std::int64_t>(list.size()), "number") + ": write " +
           (least == most ? "" : std::to_string(least) + " to ") + std::to_string(most);
  for (const double value : list)
    if (!holds(value, need)) return check_number(option, value, need);
  return {};
}

/// The first text that is not empty.
std::string first_of(std::initializer_list<std::string> faults) {
  for (const std::string& fault : faults)
    if (!fault.empty()) return fault;
  return {};
}

std::string name_of(const GeneratorSpec& spec) { return type_info(spec.type).name; }

std::string check_size(const GeneratorSpec& spec) {
  const int axes = type_info(spec.type).axes;
  if (spec.size.empty())
    return std::string("-bs_lattice_size is missing: write how many particles along ") + (axes == 1   ? "x, as in -bs_lattice_size 10"
                                                                                          : axes == 2 ? "x,y, as in -bs_lattice_size 20,10"
                                                                                                      : "x,y,z, as in -bs_lattice_size 10,10,10");
  if (static_cast<int>(spec.size.size()) > axes)
    return "-bs_lattice_size has " + how_many(static_cast<std::int64_t>(spec.size.size()), "number") + ": a " + name_of(spec) + " lattice takes " +
           (axes == 1 ? "one" : "up to " + std::to_string(axes));
  for (const std::int64_t n : spec.size)
    if (n < 1) return "-bs_lattice_size " + std::to_string(n) + ": write whole numbers >= 1";
  // Room for 26 springs a particle.
  const std::int64_t total = particle_count(spec);
  if (total < 0 || total > std::numeric_limits<std::int64_t>::max() / 32)
    return "-bs_lattice_size: this number of particles exceeds 64 bits: write smaller numbers";
  return {};
}

std::string check_dim(const GeneratorSpec& spec) {
  const TypeInfo& info = type_info(spec.type);
  if (spec.dim == 0 || (spec.dim >= info.dim_min && spec.dim <= info.dim_max)) return {};
  std::string allowed = std::to_string(info.dim_min);
  for (int d = info.dim_min + 1; d <= info.dim_max; ++d) allowed += (d == info.dim_max ? " or " : ", ") + std::to_string(d);
  return std::string("-bs_lattice_dim: a ") + info.name + " lattice needs d = " + allowed;
}

std::string check_neighbors(const GeneratorSpec& spec) {
  const TypeInfo& info = type_info(spec.type);
  if (spec.neighbors == 0 || shell_count(spec.type, spec.neighbors) > 0) return {};
  std::string allowed;
  for (const int n : info.neighbors) allowed += (allowed.empty() ? "" : " or ") + std::to_string(n);
  return std::string("-bs_lattice_neighbors: a ") + info.name + " lattice has " + allowed + " neighbours";
}

/// Repeated along axes the lattice has; of the triangular one, whose rows are shifted by turns, by an even number of rows.
std::string check_periodic(const GeneratorSpec& spec) {
  const TypeInfo& info = type_info(spec.type);
  if (spec.periodic.empty()) return {};
  for (std::size_t at = 0; at < spec.periodic.size(); ++at) {
    const int k = spec.periodic[at] - 'x';
    if (k < 0 || k >= info.axes || spec.periodic.find(spec.periodic[at]) != at)
      return "-bs_lattice_periodic " + spec.periodic + ": a " + name_of(spec) + " lattice is repeated along " +
             (info.axes == 1   ? std::string("x: write x")
              : info.axes == 2 ? std::string("x and y: write x, y or xy")
                               : std::string("x, y and z: write some of these, as in xyz"));
  }
  const std::int64_t rows = info.axes > 1 ? spec.size[std::min<std::size_t>(1, spec.size.size() - 1)] : 0;
  if (spec.type == LatticeType::triangular && spec.repeats(1) && rows % 2)
    return "-bs_lattice_periodic " + spec.periodic + ": " + std::to_string(rows) +
           " rows of a triangular lattice do not repeat along y, since every second one is shifted: write an even number of rows in -bs_lattice_size";
  return {};
}

/// Two particles can meet only if their shifts, 2 amplitude apart at most along each axis, span their offset.
std::string check_perturbation(const GeneratorSpec& spec) {
  double limit = std::numeric_limits<double>::infinity();
  const Stencil stencil = make_stencil(spec.type, static_cast<int>(type_info(spec.type).shells.size()));
  for (const Site& kind : stencil.kinds)
    for (const Neighbour& n : kind.neighbours) {
      double widest = 0;
      for (int k = 0; k < 3; ++k) widest = std::max(widest, std::abs(n.offset[k]) * repeated(spec.spacing, k));
      limit = std::min(limit, widest / 2);
    }
  if (spec.perturbation < limit) return {};
  return "-bs_lattice_perturbation " + short_number(spec.perturbation) + ": neighbours could meet; write less than " + short_number(limit);
}

/// Rest angles are checked with those of files, when the dimension's own limits are known.
std::string check_angles(const GeneratorSpec& spec) {
  if (spec.angle_stiffness == 0)
    return spec.rest_angle == GeneratorSpec().rest_angle ? std::string()
                                                         : "-bs_rest_angle needs the angle springs of -bs_angle_stiffness: give that option, too";
  if (!has_lines(spec.type))
    return "-bs_angle_stiffness: in a " + name_of(spec) +
           " lattice no three neighbours lie on a straight line: use chain, square, triangular, cloth, cubic, bcc, fcc or kagome";
  if (dimension(spec) < 2) return "-bs_angle_stiffness: one dimension has no angles: write -bs_lattice_dim 2 or 3";
  return first_of({check_number("-bs_angle_stiffness", spec.angle_stiffness, Need::nonnegative),
                   check_number("-bs_rest_angle", spec.rest_angle, Need::positive)});
}

}  // namespace

std::string check_particle_data(const GeneratorSpec& spec, int dim, int axes, std::int64_t total) {
  const std::size_t d = static_cast<std::size_t>(dim);
  if (spec.total_mass != 0 && spec.particle_mass != 0)
    return "-bs_lattice_total_mass and -bs_lattice_particle_mass are both given: write one of them";
  if (spec.total_mass != 0 && !holds(spec.total_mass, Need::positive))
    return "-bs_lattice_total_mass must be > 0 and finite: write the mass of the whole in kg";
  if (spec.particle_mass != 0 && !holds(spec.particle_mass, Need::positive))
    return "-bs_lattice_particle_mass must be > 0 and finite: write the mass of each particle in kg";
  for (const std::int64_t id : spec.fixed_particles)
    if (id < 0 || id >= total)
      return "-bs_lattice_fixed_particles " + std::to_string(id) + ": there is no such particle; write numbers from 0 to " +
             std::to_string(total - 1);
  if (!spec.velocity_gradient.empty() && spec.velocity_gradient.size() != d * d)
    return "-bs_lattice_velocity_gradient has " + how_many(static_cast<std::int64_t>(spec.velocity_gradient.size()), "number") + ": write " +
           std::to_string(d * d) + ", A row by row";
  Faces faces = 0;
  return first_of({check_number("-bs_lattice_radius", spec.radius, Need::nonnegative),
                   check_number("-bs_lattice_perturbation", spec.perturbation, Need::nonnegative),
                   check_list("-bs_lattice_stiffness", spec.stiffness, 1, 3, Need::nonnegative),
                   check_list("-bs_lattice_damping", spec.damping, 1, 3, Need::nonnegative),
                   check_list("-bs_lattice_velocity", spec.velocity, 0, d, Need::finite),
                   check_list("-bs_lattice_velocity_gradient", spec.velocity_gradient, 0, 9, Need::finite), parse_faces(spec.fixed, axes, &faces)});
}

std::string check(const GeneratorSpec& spec) {
  if (spec.type == LatticeType::none) return {};
  const TypeInfo& info = type_info(spec.type);
  const std::size_t axes = static_cast<std::size_t>(info.axes);
  const std::string shape = first_of({check_size(spec), check_dim(spec), check_neighbors(spec), check_periodic(spec),
                                      check_list("-bs_lattice_spacing", spec.spacing, 1, axes, Need::positive),
                                      check_list("-bs_lattice_origin", spec.origin, 0, static_cast<std::size_t>(dimension(spec)), Need::finite),
                                      check_number("-bs_lattice_rest_length_factor", spec.rest_length_factor, Need::nonnegative),
                                      check_number("-bs_lattice_stiff_fraction", spec.stiff_fraction, Need::nonnegative),
                                      check_number("-bs_lattice_stiff_factor", spec.stiff_factor, Need::nonnegative),
                                      check_number("-bs_lattice_remove_fraction", spec.remove_fraction, Need::nonnegative)});
  if (!shape.empty()) return shape;
  if (spec.stiff_fraction > 1) return "-bs_lattice_stiff_fraction " + short_number(spec.stiff_fraction) + ": write a share from 0 to 1";
  if (spec.remove_fraction > 1) return "-bs_lattice_remove_fraction " + short_number(spec.remove_fraction) + ": write a share from 0 to 1";
  return first_of({check_perturbation(spec), check_angles(spec), check_particle_data(spec, dimension(spec), info.axes, particle_count(spec))});
}

}  // namespace bs
