// Given forces of a lattice and of groups, as a term beside springs: in time and as dead loads of an equilibrium.
#include "systems/particles/nodal_forces.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include "base/handle.hpp"
#include "lattice/generator.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/terms.hpp"

using namespace bs;

namespace {

constexpr int d = 3;
constexpr double GIVEN = 0.25;  // of /particles/force, times the row

/// A cube whose particles of even rows are the group some, with a force on each third particle.
Lattice loaded() {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  GeneratorSpec spec;
  spec.type = LatticeType::cubic;
  spec.size = {3, 3, 3};
  spec.stiffness = {100, 60, 40};
  spec.fixed_particles = {0, 6};
  Lattice l = generate(spec, rank, size);
  Group group{"some", {}};
  Column force{"force", "", {}};
  for (std::int64_t k = 0; k < l.particles.count; ++k) {
    const std::int64_t row = l.particles.first + k;
    group.member.push_back(row % 2 == 0);
    for (int c = 0; c < d; ++c) force.value.push_back(row % 3 == 0 && c == 1 ? GIVEN * static_cast<double>(row) : 0.0);
  }
  l.groups = {group};
  l.particle_columns = {force};
  return l;
}

/// What acts on a particle of that row which starts at x = x0; s multiplies numbers, t is that of the expression.
double expected(std::int64_t row, int c, double x0, double s, double t) {
  const double own = row % 3 == 0 && c == 1 ? GIVEN * static_cast<double>(row) : 0.0;
  if (row % 2) return s * own;
  return s * (own + (c == 0 ? 14.0 / 14 : 0.0)) + (c == 2 ? (2 * t + x0) / 14 : 0.0);
}

}  // namespace

TEST_CASE("given forces act as the lattice and the options say, in time and as dead loads") {
  Lattice lattice = loaded();
  NodalForces forces;
  Network net;
  ParticleLaws laws;
  Constraints constraints;
  RowPattern pattern;
  VecHandle y;
  LocalState state;
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_force_some", "14, 0, expression:2*t+x0, total") == 0);
  REQUIRE(forces.read(PETSC_COMM_WORLD, lattice) == 0);
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_force_some") == 0);
  REQUIRE(build_network(PETSC_COMM_WORLD, lattice, {}, &net) == 0);
  REQUIRE(constraints.create(&net) == 0);
  REQUIRE(forces.create(net) == 0);
  REQUIRE(forces.active());
  REQUIRE(forces.varies());
  REQUIRE(VecCreateMPI(PETSC_COMM_WORLD, net.n * 2 * d, PETSC_DETERMINE, y.out()) == 0);
  REQUIRE(VecSetBlockSize(y, 2 * d) == 0);
  PetscScalar* a = nullptr;
  const auto u = [&](PetscInt i, int c) { return 0.05 * std::sin(1.7 * static_cast<double>(net.row[static_cast<std::size_t>(i)]) + c); };
  REQUIRE(VecGetArray(y, &a) == 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < d; ++c) {
      a[i * 2 * d + c] = net.held[static_cast<std::size_t>(i * d + c)] + (net.fixed[static_cast<std::size_t>(i)] ? 0 : u(i, c));
      a[i * 2 * d + d + c] = 0.3 * c;
    }
  REQUIRE(VecRestoreArray(y, &a) == 0);
  REQUIRE(state.create(net, y) == 0);
  Terms without(net, laws, constraints.anchors(), pattern), with(net, laws, constraints.anchors(), pattern);
  with.add(forces);
  const std::size_t size = static_cast<std::size_t>(net.n) * d;
  std::vector<PetscInt> all(static_cast<std::size_t>(net.n));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<PetscInt>(i);

  struct Way {
    bool still;
    double t, s, at;  ///< time asked for; what multiplies numbers, and the time of the expression
  };
  for (const Way& way : {Way{false, 0.6, 1, 0.6}, Way{true, 0.6, 0.6, 0.6}}) {
    if (way.still) forces.set_static(way.t, true);
    REQUIRE(state.gather(way.t, y) == 0);
    std::vector<double> f(size), g(size), on(size), on_without(size);
    Singularity fault;
    Energies sum, before;
    for (const Part part : {Part::interior, Part::boundary}) {
      with.forces(part, way.t, state, f.data(), &fault, &sum);
      without.forces(part, way.t, state, g.data(), &fault, &before);
    }
    for (const Term* term : with) term->forces_on(all, way.t, state, on.data());
    for (const Term* term : without) term->forces_on(all, way.t, state, on_without.data());
    double worst = 0, potential = 0;
    for (PetscInt i = 0; i < net.n; ++i)
      for (int c = 0; c < d; ++c) {
        const std::size_t k = static_cast<std::size_t>(i * d + c), at = static_cast<std::size_t>(i);
        const double x0 = net.held[at * d], one = expected(net.row[at], c, x0, way.s, way.at);
        worst = std::max(worst, std::abs(f[k] - g[k] - (net.fixed[at] ? 0 : one)));
        worst = std::max(worst, std::abs(on[k] - on_without[k] - one));  // held ones bear it, too
        if (!net.fixed[at]) potential -= (way.still || c != 2 ? one : 0) * u(i, c);
      }
    CHECK(worst < 1e-13);
    CHECK(sum.field - before.field == Approx(potential).margin(1e-13));
    CHECK(sum.field == with.energies(way.t, state).field);
    double f1[d];
    for (std::size_t k = 0; k < forces.loaded().size(); ++k) {
      forces.varying(k, way.t, f1);
      CHECK(f1[0] == 0);
      CHECK((f1[2] == 0) == (way.still || net.row[static_cast<std::size_t>(forces.loaded()[k])] % 2 != 0));
    }
  }
  // loads that do not grow are in full, whatever the load factor
  forces.set_static(0.2, false);
  CHECK_FALSE(forces.grows());
  for (std::size_t k = 0; k < forces.loaded().size(); ++k) {
    double f[d];
    const std::size_t i = static_cast<std::size_t>(forces.loaded()[k]);
    forces.force(k, 0.2, f);
    for (int c = 0; c < d; ++c) CHECK(f[c] == Approx(expected(net.row[i], c, net.held[i * d], 1, 1)).margin(1e-14));
  }
}
