// The numbers of each particle beside its mass, position and velocity, by name. A new one is one line here and its use in a law: reader,
// validation, distribution, fingerprint and trajectory take names, ranges, units and defaults from this list. And what springs can bear.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace bs {

/// The dimension of a quantity: powers of mass, length and time, {0, 1, -1} of a velocity.
struct Powers {
  int mass = 0, length = 0, time = 0;
};

/// A number or a vector of each particle. `name` is that of the dataset /particles/NAME.
struct ParticleParameter {
  const char *name, *unit;
  Powers powers;                ///< what `unit` is made of
  bool nonnegative;             ///< else any finite number
  double missing;               ///< of every particle, where the lattice has no such column
  std::uint64_t table;          ///< number in the fingerprints of checkpoints; 0: made of the name
  bool vector = false;          ///< d numbers of each particle, (N, d); else one, (N)
  const char* shown = nullptr;  ///< of the trajectory's /particles/trajectory/NAME, where that is another name
  constexpr const char* in_trajectory() const { return shown ? shown : name; }
  constexpr int width(int d) const { return vector ? d : 1; }
};

inline constexpr ParticleParameter particle_parameters[] = {
    {"radius", "m", {0, 1, 0}, true, 0.0, 3},
    {"drag", "kg/s", {1, 0, -1}, true, 0.0, 0},
    {"force", "N", {1, 1, -2}, false, 0.0, 0, true, "applied_force"},  // H5MD's `force` is the whole force, of every frame
};

/// The place of `name` in the list; a law that misspells it does not compile.
constexpr std::size_t particle_parameter(std::string_view name) {
  for (std::size_t k = 0; k < std::size(particle_parameters); ++k)
    if (name == particle_parameters[k].name) return k;
  throw std::out_of_range("no such number of a particle");
}

/// Where each number of the list stands among those that a lattice gives; -1: nowhere.
using ColumnPlaces = std::array<int, std::size(particle_parameters)>;

constexpr ColumnPlaces make_no_columns() {
  ColumnPlaces places{};
  for (std::size_t k = 0; k < places.size(); ++k) places[k] = -1;
  return places;
}
inline constexpr ColumnPlaces no_columns = make_no_columns();

/// The numbers of one particle.
struct ParticleNumbers {
  const double* given = nullptr;
  const ColumnPlaces* places = &no_columns;
  double operator[](std::size_t k) const noexcept {
    const int at = (*places)[k];
    return at < 0 || !given ? particle_parameters[k].missing : given[at];
  }
  /// The d numbers of a vector, or null where none is given.
  const double* vector(std::size_t k) const noexcept { return (*places)[k] < 0 || !given ? nullptr : given + (*places)[k]; }
};

/// The numbers of all particles of a rank, as far as the lattice gives them.
struct ParticleColumns {
  ColumnPlaces places = no_columns;
  std::size_t width = 0;
  std::vector<double> given;  ///< (n, width): particle by particle
  template <class Index>
  ParticleNumbers operator()(Index i) const noexcept {
    return {given.data() + static_cast<std::size_t>(i) * width, &places};
  }
};

/// What each spring can bear, for the readers of lattices and options and for the criterion of breaking. `name` is that of the dataset /springs/NAME
/// and of the trajectory's /connectivity/bonds_NAME.
struct BreakLimit {
  const char *name, *option, *meaning, *unit;
  Powers powers;          ///< what `unit` is made of
  const char* threshold;  ///< of the trajectory's /connectivity/bonds_NAME: the limit times the factor drawn for the spring
};

enum { BREAK_STRAIN, BREAK_FORCE, BREAK_ENERGY, BREAK_LIMITS };

inline constexpr BreakLimit break_limits[BREAK_LIMITS] = {
    {"critical_strain", "-bs_break_strain", "strain |l - L|/L", "1", {0, 0, 0}, "threshold_strain"},
    {"critical_force", "-bs_break_force", "force along the spring without its damper's", "N", {1, 1, -2}, "threshold_force"},
    {"critical_energy", "-bs_break_energy", "elastic energy", "J", {1, 2, -2}, "threshold_energy"},
};

/// What each interaction can bear whose law has an angle: dataset /angles/NAME or the like, the trajectory's /connectivity/angles_NAME, option
/// -bs_break_angle_ and the suffix that stands here as `option`.
enum { TURN_CHANGE, TURN_MOMENT, TURN_ENERGY, TURN_LIMITS };

inline constexpr BreakLimit turn_limits[TURN_LIMITS] = {
    {"critical_change", "change", "change of the angle |theta - theta_0|", "rad", {0, 0, 0}, "threshold_change"},
    {"critical_moment", "moment", "moment |dE/dtheta|", "N m", {1, 2, -2}, "threshold_moment"},
    {"critical_energy", "energy", "elastic energy", "J", {1, 2, -2}, "threshold_energy"},
};

/// Dataset /springs/area and the trajectory's /connectivity/bonds_area: cross-sections [m^2], > 0.
inline constexpr const char* AREA = "area";

/// Datasets /springs/broken, /angles/broken, ... and fields /backspring/broken, broken_angles, ...: 1 where a part is broken, 0 elsewhere.
inline constexpr const char* BROKEN = "broken";

}  // namespace bs
