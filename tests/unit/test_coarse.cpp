// The coarse grid of the condensed solve: what its hats can represent it must solve exactly, whatever S is.
#include "condensed_case.hpp"
#include "systems/particles/condensed/block_icc.hpp"
#include "systems/particles/condensed/coarse_space.hpp"

using namespace bs;

namespace {

/// Displacements linear in where the particles started (or where `centre` of two tied ones is): the hats hold them.
void linear(const Network& net, const std::vector<double>& points, Vec v) {
  PetscScalar* a = nullptr;
  const int d = net.dim;
  REQUIRE(VecGetArrayWrite(v, &a) == 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < d; ++c) {
      double u = 0.3 + c;
      for (int k = 0; k < d; ++k) u += std::cos(2.0 * c + k) * points[static_cast<std::size_t>(i * d + k)];
      a[i * d + c] = u;
    }
  REQUIRE(VecRestoreArrayWrite(v, &a) == 0);
}

struct Solved {
  PetscInt unknowns;
  double difference;
};

/// |z - Z E^-1 Z^T S z| / |z| for a z the hats hold; it is added to what was there.
Solved solve_linear(const GeneratorSpec& spec, PetscInt unknowns, bool (*rolling)(std::int64_t row) = nullptr) {
  Case c(PETSC_COMM_WORLD, spec, 40.0, 0, rolling);
  MatHandle own;
  VecHandle z, r, found, before;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  SpringMatrix& S = *SpringMatrix::from(own);
  REQUIRE(S.create_vector(z.out()) == 0);
  for (VecHandle* v : {&r, &found, &before}) REQUIRE(VecDuplicate(z, v->out()) == 0);
  linear(c.net, c.net.held, z);
  if (rolling) {
    PetscScalar* a = nullptr;
    REQUIRE(c.supports.rolls());
    REQUIRE(VecGetArray(z, &a) == 0);
    c.supports.clear(0, c.net.n, 1, a);
    REQUIRE(VecRestoreArray(z, &a) == 0);
  }
  REQUIRE(S.multiply(z, r) == 0);
  fill(c.net, before);
  REQUIRE(VecCopy(before, found) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, unknowns) == 0);
  REQUIRE(coarse.active());
  REQUIRE(coarse.add(r, found) == 0);
  REQUIRE(VecAXPY(found, -1.0, before) == 0);
  return {coarse.unknowns(), relative_difference(found, z)};
}

}  // namespace

TEST_CASE("A coarse grid solves what its hats hold") {
  for (const int d : {1, 2, 3}) {
    GeneratorSpec spec = d == 1   ? lattice(LatticeType::chain, {23}, 1)
                         : d == 2 ? lattice(LatticeType::square, {9, 7}, 2)
                                  : lattice(LatticeType::cubic, {6, 5, 7}, 3);
    spec.neighbors = d == 1 ? 0 : d == 2 ? 8 : 18;
    for (const PetscInt unknowns : {d == 1 ? 6 : 24, d == 1 ? 12 : d == 2 ? 60 : 100}) {
      const Solved solved = solve_linear(spec, unknowns);
      INFO(d << " dimensions, " << solved.unknowns << " coarse unknowns");
      CHECK(solved.unknowns <= unknowns);
      CHECK(4 * solved.unknowns > unknowns);
      CHECK(solved.difference < 1e-6);  // fractions and springs in single precision
    }
  }
}

TEST_CASE("A coarse grid solves what its hats hold of rollers, and leaves held components alone") {
  for (const int d : {2, 3}) {
    GeneratorSpec spec = d == 2 ? lattice(LatticeType::square, {9, 7}, 2) : lattice(LatticeType::cubic, {6, 5, 7}, 3);
    spec.neighbors = d == 2 ? 8 : 18;
    REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", d == 2 ? "x=free,y=fixed" : "x=fixed,y=free,z=fixed") == 0);
    const Solved solved = solve_linear(spec, d == 2 ? 60 : 100, [](std::int64_t row) { return row % 5 == 0; });
    REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
    INFO(d << " dimensions, " << solved.unknowns << " coarse unknowns");
    CHECK(solved.unknowns > 20);
    CHECK(solved.difference < 1e-6);  // fractions and springs in single precision
  }
}

TEST_CASE("A flat lattice in space has one layer of coarse nodes") {
  GeneratorSpec spec = lattice(LatticeType::square, {9, 8}, 3);
  spec.neighbors = 8;
  const Solved solved = solve_linear(spec, 48);
  CHECK(solved.unknowns == 48);  // 4 x 4 nodes
  CHECK(solved.difference < 1e-6);
}

