// The loops over interactions of several ends: products, storages, energies.
#include <algorithm>
#include "condensed_case.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/particles/terms.hpp"

using namespace bs;

namespace {

GeneratorSpec with_angles(LatticeType type, std::vector<std::int64_t> size, int dim, double stiffness) {
  GeneratorSpec spec = lattice(type, std::move(size), dim);
  spec.angle_stiffness = stiffness;
  spec.fixed_particles = {0, 3};
  return spec;
}

}  // namespace

TEST_CASE("S of a lattice with angle springs multiplies alike in every storage") {
  for (const int d : {2, 3}) {
    for (const bool chain : {true, false}) {
      Case c(PETSC_COMM_WORLD,
             with_angles(chain    ? LatticeType::chain
                         : d == 2 ? LatticeType::square
                                  : LatticeType::cloth,
                         chain ? std::vector<std::int64_t>{19} : std::vector<std::int64_t>{6, 7}, d, 8.0),
             40.0);
      REQUIRE(c.net.interactions.size() == interaction_schemas().size());
      MatHandle own;
      REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
      VecHandle p, expected, found;
      REQUIRE(PairMatrix::from(own)->create_vector(p.out()) == 0);
      REQUIRE(VecDuplicate(p, expected.out()) == 0);
      REQUIRE(VecDuplicate(p, found.out()) == 0);
      fill(c.net, p);
      for (const bool positive : {false, true}) {
        REQUIRE(c.tangent.assemble(positive, own) == 0);
        if (positive) REQUIRE(MatMult(own, p, expected) == 0);
        else REQUIRE(c.tangent.multiply_condensed(p, expected) == 0);
        for (const CondensedStorage storage : {CondensedStorage::springs, CondensedStorage::sbaij, CondensedStorage::baij, CondensedStorage::aij}) {
          MatHandle S;
          REQUIRE(c.tangent.create(storage, S.out()) == 0);
          REQUIRE(c.tangent.assemble(positive, S) == 0);
          REQUIRE(MatMult(S, p, found) == 0);
          CHECK(relative_difference(found, expected) < (positive || storage == CondensedStorage::springs ? 3e-7 : 1e-13));
        }
      }
      // the diagonal that preconditioners see
      VecHandle diagonal, whole;
      MatHandle S;
      REQUIRE(VecDuplicate(p, diagonal.out()) == 0);
      REQUIRE(VecDuplicate(p, whole.out()) == 0);
      REQUIRE(c.tangent.create(CondensedStorage::aij, S.out()) == 0);
      REQUIRE(c.tangent.assemble(true, S) == 0);
      REQUIRE(MatGetDiagonal(S, whole) == 0);
      REQUIRE(MatGetDiagonal(own, diagonal) == 0);
      CHECK(relative_difference(diagonal, whole) < 3e-7);
    }
  }
}

TEST_CASE("Phi of a lattice with angle springs changes as its energies do") {
  for (const int d : {2, 3}) {
    Case c(PETSC_COMM_WORLD, with_angles(LatticeType::cloth, {5, 6}, d == 2 ? 3 : d, 8.0), 40.0);
    REQUIRE(c.net.interactions.size() == interaction_schemas().size());
    const PetscInt dim = c.net.dim;
    ParticlePotential potential;
    LocalState state;
    VecHandle z, there;
    REQUIRE(potential.create(c.net, *c.terms, c.y, false) == 0);
    REQUIRE(state.create(c.net, c.y) == 0);
    CHECK(potential.lacks_potential().empty());
    REQUIRE(VecDuplicate(c.y, z.out()) == 0);
    REQUIRE(VecDuplicate(c.y, there.out()) == 0);
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArray(z, &a) == 0);
    for (PetscInt i = 0; i < c.net.n; ++i)
      for (PetscInt k = 0; k < dim; ++k) {
        a[i * 2 * dim + k] = c.net.fixed[i] ? 0 : std::sin(3.3 * static_cast<double>(c.net.row[i]) + static_cast<double>(k));
        a[i * 2 * dim + dim + k] = 40 * a[i * 2 * dim + k];
      }
    REQUIRE(VecRestoreArray(z, &a) == 0);
    // elastic energies at x, and at x + lambda z; the slope is the force's
    const auto elastic = [&](Vec y) {
      REQUIRE(state.gather(0.0, y) == 0);
      double sum = c.terms->energies(0, state).elastic;
      MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
      return sum;
    };
    const double lambda = 0.02, before = elastic(c.y);
    std::vector<double> f(static_cast<std::size_t>(c.net.n * dim));
    Singularity fault;
    REQUIRE(state.gather(0.0, c.y) == 0);
    for (const Part part : {Part::interior, Part::boundary}) c.terms->forces(part, 0, state, f.data(), &fault);
    CHECK(fault.kind == Singularity::none);
    double slope = 0, kinetic = 0;
    const PetscScalar* az = nullptr;
    REQUIRE(VecGetArrayRead(z, &az) == 0);
    for (PetscInt i = 0; i < c.net.n; ++i)
      for (PetscInt k = 0; k < dim; ++k) {
        slope -= f[i * dim + k] * az[i * 2 * dim + k];
        kinetic += c.net.fixed[i] ? 0 : 0.5 * c.net.mass[i] * az[i * 2 * dim + dim + k] * az[i * 2 * dim + dim + k];
      }
    REQUIRE(VecRestoreArrayRead(z, &az) == 0);
    double sums[2] = {slope, kinetic};
    MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    REQUIRE(VecWAXPY(there, lambda, z, c.y) == 0);
    const double expected = 40 * (elastic(there) - before - lambda * sums[0] + lambda * lambda * sums[1]);
    PotentialChange change;
    REQUIRE(potential.follow(c.y, z) == 0);
    REQUIRE(potential.beyond_slope(0, 40, lambda, &change) == 0);
    CHECK(change.value == Approx(expected).epsilon(1e-11));
  }
}
