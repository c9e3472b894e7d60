// The condensed matrix: its own storage against PETSc's, block by block; incomplete factors that must be exact.
#include "condensed_case.hpp"
#include "model/particles/condensed/block_icc.hpp"

using namespace bs;

TEST_CASE("S multiplies alike in every storage") {
  for (const int d : {1, 2, 3}) {
    GeneratorSpec spec = d == 1 ? lattice(LatticeType::chain, {17}, 1) : d == 2 ? lattice(LatticeType::square, {7, 6}, 2) : lattice(LatticeType::cubic, {4, 5, 4}, 3);
    spec.neighbors = d == 1 ? 0 : d == 2 ? 8 : 18;
    spec.fixed_particles = {0, 3};
    Case c(PETSC_COMM_WORLD, spec, 40.0);
    MatHandle own;
    REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
    VecHandle p, expected, found;
    REQUIRE(SpringMatrix::from(own)->create_vector(p.out()) == 0);
    REQUIRE(VecDuplicate(p, expected.out()) == 0);
    REQUIRE(VecDuplicate(p, found.out()) == 0);
    fill(c.net, p);
    for (const bool positive : {false, true}) {
      REQUIRE(c.tangent.assemble(positive, own) == 0);
      REQUIRE(MatMult(own, p, expected) == 0);
      for (const CondensedStorage storage : {CondensedStorage::sbaij, CondensedStorage::baij, CondensedStorage::aij}) {
        MatHandle S;
        REQUIRE(c.tangent.create(storage, S.out()) == 0);
        REQUIRE(c.tangent.assemble(positive, S) == 0);
        REQUIRE(MatMult(S, p, found) == 0);
        CHECK(relative_difference(found, expected) < 3e-7);  // four numbers a spring, in single precision
      }
    }
  }
}

TEST_CASE("S is what J leaves when positions are eliminated") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {3, 4, 3}, 3);
  spec.neighbors = 18;
  Case c(PETSC_COMM_WORLD, spec, 25.0);
  const PetscInt d = 3;
  MatHandle S;
  VecHandle w, b, z, r, Sw;
  REQUIRE(c.tangent.create(CondensedStorage::aij, S.out()) == 0);
  REQUIRE(c.tangent.assemble(false, S) == 0);
  REQUIRE(MatCreateVecs(S, w.out(), b.out()) == 0);
  REQUIRE(VecDuplicate(b, Sw.out()) == 0);
  REQUIRE(VecDuplicate(c.y, z.out()) == 0);
  REQUIRE(VecDuplicate(c.y, r.out()) == 0);
  // for any z: r = J z, then S (sigma z_x) must be the condensed right-hand side of r
  REQUIRE(c.tangent.multiply(c.y, r) == 0);
  REQUIRE(c.tangent.condense(r, b) == 0);
  const PetscScalar* ay = nullptr;
  PetscScalar* aw = nullptr;
  REQUIRE(VecGetArrayRead(c.y, &ay) == 0);
  REQUIRE(VecGetArray(w, &aw) == 0);
  for (PetscInt i = 0; i < c.net.n; ++i)
    for (PetscInt k = 0; k < d; ++k) aw[i * d + k] = 25.0 * ay[i * 2 * d + k];
  REQUIRE(VecRestoreArray(w, &aw) == 0);
  REQUIRE(VecRestoreArrayRead(c.y, &ay) == 0);
  REQUIRE(MatMult(S, w, Sw) == 0);
  CHECK(relative_difference(Sw, b) < 1e-13);
  REQUIRE(c.tangent.expand(r, w, z) == 0);
  CHECK(relative_difference(z, c.y) < 1e-13);
}

TEST_CASE("incomplete factors of a chain are complete") {
  for (const int d : {1, 2, 3})
    for (const bool single : {false, true}) {
      Case c(PETSC_COMM_SELF, lattice(LatticeType::chain, {23}, d), 30.0);
      MatHandle S;
      REQUIRE(c.tangent.create(CondensedStorage::springs, S.out()) == 0);
      REQUIRE(c.tangent.assemble(true, S) == 0);
      auto factor = create_block_factor(d, single);
      std::vector<double> diagonal;
      SpringMatrix::from(S)->diagonal_blocks(&diagonal);
      REQUIRE(factor->factor(*SpringMatrix::from(S), diagonal, 0.0));
      VecHandle x, b;
      REQUIRE(SpringMatrix::from(S)->create_vector(x.out()) == 0);
      REQUIRE(VecDuplicate(x, b.out()) == 0);
      fill(c.net, x);
      REQUIRE(MatMult(S, x, b) == 0);
      std::vector<double> z(static_cast<std::size_t>(c.net.n * d));
      const PetscScalar *ab = nullptr, *ax = nullptr;
      REQUIRE(VecGetArrayRead(b, &ab) == 0);
      factor->solve(ab, z.data());
      REQUIRE(VecRestoreArrayRead(b, &ab) == 0);
      REQUIRE(VecGetArrayRead(x, &ax) == 0);
      double worst = 0;
      for (std::size_t k = 0; k < z.size(); ++k) worst = std::max(worst, std::abs(z[k] - ax[k]));
      REQUIRE(VecRestoreArrayRead(x, &ax) == 0);
      CHECK(worst < (single ? 1e-4 : 1e-11));
      CHECK(worst > (single ? 1e-12 : -1.0));  // single precision leaves its mark
    }
}