TEST_CASE("What is added is symmetric and positive") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 6, 6}, 3);
  spec.neighbors = 18;
  spec.fixed_particles = {0, 7, 100};
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  VecHandle p, q, Mp, Mq;
  PetscScalar pMq, qMp, pMp;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  SpringMatrix& S = *SpringMatrix::from(own);
  for (VecHandle* v : {&p, &q, &Mp, &Mq}) REQUIRE(S.create_vector(v->out()) == 0);
  fill(c.net, p);
  REQUIRE(S.multiply(p, q) == 0);
  REQUIRE(VecZeroEntries(Mp) == 0);
  REQUIRE(VecZeroEntries(Mq) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, 81) == 0);
  REQUIRE(coarse.add(p, Mp) == 0);
  REQUIRE(coarse.add(q, Mq) == 0);
  REQUIRE(VecDot(p, Mq, &pMq) == 0);
  REQUIRE(VecDot(q, Mp, &qMp) == 0);
  REQUIRE(VecDot(p, Mp, &pMp) == 0);
  CHECK(std::abs(pMq - qMp) < 1e-12 * std::abs(pMq));
  CHECK(pMp > 0);
}

TEST_CASE("A coarse motion does not strain springs much stiffer than the others") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 6, 6}, 3);
  spec.neighbors = 18;
  spec.stiff_fraction = 0.01;
  spec.stiff_factor = 1e5;
  Case c(PETSC_COMM_SELF, spec, 40.0);
  MatHandle own;
  VecHandle r, z;
  const PetscScalar* a = nullptr;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  SpringMatrix& S = *SpringMatrix::from(own);
  REQUIRE(S.create_vector(r.out()) == 0);
  REQUIRE(VecDuplicate(r, z.out()) == 0);
  fill(c.net, r);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, 192) == 0);
  REQUIRE(coarse.add(r, z) == 0);
  REQUIRE(VecGetArrayRead(z, &a) == 0);
  int tied = 0;
  double largest_soft = 0;
  const Links& links = c.net.links;
  for (PetscInt i = 0; i < c.net.n; ++i)
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      double apart = 0;
      for (int k = 0; k < 3; ++k) apart = std::max(apart, std::abs(a[i * 3 + k] - a[links.other[e] * 3 + k]));
      const bool stiff = links.stiffness[e] > 1e4;
      if (stiff) CHECK(apart == 0);
      tied += stiff;
      largest_soft = std::max(largest_soft, stiff ? 0 : apart);
    }
  REQUIRE(VecRestoreArrayRead(z, &a) == 0);
  CHECK(tied > 10);
  CHECK(largest_soft > 0);
}

TEST_CASE("The operations of a coarse grid are those counted by hand") {
  Case c(PETSC_COMM_SELF, lattice(LatticeType::chain, {9}, 1), 40.0);
  MatHandle own;
  VecHandle r, z;
  PetscLogDouble before, made, added;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  SpringMatrix& S = *SpringMatrix::from(own);
  REQUIRE(S.create_vector(r.out()) == 0);
  REQUIRE(VecDuplicate(r, z.out()) == 0);
  CoarseSpace coarse;
  REQUIRE(PetscGetFlops(&before) == 0);
  REQUIRE(coarse.create(S, 3) == 0);
  REQUIRE(PetscGetFlops(&made) == 0);
  REQUIRE(coarse.add(r, z) == 0);
  REQUIRE(PetscGetFlops(&added) == 0);
  REQUIRE(coarse.active());
  // nine particles and seven springs in two cells have 3 pairs of their 2 corners each, the spring between the cells 10 of its 4, 3 operations
  // a pair; factors and inverse of 3 x 3
  CHECK(made - before == 3 * ((9 + 7) * 3 + 10) + 27);
  // a share and two products, added, of each particle in either direction; 3 x 3 products, added
  CHECK(added - made == 2 * 9 * (1 + 4) + 18);
}

TEST_CASE("The operations of the block factors are those counted by hand") {
  // a chain has no triangles; four particles, each linked to the others, have four
  GeneratorSpec square = lattice(LatticeType::square, {2, 2}, 2);
  square.neighbors = 8;
  const struct {
    GeneratorSpec spec;
    PetscLogDouble flops;  // 2 d^2 a pair, d^3 a pivot, 2 d^3 for each of two products a pair and one a triangle
  } cases[] = {{lattice(LatticeType::chain, {9}, 1), 2 * 8 + 9 + 2 * 2 * 8}, {square, 8 * 6 + 8 * 4 + 16 * (2 * 6 + 4)}};
  REQUIRE(register_block_icc() == 0);
  for (const auto& [spec, flops] : cases) {
    Case c(PETSC_COMM_SELF, spec, 40.0);
    MatHandle own;
    PCHandle pc;
    PetscLogDouble before, after;
    REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
    REQUIRE(c.tangent.assemble(true, own) == 0);
    REQUIRE(PCCreate(PETSC_COMM_SELF, pc.out()) == 0);
    REQUIRE(PCSetType(pc, "bicc") == 0);
    REQUIRE(PCSetOperators(pc, own, own) == 0);
    REQUIRE(PetscGetFlops(&before) == 0);
    REQUIRE(PCSetUp(pc) == 0);
    REQUIRE(PetscGetFlops(&after) == 0);
    CHECK(after - before == flops);
  }
}
