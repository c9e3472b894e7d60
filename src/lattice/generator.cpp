#include "lattice/generator.hpp"
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include "base/hash.hpp"

namespace bs {

int dimension(const GeneratorSpec& spec) { return spec.dim > 0 ? spec.dim : type_info(spec.type).dim_default; }

double repeated(const std::vector<double>& list, int k) { return list[std::min(static_cast<std::size_t>(k), list.size() - 1)]; }

double mass_of_each(const GeneratorSpec& spec, std::int64_t total) {
  if (spec.total_mass > 0) return spec.total_mass / static_cast<double>(total);
  return spec.particle_mass > 0 ? spec.particle_mass : 1.0;
}

namespace {

int neighbours_of(const GeneratorSpec& spec) { return spec.neighbors > 0 ? spec.neighbors : type_info(spec.type).neighbors_default; }

/// Cells along axis k; 1 along axes the lattice does not extend in.
std::int64_t cells(const GeneratorSpec& spec, int k) {
  if (k >= type_info(spec.type).axes) return 1;
  return spec.size[std::min(static_cast<std::size_t>(k), spec.size.size() - 1)];
}

/// Place of a particle in the lattice: its cell, and its site in it.
struct Place {
  std::int64_t cell[3];
  int site;
};

/// The spec with everything filled in that it leaves to be understood.
struct Plan {
  explicit Plan(const GeneratorSpec& given) : spec(given), dim(dimension(given)), total(particle_count(given)) {
    stencil = make_stencil(spec.type, shell_count(spec.type, neighbours_of(spec)));
    for (int k = 0; k < 3; ++k) {
      n[k] = cells(spec, k);
      spacing[k] = repeated(spec.spacing, k);
      origin[k] = static_cast<std::size_t>(k) < spec.origin.size() ? spec.origin[static_cast<std::size_t>(k)] : 0.0;
    }
  }

  Place place(std::int64_t row) const {
    Place p;
    p.site = static_cast<int>(row % stencil.sites);
    row /= stencil.sites;
    p.cell[0] = row % n[0];
    p.cell[1] = row / n[0] % n[1];
    p.cell[2] = row / n[0] / n[1];
    return p;
  }
  std::int64_t row(const Place& p) const { return ((p.cell[2] * n[1] + p.cell[1]) * n[0] + p.cell[0]) * stencil.sites + p.site; }
  const Site& kind(const Place& p) const { return stencil.kinds[static_cast<std::size_t>(stencil.staggered ? p.cell[1] % 2 : p.site)]; }
  /// Unperturbed position along axis k.
  double position(const Place& p, int k) const {
    return origin[k] + (static_cast<double>(p.cell[k]) * stencil.edge[k] + kind(p).shift[k]) * spacing[k];
  }
  /// The box that repeats the lattice along the periodic axes; along the others it is as large as the lattice.
  PeriodicBox repeated_box() const {
    PeriodicBox b;
    if (spec.periodic.empty()) return b;
    for (int k = 0; k < dim; ++k) {
      b.periodic[k] = spec.repeats(k);
      b.edges[static_cast<std::size_t>(k * dim + k)] = std::max<double>(static_cast<double>(n[k]) * stencil.edge[k], 1) * spacing[k];
    }
    return b;
  }
  /// Takes a place that a neighbour lies at into the lattice; `shift`: the boxes it was away. False: it is no place of it.
  bool wrap(Place* q, int* shift) const {
    for (int k = 0; k < 3; ++k) {
      shift[k] = 0;
      if (spec.repeats(k)) {
        const std::int64_t box = q->cell[k] >= 0 ? q->cell[k] / n[k] : -((n[k] - 1 - q->cell[k]) / n[k]);
        q->cell[k] -= box * n[k];
        shift[k] = static_cast<int>(box);
      } else if (q->cell[k] < 0 || q->cell[k] >= n[k]) {
        return false;
      }
    }
    return true;
  }
  double length(const Neighbour& m) const {
    double r2 = 0;
    for (int k = 0; k < 3; ++k) r2 += m.offset[k] * spacing[k] * m.offset[k] * spacing[k];
    return std::sqrt(r2);
  }
  /// The box of the unperturbed particles: a lattice one row high has no shifted row.
  Box box() const {
    Box b;
    for (int k = 0; k < dim; ++k) {
      double shift = 0;
      if (!stencil.staggered || n[1] > 1)
        for (const Site& s : stencil.kinds) shift = std::max(shift, s.shift[k]);
      b.lo[k] = origin[k];
      b.hi[k] = origin[k] + (static_cast<double>(n[k] - 1) * stencil.edge[k] + shift) * spacing[k];
    }
    return b;
  }
  /// Rows of the triangular lattice begin and end half a spacing inside the box by turns.
  double row_shift() const { return stencil.staggered ? spacing[0] / 2 : 0.0; }

