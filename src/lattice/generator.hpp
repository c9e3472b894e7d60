// Regular lattices made in parallel: every rank builds its own rows, whatever the number of ranks.
#pragma once
#include <cstdint>
#include <string>
#include <vector>
#include "lattice/groups.hpp"
#include "lattice/lattice.hpp"

namespace bs {

// Unit cells of the regular lattices and, by distance, which particles a spring joins.

enum class LatticeType { none, chain, square, triangular, cloth, cubic, bcc, fcc, kagome, honeycomb, diamond };

/// Which particles go when springs have been removed (input/dilution.hpp).
enum class PruneRule { none, dangling, rattlers };
/// Names in the order of PruneRule, as -bs_lattice_prune takes them.
const std::vector<std::string>& prune_rule_names();

/// What is fixed by the type's name.
struct TypeInfo {
  const char* name;
  int axes;              ///< directions the lattice extends in: 1, 2, 3
  int dim_min, dim_max;  ///< dimensions d it may live in
  int dim_default;
  std::vector<double> shells;  ///< squared distance of each neighbour class, spacing 1
  std::vector<int> neighbors;  ///< neighbours of an inner particle, up to and including that class
  int neighbors_default;
};

const TypeInfo& type_info(LatticeType type);
/// Names in the order of LatticeType, as -bs_lattice_type takes them.
const std::vector<std::string>& lattice_type_names();

/// One neighbour seen from a site: the particle at `site` of the cell `cell` further on.
struct Neighbour {
  int cell[3];
  int site;
  int shell;         ///< neighbour class, 0-based
  double offset[3];  ///< from particle to neighbour, spacing 1
};

/// A site of the unit cell, or one of the two kinds of rows of the triangular lattice.
struct Site {
  double shift[3];  ///< from the cell's corner, spacing 1
  std::vector<Neighbour> neighbours;
};

/// The unit cell and the neighbours of each of its sites.
struct Stencil {
  int sites = 1;               ///< particles per cell
  bool staggered = false;      ///< triangular: every second row (odd index along y) is shifted by half a spacing
  double edge[3] = {1, 1, 1};  ///< cell edges, spacing 1
  std::vector<Site> kinds;     ///< `sites` of them, or 2 where staggered (even row, odd row)
};

/// Number of shells that make up `neighbors` neighbours; 0 where the type has no such number.
int shell_count(LatticeType type, int neighbors);

/// The stencil of `type` (not none) with springs to the first `shells` classes.
Stencil make_stencil(LatticeType type, int shells);

/// The nearest neighbour of a site of `kind` that lies as far on and in the same direction as `way`; null: there is none.
const Neighbour* straight_on(const Site& kind, const Neighbour& way);

/// Whether nearest neighbours of the type lie on straight lines.
bool has_lines(LatticeType type);

/// A lattice to generate. Lists shorter than they could be: of size, spacing, stiffness and damping the last number is
/// repeated; of origin and velocity the missing ones are 0. The fields from `total_mass` on hold for lattices read from
/// files that carry no such data, too.
struct GeneratorSpec {
  LatticeType type = LatticeType::none;
  std::vector<std::int64_t> size;              ///< particles along x[, y[, z]]; where the unit cell has several sites, cells
  int dim = 0;                                 ///< d; 0: the type's default
  std::vector<double> spacing{1.0};            ///< along x[, y[, z]] [m]; bcc, fcc, diamond: edge of the cubic cell
  int neighbors = 0;                           ///< springs of an inner particle; 0: the type's default
  double rest_length_factor = 1;               ///< rest length = unperturbed distance times this
  double perturbation = 0;                     ///< largest random displacement of a free particle along each axis [m]
  std::int64_t seed = 1;                       ///< of the perturbation and of the choice of stiff and removed springs
  std::vector<double> origin;                  ///< lower corner [m]
  double stiff_fraction = 0;                   ///< share of springs made stiffer, 0 to 1
  double stiff_factor = 1;                     ///< how many times stiffer
  double remove_fraction = 0;                  ///< share of springs that are left out, 0 to 1 (input/dilution.hpp)
  bool remove_each = false;                    ///< each with that probability, not that number of them
  PruneRule prune = PruneRule::none;           ///< which particles go then
  double total_mass = 0;                       ///< shared evenly by all particles, fixed ones too [kg]; 0: not given
  double particle_mass = 0;                    ///< of each particle [kg]; 0: from the total mass, else 1
  double radius = 0;                           ///< of each particle [m]; 0: not given
  std::vector<double> stiffness{1000.0};       ///< hooke [N/m], strain [N], per neighbour class
  std::vector<double> damping{0.0};            ///< [kg/s], per neighbour class
  std::string periodic;                        ///< axes along which the lattice is repeated, of x, y, z
  double angle_stiffness = 0;                  ///< of an angle spring over every three particles along a line [N m/rad^2]; 0: none
  double rest_angle = 3.14159265358979323846;  ///< of these [rad]
  std::vector<std::string> fixed;              ///< faces: xmin, xmax, ymin, ...
  std::vector<std::int64_t> fixed_particles;   ///< 0-based rows
  std::vector<std::string> fixed_groups;       ///< names of groups
  std::vector<GroupSpec> groups;               ///< read by input/groups
  std::vector<double> velocity;                ///< uniform part u of v = u + A x, x unperturbed [m/s]
  std::vector<double> velocity_gradient;       ///< A (d, d) row by row [1/s], or empty

