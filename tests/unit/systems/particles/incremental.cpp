// The incremental potential Phi that the energy search goes by: its slope, its changes and what lacks it, against the energies
// the program shows and dissipation potentials written out here.
#include <catch2/catch.hpp>
#include <cmath>
#include <tuple>
#include <vector>

#include "input/remote.hpp"
#include "lattice/generator.hpp"
#include "physics/pair/springs/registry.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/terms.hpp"

using namespace bs;

namespace {

enum class Dampers { none, simple, axial };

constexpr SpringLaw POLYNOMIAL{3}, EVERY{-1};  ///< EVERY: all laws in turn, spring by spring

/// What the laws take and carry, different for each spring.
void give_columns(Lattice* l) {
  const auto column = [&](const char* name, auto&& value) {
    l->spring_columns.push_back({name, name, {}});
    for (std::int64_t k = 0; k < l->springs.count; ++k) l->spring_columns.back().value.push_back(value(l->springs.first + k));
  };
  column("stiffness_2", [](std::int64_t row) { return 40 * std::sin(2.0 * static_cast<double>(row)); });
  column("stiffness_3", [](std::int64_t row) { return 60 * std::cos(3.0 * static_cast<double>(row)); });
  column("yield_force", [](std::int64_t row) { return 3 + static_cast<double>(row % 4); });
  column("hardening", [](std::int64_t row) { return 4 * static_cast<double>(row % 3); });
  column("relaxation_time", [](std::int64_t row) { return 0.1 + 0.2 * static_cast<double>(row % 3); });
  column("viscous_stretch", [](std::int64_t row) { return 0.1 * std::cos(7.0 * static_cast<double>(row)); });
  column("plastic_stretch", [](std::int64_t row) { return 0.1 * std::sin(5.0 * static_cast<double>(row)); });
}

/// The drag coefficient of each particle.
double drag_of(std::int64_t row) { return 0.3 * static_cast<double>(row % 5); }

/// A lattice with every third spring without rest length, every fifth damped, four anchors that move, and every law that has
/// a potential; two particles are fixed.
struct Case {
  Network net;
  ParticleLaws laws;
  Constraints constraints;
  RowPattern pattern;
  std::unique_ptr<Terms> terms;
  ParticlePotential potential;
  VecHandle y, z;
  double sigma = 20, t = 0.3;

  Case(int d, SpringLaw law, Dampers dampers, bool all_laws, double stiffness = 60) {
    int rank, size;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &size);
    GeneratorSpec spec;
    spec.type = d == 1 ? LatticeType::chain : d == 2 ? LatticeType::square : LatticeType::cubic;
    spec.size = d == 1 ? std::vector<std::int64_t>{19} : d == 2 ? std::vector<std::int64_t>{5, 6} : std::vector<std::int64_t>{3, 4, 3};
    spec.dim = d;
    spec.particle_mass = 0.5;
    spec.stiffness = {stiffness, 0.6 * stiffness, 0.4 * stiffness};
    spec.fixed_particles = {0, 4};
    Lattice lattice = generate(spec, rank, size);
    REQUIRE(number_rows(PETSC_COMM_WORLD, &lattice.springs) == 0);
    lattice.particle_columns.push_back({"drag", "", {}});
    for (std::int64_t k = 0; k < lattice.particles.count; ++k) lattice.particle_columns.back().value.push_back(drag_of(lattice.particles.first + k));
    lattice.spring_law = law == EVERY ? SpringLaw::hooke : law;
    if (law == EVERY || law == POLYNOMIAL) give_columns(&lattice);
    lattice.law_by_row = law == EVERY;
    for (std::int64_t k = 0; law == EVERY && k < lattice.springs.count; ++k)
      lattice.spring_laws.push_back(static_cast<std::uint8_t>((lattice.springs.first + k) % static_cast<std::int64_t>(spring_laws().size())));
    lattice.damping_law = dampers == Dampers::axial ? DampingLaw::axial : DampingLaw::simple;
    for (std::int64_t k = 0; k < lattice.springs.count; ++k) {
      const std::int64_t row = lattice.springs.first + k;
      if (all_laws && row % 3 == 0) lattice.rest_length[static_cast<std::size_t>(k)] = 0;
      if (row % 5 == 0) lattice.damping[static_cast<std::size_t>(k)] = dampers == Dampers::none ? 0 : 3;
    }
    if (all_laws) add_anchors(d, split_rows(4, rank, size), dampers, &lattice);
    if (all_laws) set_laws();
    NetworkOptions options;
    options.partition = 1;
    REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
    net.links.history_time = t;  // no time has passed: what relaxes stores what it answers with
    REQUIRE(constraints.create(&net) == 0);
    terms = std::make_unique<Terms>(net, laws, constraints.anchors(), pattern);
    for (VecHandle* vec : {&y, &z}) {
      REQUIRE(VecCreateMPI(PETSC_COMM_WORLD, net.n * 2 * d, PETSC_DETERMINE, vec->out()) == 0);
      REQUIRE(VecSetBlockSize(*vec, 2 * d) == 0);
    }
    REQUIRE(potential.create(net, *terms, y, false) == 0);
  }