  const GeneratorSpec& spec;
  int dim;
  std::int64_t total, n[3];
  double spacing[3], origin[3];
  Stencil stencil;
};

void place_particles(const Plan& plan, Lattice* out) {
  out->position.reserve(static_cast<std::size_t>(out->particles.count * plan.dim));
  for (std::int64_t i = 0; i < out->particles.count; ++i) {
    const Place p = plan.place(out->particles.first + i);
    for (int k = 0; k < plan.dim; ++k) out->position.push_back(plan.position(p, k));
  }
}

void fix_particles(const Plan& plan, Lattice* out) {
  Faces faces = 0;
  (void)parse_faces(plan.spec.fixed, type_info(plan.spec.type).axes, &faces);  // checked before
  out->fixed.assign(static_cast<std::size_t>(out->particles.count), 0);
  const Faces along_x = faces & 3u;
  apply_faces(along_x, plan.box(), plan.row_shift(), plan.dim, out->position, &out->fixed);
  apply_faces(faces & ~along_x, plan.box(), 0.0, plan.dim, out->position, &out->fixed);
  apply_fixed_particles(plan.spec.fixed_particles, out->particles, &out->fixed);
}

/// The spring of particle i with its upper neighbour j.
void add_spring(const Plan& plan, std::int64_t i, std::int64_t j, const Neighbour& m, Lattice* out) {
  const GeneratorSpec& spec = plan.spec;
  const bool stiff = spec.stiff_fraction > 0 && hash_uniform(spec.seed, Stream::stiff_springs, i, j) < spec.stiff_fraction;
  out->pairs.push_back(i);
  out->pairs.push_back(j);
  out->stiffness.push_back(repeated(spec.stiffness, m.shell) * (stiff ? spec.stiff_factor : 1.0));
  out->damping.push_back(repeated(spec.damping, m.shell));
  out->rest_length.push_back(plan.length(m) * spec.rest_length_factor);
}

/// Room for half of the neighbours of an inner particle each: untouched pages cost nothing.
void reserve_springs(const Plan& plan, Lattice* out) {
  std::size_t most = 0;
  for (const Site& kind : plan.stencil.kinds) most = std::max(most, kind.neighbours.size());
  const std::size_t springs = (static_cast<std::size_t>(out->particles.count) + 1) * (most + 1) / 2;
  out->pairs.reserve(2 * springs);
  out->stiffness.reserve(springs);
  out->damping.reserve(springs);
  out->rest_length.reserve(springs);
}

/// A neighbour at which a spring is laid: the particle, how it was reached, and the box it is in.
struct Upper {
  std::int64_t row;
  const Neighbour* way;
  int shift[3];
  /// Of the two directions of a spring one is upward: to the higher row, and among images of one particle by the way there.
  bool above(std::int64_t i) const { return row != i ? row > i : std::lexicographical_compare(std::begin(NONE), std::end(NONE), shift, shift + 3); }
  static constexpr int NONE[3] = {0, 0, 0};
};

void lay_springs(const Plan& plan, Lattice* out) {
  std::vector<Upper> upper;
  reserve_springs(plan, out);
  for (std::int64_t i = out->particles.first; i < out->particles.first + out->particles.count; ++i) {
    const Place p = plan.place(i);
    upper.clear();
    for (const Neighbour& m : plan.kind(p).neighbours) {
      Place q{{p.cell[0] + m.cell[0], p.cell[1] + m.cell[1], p.cell[2] + m.cell[2]}, m.site};
      Upper there{0, &m, {0, 0, 0}};
      if (!plan.wrap(&q, there.shift)) continue;
      there.row = plan.row(q);
      if (there.above(i)) upper.push_back(there);
    }
    std::sort(upper.begin(), upper.end(), [](const Upper& a, const Upper& b) { return std::tie(a.row, a.way) < std::tie(b.row, b.way); });
    for (const Upper& one : upper) {
      add_spring(plan, i, one.row, *one.way, out);
      for (int k = 0; k < plan.dim && out->box.active(); ++k) out->shift.push_back(one.shift[k]);
    }
  }
  out->springs.count = static_cast<std::int64_t>(out->stiffness.size());
}

/// Of the two directions along a line the one that goes up: along z, else y, else x.
bool goes_up(const Neighbour& way) {
  int k = 2;
  while (k > 0 && std::abs(way.offset[k]) < 1e-9) --k;
  return way.offset[k] > 0;
}

/// Particle i and the next two on a straight line of nearest neighbours, and the boxes that they are in; false where it ends before.
bool follow_line(const Plan& plan, std::int64_t i, const Neighbour& way, std::int64_t* ends, int* shift) {
  Place p = plan.place(i);
  const Neighbour* step = &way;
  ends[0] = i;
  std::fill_n(shift, 9, 0);
  for (int a = 1; a < 3; ++a) {
    for (int k = 0; k < 3; ++k) p.cell[k] += step->cell[k];
    p.site = step->site;
    if (!plan.wrap(&p, shift + 3 * a)) return false;
    for (int k = 0; k < 3; ++k) shift[3 * a + k] += shift[3 * (a - 1) + k];
    ends[a] = plan.row(p);
    if (a == 1 && !(step = straight_on(plan.kind(p), way))) return false;
  }
  return true;
}

/// Angle springs over particle i and the next two along each line.
void lay_angles(const Plan& plan, Lattice* out) {
  if (plan.spec.angle_stiffness == 0) return;
  out->interactions.resize(1);  // angle springs are the first kind
  InteractionRows& angles = out->interactions[0];
  for (std::int64_t i = out->particles.first; i < out->particles.first + out->particles.count; ++i)
    for (const Neighbour& way : plan.kind(plan.place(i)).neighbours) {
      std::int64_t ends[3];
      int shift[9];
      if (way.shell != 0 || !goes_up(way) || !follow_line(plan, i, way, ends, shift)) continue;
      angles.ends.insert(angles.ends.end(), ends, ends + 3);
      for (int a = 0; a < 3 && out->box.active(); ++a) angles.shift.insert(angles.shift.end(), shift + 3 * a, shift + 3 * a + plan.dim);
      angles.parameter.push_back(plan.spec.angle_stiffness);
      angles.parameter.push_back(plan.spec.rest_angle);
    }
  angles.rows.count = static_cast<std::int64_t>(angles.ends.size() / 3);
}

std::string describe(const Plan& plan) {
  const TypeInfo& info = type_info(plan.spec.type);
  std::string text = std::string(info.name) + " lattice ";
  for (int k = 0; k < info.axes; ++k) text += (k ? " x " : "") + std::to_string(plan.n[k]);
  return text + ", " + std::to_string(neighbours_of(plan.spec)) + " neighbours";
}

}  // namespace

std::int64_t particle_count(const GeneratorSpec& spec) {
  std::int64_t count = make_stencil(spec.type, 0).sites;
  for (int k = 0; k < 3; ++k) {
    if (cells(spec, k) > std::numeric_limits<std::int64_t>::max() / count) return -1;
    count *= cells(spec, k);
  }
  return count;
}

void perturb(const GeneratorSpec& spec, Lattice* lattice) {
  const std::size_t d = static_cast<std::size_t>(lattice->dim);
  if (spec.perturbation <= 0) return;
  for (std::size_t i = 0; i < lattice->fixed.size(); ++i) {
    if (lattice->fixed[i]) continue;
    const std::int64_t row = lattice->particles.first + static_cast<std::int64_t>(i);
    for (std::size_t k = 0; k < d; ++k)
      lattice->position[i * d + k] += spec.perturbation * (2 * hash_uniform(spec.seed, Stream::perturbation, row, static_cast<std::int64_t>(k)) - 1);
  }
}

Lattice generate(const GeneratorSpec& spec, int rank, int size) {
  const Plan plan(spec);
  Lattice out;
  out.dim = plan.dim;
  out.source = describe(plan);
  out.particles = split_rows(plan.total, rank, size);
  place_particles(plan, &out);
  fix_particles(plan, &out);
  choose_groups(spec.groups, plan.box(), plan.row_shift(), &out);
  fix_groups(spec.fixed_groups, &out);
  apply_velocity(spec.velocity, spec.velocity_gradient, plan.dim, out.position, out.fixed, &out.velocity);
  perturb(spec, &out);
  const std::size_t count = static_cast<std::size_t>(out.particles.count);
  out.mass.assign(count, mass_of_each(spec, plan.total));
  if (spec.radius > 0) out.particle_columns.push_back({"radius", "-bs_lattice_radius", std::vector<double>(count, spec.radius)});
  out.box = plan.repeated_box();
  lay_springs(plan, &out);
  lay_angles(plan, &out);
  return out;
}

namespace {

/// Of the cells 0 to n - 1, those whose neighbour `step` further on is one of them, or an image of one; with `parity` 0 or 1 only even or odd ones.
std::int64_t inside(const GeneratorSpec& spec, int k, std::int64_t step, int parity = -1) {
  const std::int64_t n = cells(spec, k);
  const bool periodic = spec.repeats(k);
  const std::int64_t first = periodic ? 0 : std::max<std::int64_t>(0, -step), end = periodic ? n : std::min(n, n - step);
  if (end <= first) return 0;
  if (parity < 0) return end - first;
  return (end + 1 - parity) / 2 - (first + 1 - parity) / 2;
}

}  // namespace

std::int64_t spring_count(const GeneratorSpec& spec) {
  const Stencil stencil = make_stencil(spec.type, shell_count(spec.type, neighbours_of(spec)));
  std::int64_t ends = 0;
  for (std::size_t kind = 0; kind < stencil.kinds.size(); ++kind)
    for (const Neighbour& m : stencil.kinds[kind].neighbours)
      ends += inside(spec, 0, m.cell[0]) * inside(spec, 1, m.cell[1], stencil.staggered ? static_cast<int>(kind) : -1) * inside(spec, 2, m.cell[2]);
  return ends / 2;
}

}  // namespace bs