  /// Whether the lattice is repeated along axis k.
  bool repeats(int k) const { return periodic.find(static_cast<char>('x' + k)) != std::string::npos; }
  /// Reads the -bs_lattice_ options; V is bs::Section or has the same readers.
  template <class V>
  void options(V& o);
};

/// One line that says what is wrong with `spec` and what to write instead; empty if nothing. A spec of type none is
/// right. That sizes fit PETSc's indices is checked elsewhere.
std::string check(const GeneratorSpec& spec);

/// The same for the fields from total_mass on, over particles in d = `dim` that extend along the first `axes` axes;
/// `total` particles.
std::string check_particle_data(const GeneratorSpec& spec, int dim, int axes, std::int64_t total);

/// Dimension d of the lattice; mass of each of `total` particles [kg]; k-th of a list whose last number repeats.
int dimension(const GeneratorSpec& spec);
double mass_of_each(const GeneratorSpec& spec, std::int64_t total);
double repeated(const std::vector<double>& list, int k);

/// Particles of the whole lattice; -1 where that overflows. Needs a type and one to three sizes >= 1.
std::int64_t particle_count(const GeneratorSpec& spec);
/// Springs of the whole lattice. Needs a spec that check() finds right and that is not none.
std::int64_t spring_count(const GeneratorSpec& spec);

/// The chunk split_rows(particle_count(spec), rank, size) of the particles, and the springs whose lower end i lies in
/// it, as pairs (i, j), i < j, in ascending order. Cells are numbered x fastest, the particles of a cell one after the
/// other. springs.count is known here; springs.first and springs.total, which need the other ranks' counts, are left 0
/// for the caller's exclusive scan and sum. Angle springs, likewise, are those whose first particle lies in the chunk: particle by
/// particle, by their directions along straight lines of nearest neighbours: along z, then y, then x upwards, the axis x first, z last. Needs a spec
/// that check() finds right and that is not none.
///
/// Spring (i, j) is stiff_factor times stiffer where hash_uniform(seed, Stream::stiff_springs, i, j) < stiff_fraction.
/// Fixed particles are not perturbed, and their velocity is 0. Faces: the planes that bound the lattice, except that in
/// the triangular one xmin and xmax take the end of every row.
Lattice generate(const GeneratorSpec& spec, int rank, int size);

/// Shifts each free particle by up to spec.perturbation either way along every axis, by its row and the seed.
void perturb(const GeneratorSpec& spec, Lattice* lattice);

/// Reads up to `max` numbers into a list; leaves the list alone where the option is absent.
template <class V>
void read_list(V& o, const char* name, const char* help, int max, std::vector<double>& list) {
  double values[9] = {};
  int count = 0;
  for (; count < static_cast<int>(list.size()) && count < max; ++count) values[count] = list[static_cast<std::size_t>(count)];
  if (o.reals(name, help, values, max, &count)) list.assign(values, values + count);
}

template <class V>
void GeneratorSpec::options(V& o) {
  int index = static_cast<int>(type);
  std::int64_t d = dim, n = neighbors;
  if (o.choice("-bs_lattice_type", "regular lattice to generate", lattice_type_names(), index)) type = static_cast<LatticeType>(index);
  o.integers(
      "-bs_lattice_size",
      "number of particles (bcc, fcc, diamond: of cubic cells of 2, 4, 8 particles; kagome, honeycomb: of cells of 6, 4 particles, 2 x 2 sqrt(3), "
      "sqrt(3) x 3 spacings large) along x[,y[,z]]; the last number also applies to the axes after it",
      size);
  if (o.integer("-bs_lattice_dim", "dimension d of space, 1 to 3 (0: the default of the lattice type)", d))
    dim = d < 0 || d > 3 ? -1 : static_cast<int>(d);
  read_list(o, "-bs_lattice_spacing", "distance between neighbours along x[,y[,z]]; bcc, fcc, diamond: edge of a cubic cell [m]", 3, spacing);
  if (o.integer("-bs_lattice_neighbors",
                "number of springs at an inner particle (0: the default of the lattice type): square 4, 8; cloth 4, 8, 12; cubic 6, 18, 26; "
                "bcc 8, 14; fcc 12, 18; kagome 4, 8; honeycomb 3, 9, 12; diamond 4, 16",
                n))
    neighbors = n < 0 || n > 100 ? -1 : static_cast<int>(n);
  // 0 means not given; a 0 that was written is turned into what check() refuses.
  if (o.real("-bs_lattice_total_mass", "total mass of the lattice, divided equally among its particles [kg]", total_mass) && total_mass == 0)
    total_mass = -1;
  if (o.real("-bs_lattice_particle_mass", "mass of each particle; 1 if neither mass is given [kg]", particle_mass) && particle_mass == 0)
    particle_mass = -1;
  read_list(o, "-bs_lattice_stiffness",
            "stiffness of the springs along axes, face diagonals and body diagonals (cloth: structural, shear and bending springs; bcc, fcc, kagome, "
            "honeycomb, diamond: nearest neighbours first); the last number also applies to the classes after it [N/m, strain law: N]",
            3, stiffness);
  read_list(o, "-bs_lattice_damping", "damping of the springs, by the same classes as -bs_lattice_stiffness [kg/s]", 3, damping);
  o.real("-bs_angle_stiffness",
         "stiffness of the angle spring at every three particles that follow on a straight line of nearest neighbours, on a chain, along the axes of "
         "square, "
         "cloth and cubic lattices, the 3 lines of a triangular, 2 of a kagome, 4 of a bcc and 6 of an fcc lattice; 0: no angle springs [N m/rad^2]",
         angle_stiffness);
  o.real("-bs_rest_angle", "rest angle of the springs of -bs_angle_stiffness; pi: a straight line [rad]", rest_angle);
  o.real("-bs_lattice_rest_length_factor", "ratio of rest length to unperturbed distance, >= 0", rest_length_factor);
  o.text("-bs_lattice_periodic", "axes along which the lattice is repeated periodically, e.g. x, xy or xyz: springs join its opposite faces",
         periodic);
  o.texts("-bs_lattice_fixed", "faces of the lattice whose particles are fixed: xmin,xmax,ymin,ymax,zmin,zmax", fixed);
  o.integers("-bs_lattice_fixed_particles", "indices of fixed particles, counted from 0", fixed_particles);
  o.texts("-bs_lattice_fixed_groups", "names of groups (-bs_group_NAME, or of the lattice file) whose particles are fixed", fixed_groups);
  o.real("-bs_lattice_perturbation",
         "largest random displacement of a free particle along each axis, of files too; rest lengths stay those of the places before [m]",
         perturbation);
  o.integer("-bs_lattice_seed", "seed of the random perturbation and of the random choice of stiffer and of removed springs", seed);
  read_list(o, "-bs_lattice_origin", "lower corner of the lattice [m]", 3, origin);
  read_list(o, "-bs_lattice_velocity", "vector u of the initial velocity v = u + A x [m/s]", 3, velocity);
  read_list(o, "-bs_lattice_velocity_gradient",
            "matrix A of the initial velocity v = u + A x at the unperturbed position x: d x d numbers, row by row [1/s]", 9, velocity_gradient);
  o.real("-bs_lattice_radius", "radius of each particle (0: no radius) [m]", radius);
  o.real("-bs_lattice_stiff_fraction", "fraction of the springs, chosen at random, that are made stiffer, 0 to 1", stiff_fraction);
  o.real("-bs_lattice_stiff_factor", "factor on the stiffness of the springs chosen by -bs_lattice_stiff_fraction", stiff_factor);
  o.real("-bs_lattice_remove_fraction",
         "fraction of the springs, chosen at random, that are left out, 0 to 1: the nearest whole number of them, the same on any number of ranks; "
         "angle "
         "springs along them go, too",
         remove_fraction);
  o.flag("-bs_lattice_remove_each", "leave each spring out with the probability -bs_lattice_remove_fraction, in the place of a given number of them",
         remove_each);
  index = static_cast<int>(prune);
  if (o.choice(
          "-bs_lattice_prune",
          "particles that are left out, one after the other until none is left to go (dangling: those with one spring or none; rattlers: those "
          "whose springs' directions are linearly independent, in which no tensions can balance, such as all with fewer than two springs and those "
          "with two at an angle; what is fixed or in a group stays); ids are the rows before",
          prune_rule_names(), index))
    prune = static_cast<PruneRule>(index);
}

}  // namespace bs