  static void add_anchors(int d, Rows rows, Dampers dampers, Lattice* lattice) {
    lattice->anchors = rows;
    for (std::int64_t k = rows.first; k < rows.first + rows.count; ++k) {
      lattice->anchor_particle.push_back(2 + 3 * k);
      for (int c = 0; c < d; ++c) lattice->anchor_point.push_back(0.4 + 0.3 * static_cast<double>(k) - 0.7 * c);
      lattice->anchor_stiffness.push_back(25);
      lattice->anchor_rest_length.push_back(k == 1 ? 0.0 : 0.8);
      lattice->anchor_damping.push_back(dampers == Dampers::none ? 0 : 2);
    }
  }

  void set_laws() {
    UniformGravity& gravity = std::get<UniformGravity>(laws);
    gravity.g[0] = -9.81;
    std::vector<CentralGravity>& central = std::get<Several<CentralGravity>>(laws).all;
    central.resize(2);
    for (CentralGravity& mass : central) mass.G = 1, mass.M0 = 30;
    for (double& c : central[0].x0) c = -4;
    for (double& c : central[1].x0) c = 50;
    std::get<StokesDrag>(laws).D = 1.7;
    std::get<MassDrag>(laws).c = 0.9;
    std::get<ParticleDrag>(laws).given = true;
    ShapeDrag& shape = std::get<ShapeDrag>(laws);
    shape.drag_coefficient = 0.5;
    shape.rho = 1.2;
    shape.area = 0.8;
    shape.fluid[0] = 0.4;
    XspAttraction& pull = std::get<XspAttraction>(laws);
    pull.value = 2;
    pull.exponent = 1.5;
    for (double& c : pull.center) c = 9;
    XspWalls& walls = std::get<XspWalls>(laws);
    walls.value = 5;
    walls.exponent = 2;
    const double box[4] = {-6, 40, -7, 30};
    std::copy_n(box, 4, walls.box);
    for (bool& side : walls.sides) side = true;
    Motion& motion = constraints.anchors();
    motion.kind = Motion::Kind::sinusoid;
    motion.frequency = 0.5;
    for (double& c : motion.A) c = 0.3;
    std::string error;
    REQUIRE(motion.drive.parse(motion.text(net.dim), net.dim, &error));
  }

  /// State, direction: z_x = z_v/sigma, zero at fixed particles. `way` picks one of many.
  void set(int way, double size) {
    const int d = net.dim;
    PetscScalar *ay = nullptr, *az = nullptr;
    REQUIRE(VecGetArray(y, &ay) == 0);
    REQUIRE(VecGetArray(z, &az) == 0);
    for (PetscInt i = 0; i < net.n; ++i)
      for (int c = 0; c < d; ++c) {
        const double row = static_cast<double>(net.row[i]) + 0.37 * way;
        const PetscInt x = i * 2 * d + c;
        ay[x] = net.held[i * d + c] + (net.fixed[i] ? 0 : 0.3 * std::sin(1.7 * row + c));
        ay[x + d] = net.fixed[i] ? 0 : 2 * std::cos(0.9 * row - c);
        az[x + d] = net.fixed[i] ? 0 : size * std::sin(2.3 * row + 1.1 * c + way);
        az[x] = az[x + d] / sigma;
      }
    REQUIRE(VecRestoreArray(z, &az) == 0);
    REQUIRE(VecRestoreArray(y, &ay) == 0);
  }

  double sum(double value) const {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return value;
  }

  /// b of Phi's b.v, any constant will do.
  static double constant(std::int64_t row, int c) { return 3 * std::cos(1.3 * static_cast<double>(row) + c); }

  /// Phi at y + lambda z from the observable energies and the dissipation potentials of dampers and drag; axial dampers act
  /// along the directions their ends have at y.
  double phi(double lambda) {
    const int d = net.dim;
    VecHandle at;
    REQUIRE(VecDuplicate(y, at.out()) == 0);
    REQUIRE(VecWAXPY(at, lambda, z, y) == 0);
    LocalState state, base;
    REQUIRE(state.create(net, y) == 0);
    REQUIRE(state.gather(0.0, at) == 0);
    REQUIRE(base.create(net, y) == 0);
    REQUIRE(base.gather(0.0, y) == 0);
    Energies e = terms->energies(t, state);
    // what yielding springs lose on the way from their last history belongs to the potential; half from either end
    for (PetscInt i = 0; i < net.n && net.mixed; ++i)
      for (PetscInt k = net.links.start[i]; k < net.links.start[i + 1]; ++k) {
        double square = 0;
        for (int c = 0; c < d; ++c) square += std::pow(state.at(i)[c] - state.at(net.links.other[k])[c], 2);
        const double* p = net.links.more.data() + static_cast<std::size_t>(k) * static_cast<std::size_t>(net.links.width);
        if (net.links.law[k] == 4 && net.links.rest_length[k] > 0)
          e.elastic += 0.5 * p[0] * std::abs(PlasticSpring::flow(std::sqrt(square), net.links.stiffness[k], net.links.rest_length[k], p));
      }
    double total = sigma * (e.kinetic + e.elastic + e.field);
    for (PetscInt i = 0; i < net.n; ++i) {
      const double* v = state.at(i) + d;
      for (PetscInt k = net.links.start[i]; k < net.links.start[i + 1]; ++k)
        total += 0.5 * damper(net.links, k, v, state.at(net.links.other[k]) + d, base.at(i), base.at(net.links.other[k]));
      if (net.fixed[i]) continue;
      double own = 0, relative = 0;
      const ShapeDrag& shape = std::get<ShapeDrag>(laws);
      for (int c = 0; c < d; ++c) {
        total += constant(net.row[i], c) * v[c];
        own += v[c] * v[c];
        relative += (v[c] - shape.fluid[c]) * (v[c] - shape.fluid[c]);
      }
      total +=
          0.5 *
          (std::get<StokesDrag>(laws).D + std::get<MassDrag>(laws).c * net.mass[i] + (std::get<ParticleDrag>(laws).given ? drag_of(net.row[i]) : 0)) *
          own;
      total += shape.rho * shape.area * shape.drag_coefficient * std::pow(relative, 1.5) / 6;
    }
    double rate[3] = {}, shift[3] = {}, end[3] = {};
    constraints.anchors().at(t, shift, rate);
    for (std::size_t k = 0; k < net.anchors.particle.size(); ++k) {
      for (int c = 0; c < d; ++c) end[c] = net.anchors.point[k * 3 + static_cast<std::size_t>(c)] + shift[c];
      const PetscInt i = net.anchors.particle[k];
      total += damper(net.anchors, static_cast<PetscInt>(k), state.at(i) + d, rate, base.at(i), end);
    }
    return sum(total);
  }

  template <class Table>
  double damper(const Table& table, PetscInt k, const double* v, const double* other, const double* x, const double* end) const {
    double square = 0, along = 0, length = 0;
    for (int c = 0; c < std::min(net.dim, 3); ++c) {
      square += (v[c] - other[c]) * (v[c] - other[c]);
      along += (v[c] - other[c]) * (x[c] - end[c]);
      length += (x[c] - end[c]) * (x[c] - end[c]);
    }
    if (net.damping_law == DampingLaw::axial) square = along * along / length;
    return table.damping.empty() ? 0 : 0.5 * table.damping[static_cast<std::size_t>(k)] * square;
  }

  /// g.dv, g = sigma M v - f + b the condensed momentum residual.
  double slope() {
    const int d = net.dim;
    LocalState state, line;
    Singularity fault;
    std::vector<double> f(static_cast<std::size_t>(net.n * d));
    REQUIRE(state.create(net, y) == 0);
    REQUIRE(line.create(net, y) == 0);
    REQUIRE(state.gather(0.0, y) == 0);
    REQUIRE(line.gather_direction(z) == 0);
    for (const Part part : {Part::interior, Part::boundary}) terms->forces(part, t, state, f.data(), &fault);
    CHECK(fault.kind == Singularity::none);
    double total = 0;
    for (PetscInt i = 0; i < net.n; ++i)
      for (int c = 0; c < d && !net.fixed[i]; ++c)
        total += (sigma * net.mass[i] * state.at(i)[d + c] - f[static_cast<std::size_t>(i * d + c)] + constant(net.row[i], c)) * line.at(i)[d + c];
    return sum(total);
  }

  double beyond(double lambda) {
    PotentialChange change;
    REQUIRE(potential.beyond_slope(t, sigma, lambda, &change) == 0);
    return change.value;
  }
};

}  // namespace

TEST_CASE("g.dv is the slope of the incremental potential") {
  for (const int d : {1, 2, 3})
    for (const SpringLaw law : {SpringLaw::hooke, SpringLaw::strain, POLYNOMIAL})
      for (const Dampers dampers : {Dampers::none, Dampers::simple, Dampers::axial}) {
        Case c(d, law, dampers, true);
        CHECK(c.potential.lacks_potential().empty());
        for (int way = 0; way < 8; ++way) {
          c.set(way, 1.0);
          const double h = 1e-3;
          // two central differences of Phi: their error falls as h^4
          const double wide = (c.phi(2 * h) - c.phi(-2 * h)) / (4 * h), narrow = (c.phi(h) - c.phi(-h)) / (2 * h);
          const double slope = c.slope(), scale = std::abs(slope) + 1;
          CHECK(std::abs((4 * narrow - wide) / 3 - slope) < 3e-8 * scale);
        }
      }
}

TEST_CASE("the change beyond the slope is that of the energies") {
  for (const int d : {1, 2, 3})
    for (const auto& [dampers, law] :
         {std::pair{Dampers::simple, SpringLaw::hooke}, {Dampers::axial, SpringLaw::strain}, {Dampers::simple, EVERY}, {Dampers::axial, EVERY}}) {
      Case c(d, law, dampers, true);
      for (int way = 0; way < 4; ++way) {
        c.set(way, 4.0);
        REQUIRE(c.potential.follow(c.y, c.z) == 0);
        const double start = c.phi(0), slope = c.slope();
        for (const double lambda : {1.0, 0.37, -0.6, 2.5}) {
          const double change = c.phi(lambda) - start - lambda * slope;
          CHECK(std::abs(c.beyond(lambda) - change) < 1e-11 * (std::abs(start) + std::abs(lambda * slope) + std::abs(change)));
        }
      }
    }
}

TEST_CASE("forces and energies of one pass are those of two") {
  for (const int d : {1, 2, 3})
    for (const auto& [dampers, law, all_laws] : {std::tuple{Dampers::none, SpringLaw::hooke, false},
                                                 {Dampers::none, SpringLaw::strain, false},
                                                 {Dampers::axial, SpringLaw::strain, true},
                                                 {Dampers::simple, EVERY, true}}) {
      Case c(d, law, dampers, all_laws);
      c.set(1, 4.0);
      LocalState state;
      Singularity fault;
      REQUIRE(state.create(c.net, c.y) == 0);
      REQUIRE(state.gather(c.t, c.y) == 0);
      std::vector<double> alone(static_cast<std::size_t>(c.net.n * d)), together(alone.size());
      Energies sum;
      for (const Part part : {Part::interior, Part::boundary}) {
        c.terms->forces(part, c.t, state, alone.data(), &fault);
        c.terms->forces(part, c.t, state, together.data(), &fault, &sum);
      }
      CHECK(fault.kind == Singularity::none);
      CHECK(alone == together);
      const Energies energies = c.terms->energies(c.t, state);
      CHECK(sum.elastic == energies.elastic);
      CHECK(sum.kinetic == energies.kinetic);
      CHECK(sum.field == energies.field);
      if (all_laws) continue;
      // by the formulas: K (l - L)^2/(2 L) or k (l - L)^2/2, half a spring from either end
      double elastic = 0, momentum[3] = {0, 0, 0};
      for (PetscInt i = 0; i < c.net.n; ++i) {
        for (PetscInt e = c.net.links.start[i]; e < c.net.links.start[i + 1]; ++e) {
          double square = 0;
          for (int k = 0; k < d; ++k) square += std::pow(state.at(i)[k] - state.at(c.net.links.other[e])[k], 2);
          const double L = c.net.links.rest_length[e], rate = law == SpringLaw::strain ? c.net.links.stiffness[e] / L : c.net.links.stiffness[e];
          elastic += 0.25 * rate * std::pow(std::sqrt(square) - L, 2);
        }
        for (int k = 0; k < d && !c.net.fixed[i]; ++k) momentum[k] += c.net.mass[i] * state.at(i)[d + k];
      }
      CHECK(sum.elastic == Approx(elastic).epsilon(1e-13));
      for (int k = 0; k < 3; ++k) CHECK(sum.momentum[k] == Approx(momentum[k]).epsilon(1e-13).margin(1e-13));
    }
}

TEST_CASE("small changes keep their digits however stiff the springs") {
  Case c(3, SpringLaw::hooke, Dampers::simple, false, 1e12);
  c.set(1, 1.0);
  REQUIRE(c.potential.follow(c.y, c.z) == 0);
  // Phi is 1e13 here, and its rounding 1e-3; beyond the slope it changes by lambda^2 q (1 + O(lambda))
  const double q = c.beyond(1e-5) / 1e-10;
  for (const double lambda : {1e-7, 1e-9, 1e-11}) CHECK(c.beyond(lambda) / (lambda * lambda * q) == Approx(1).epsilon(1e-4));
}

TEST_CASE("what has no potential is named, on every rank") {
  Case still(2, SpringLaw::hooke, Dampers::none, false);
  CHECK(still.potential.lacks_potential().empty());
  Case sphere(2, SpringLaw::hooke, Dampers::none, false);
  std::get<SphereDrag>(sphere.laws).on = true;
  REQUIRE(sphere.potential.create(sphere.net, *sphere.terms, sphere.y, false) == 0);
  CHECK(sphere.potential.lacks_potential() == "sphere drag");
  REQUIRE(still.potential.create(still.net, *still.terms, still.y, true) == 0);
  CHECK(still.potential.lacks_potential() == "a force that couples all particles");
}

// Both copies of a spring, also where a rank boundary cuts it, keep one history in every bit.
TEST_CASE("both ends of a spring commit the same history, on any ranks") {
  for (const int d : {1, 2, 3}) {
    Case c(d, EVERY, Dampers::simple, true);
    LocalState state;
    REQUIRE(state.create(c.net, c.y) == 0);
    double moved = 0;
    for (int way = 0; way < 12; ++way) {
      c.set(way, 1.0);
      REQUIRE(state.gather(0.0, c.y) == 0);
      c.terms->pairs().commit(state, 0.05, &c.net.links);
    }
    const Links& links = c.net.links;
    const std::size_t width = static_cast<std::size_t>(links.width), springs = static_cast<std::size_t>(c.net.springs_total);
    // the sum and the difference of the bits of both copies, spring by spring
    std::vector<double> low(springs * width, INFINITY), high(springs * width, -INFINITY);
    for (std::size_t e = 0; e < links.spring.size(); ++e)
      for (std::size_t k = 0; k < width; ++k) {
        const std::size_t at = static_cast<std::size_t>(links.spring[e]) * width + k;
        low[at] = std::min(low[at], links.more[e * width + k]);
        high[at] = std::max(high[at], links.more[e * width + k]);
        if (links.law[e] == 4 && k == PlasticSpring::PATH) moved += links.more[e * width + k];
      }
    MPI_Allreduce(MPI_IN_PLACE, low.data(), static_cast<int>(low.size()), MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD);
    MPI_Allreduce(MPI_IN_PLACE, high.data(), static_cast<int>(high.size()), MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    CHECK(low == high);
    CHECK(c.sum(moved) > 0.5);
  }
}
