// The coarse space of the condensed solve: what its groups can do together it must solve exactly, whatever S is.
#include "condensed_case.hpp"
#include "systems/particles/condensed/block_icc.hpp"
#include "systems/particles/condensed/coarse_space.hpp"

using namespace bs;

namespace {

/// A rigid motion of all free particles where they are in the state S was made of.
void move_rigidly(const SpringMatrix& S, Vec v) {
  PetscScalar* a = nullptr;
  const Network& net = S.network();
  const int d = net.dim;
  REQUIRE(VecGetArrayWrite(v, &a) == 0);
  for (PetscInt i = 0; i < net.n; ++i) {
    const double* x = S.points().data() + i * d;
    double u[3] = {0.3, -0.7, 0.2};
    if (d == 2) u[0] -= 0.9 * x[1], u[1] += 0.9 * x[0];
    if (d == 3) {
      u[0] += 0.5 * x[2] - 0.9 * x[1];
      u[1] += 0.9 * x[0] + 0.4 * x[2];
      u[2] += -0.4 * x[1] - 0.5 * x[0];
    }
    for (int c = 0; c < d; ++c) a[i * d + c] = net.fixed[i] ? 0 : u[c];
  }
  REQUIRE(VecRestoreArrayWrite(v, &a) == 0);
}

struct Solved {
  PetscInt unknowns;
  double difference;  ///< |z - Q S z| / |z| of a rigid motion z, Q = Z E^-1 Z^T, which is added to what was there
  double left;        ///< |Q S (y - Q S y)| / |y| of any y: Q S is a projection
};

Solved solve_rigid(MPI_Comm comm, const GeneratorSpec& spec, PetscInt unknowns) {
  Case c(comm, spec, 40.0);
  MatHandle own;
  VecHandle z, r, found, before;
  PetscReal size, left;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  SpringMatrix& S = *SpringMatrix::from(own);
  REQUIRE(S.create_vector(z.out()) == 0);
  for (VecHandle* v : {&r, &found, &before}) REQUIRE(VecDuplicate(z, v->out()) == 0);
  move_rigidly(S, z);
  REQUIRE(S.multiply(z, r) == 0);
  fill(c.net, before);
  REQUIRE(VecCopy(before, found) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, unknowns, "") == 0);
  REQUIRE(coarse.active());
  REQUIRE(coarse.add(r, found) == 0);
  REQUIRE(VecAXPY(found, -1.0, before) == 0);
  const double difference = relative_difference(found, z);
  REQUIRE(VecNorm(before, NORM_2, &size) == 0);
  for (int k = 0; k < 2; ++k) {
    REQUIRE(S.multiply(before, r) == 0);
    REQUIRE(VecZeroEntries(found) == 0);
    REQUIRE(coarse.add(r, found) == 0);
    REQUIRE(VecAXPY(before, -1.0, found) == 0);
  }
  REQUIRE(VecNorm(found, NORM_2, &left) == 0);
  return {coarse.unknowns(), difference, left / size};
}

}  // namespace

TEST_CASE("The coarse space solves rigid motions, and what it solves is solved") {
  for (const int d : {1, 2, 3}) {
    GeneratorSpec spec = d == 1   ? lattice(LatticeType::chain, {230}, 1)
                         : d == 2 ? lattice(LatticeType::square, {19, 17}, 2)
                                  : lattice(LatticeType::cubic, {9, 8, 10}, 3);
    spec.neighbors = d == 1 ? 0 : d == 2 ? 8 : 18;
    for (const PetscInt unknowns : {PetscInt{-1}, PetscInt{6}}) {
      const Solved solved = solve_rigid(PETSC_COMM_WORLD, spec, unknowns);
      INFO(d << " dimensions, " << solved.unknowns << " coarse unknowns");
      CHECK(solved.unknowns > 0);
      CHECK(solved.difference < 1e-6);  // shares and springs in single precision
      CHECK(solved.left < 1e-6);
    }
  }
}

TEST_CASE("Groups that are flat, straight or a single particle") {
  GeneratorSpec sheet = lattice(LatticeType::square, {19, 18}, 3);
  sheet.neighbors = 8;
  GeneratorSpec line = lattice(LatticeType::chain, {300}, 3);
  GeneratorSpec two = lattice(LatticeType::chain, {2}, 3);
  GeneratorSpec single = lattice(LatticeType::chain, {3}, 2);
  single.fixed_particles = {1};
  for (const GeneratorSpec& spec : {sheet, line, two}) {
    const Solved solved = solve_rigid(PETSC_COMM_SELF, spec, -1);
    CHECK(solved.difference < 1e-6);
    CHECK(solved.left < 1e-6);
  }
  Case c(PETSC_COMM_SELF, single, 40.0);  // nothing to gain: each is tied to the fixed one alone
  MatHandle own;
  CoarseSpace coarse;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  REQUIRE(coarse.create(*SpringMatrix::from(own), -1, "") == 0);
  CHECK(!coarse.active());
}

TEST_CASE("The number of coarse unknowns can be bounded") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {10, 10, 10}, 3);
  spec.neighbors = 18;
  const PetscInt by_size = solve_rigid(PETSC_COMM_SELF, spec, -1).unknowns;
  const PetscInt few = solve_rigid(PETSC_COMM_SELF, spec, 12).unknowns;
  CHECK(by_size > 30);
  CHECK(by_size < 80);
  CHECK(few <= 12);
  CHECK(few >= 6);
}

TEST_CASE("The preconditioner is symmetric and positive, however factors and coarse space work together") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {7, 6, 9}, 3);
  spec.neighbors = 18;
  spec.fixed_particles = {0, 7, 100};
  for (const char* coupling : {"added", "symmetric", "projected"}) {
    Case c(PETSC_COMM_WORLD, spec, 40.0);
    MatHandle own;
    VecHandle p, q, Mp, Mq;
    PCHandle pc;
    PetscScalar pMq, qMp, pMp;
    REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
    REQUIRE(c.tangent.assemble(true, own) == 0);
    SpringMatrix& S = *SpringMatrix::from(own);
    for (VecHandle* v : {&p, &q, &Mp, &Mq}) REQUIRE(S.create_vector(v->out()) == 0);
    fill(c.net, p);
    REQUIRE(S.multiply(p, q) == 0);
    REQUIRE(PetscOptionsSetValue(nullptr, "-unit_pc_bicc_coupling", coupling) == 0);
    REQUIRE(register_block_icc() == 0);
    REQUIRE(PCCreate(PETSC_COMM_WORLD, pc.out()) == 0);
    REQUIRE(PCSetOptionsPrefix(pc, "unit_") == 0);
    REQUIRE(PCSetType(pc, "bicc") == 0);
    REQUIRE(PCSetFromOptions(pc) == 0);
    REQUIRE(PCSetOperators(pc, own, own) == 0);
    REQUIRE(PCSetUp(pc) == 0);
    REQUIRE(PCApply(pc, p, Mp) == 0);
    REQUIRE(PCApply(pc, q, Mq) == 0);
    REQUIRE(VecDot(p, Mq, &pMq) == 0);
    REQUIRE(VecDot(q, Mp, &qMp) == 0);
    REQUIRE(VecDot(p, Mp, &pMp) == 0);
    INFO(coupling);
    CHECK(std::abs(pMq - qMp) < 1e-5 * std::abs(pMq));  // factors in single precision
    CHECK(pMp > 0);
  }
  REQUIRE(PetscOptionsClearValue(nullptr, "-unit_pc_bicc_coupling") == 0);
}

TEST_CASE("Conjugate gradients find the same solution by each of them, projected in the fewest products") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {7, 6, 40}, 3);
  spec.neighbors = 18;
  Case c(PETSC_COMM_WORLD, spec, 2.0);
  MatHandle own;
  VecHandle b, x, reference;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  REQUIRE(c.tangent.assemble(true, own) == 0);
  SpringMatrix& S = *SpringMatrix::from(own);
  for (VecHandle* v : {&b, &x, &reference}) REQUIRE(S.create_vector(v->out()) == 0);
  fill(c.net, b);
  std::vector<PetscInt> iterations;
  for (const char* coupling : {"added", "symmetric", "projected"}) {
    KSPHandle ksp;
    PC pc;
    PetscInt its = 0;
    KSPConvergedReason reason;
    REQUIRE(PetscOptionsSetValue(nullptr, "-unit_pc_bicc_coupling", coupling) == 0);
    REQUIRE(register_block_icc() == 0);
    REQUIRE(KSPCreate(PETSC_COMM_WORLD, ksp.out()) == 0);
    REQUIRE(KSPSetOptionsPrefix(ksp, "unit_") == 0);
    REQUIRE(KSPSetType(ksp, KSPCG) == 0);
    REQUIRE(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED) == 0);
    REQUIRE(KSPSetTolerances(ksp, 1e-10, 0, PETSC_DEFAULT, 500) == 0);
    REQUIRE(KSPGetPC(ksp, &pc) == 0);
    REQUIRE(PCSetType(pc, "bicc") == 0);
    REQUIRE(KSPSetFromOptions(ksp) == 0);
    REQUIRE(KSPSetOperators(ksp, own, own) == 0);
    REQUIRE(KSPSolve(ksp, b, x) == 0);
    REQUIRE(KSPGetConvergedReason(ksp, &reason) == 0);
    REQUIRE(KSPGetIterationNumber(ksp, &its) == 0);
    CHECK(reason > 0);
    if (iterations.empty()) REQUIRE(VecCopy(x, reference) == 0);
    else CHECK(relative_difference(x, reference) < 1e-8);
    iterations.push_back(its);
  }
  REQUIRE(PetscOptionsClearValue(nullptr, "-unit_pc_bicc_coupling") == 0);
  INFO(iterations[0] << " " << iterations[1] << " " << iterations[2]);
  CHECK(iterations[1] < iterations[0]);
  CHECK(std::abs(iterations[2] - iterations[1]) <= 2);
}

TEST_CASE("A coarse motion does not strain springs much stiffer than the others") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {8, 8, 8}, 3);
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
  REQUIRE(coarse.create(S, -1, "") == 0);
  REQUIRE(coarse.add(r, z) == 0);
  REQUIRE(VecGetArrayRead(z, &a) == 0);
  int tied = 0;
  double largest_soft = 0, largest_stiff = 0;
  const Links& links = c.net.links;
  for (PetscInt i = 0; i < c.net.n; ++i)
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      const PetscInt j = links.other[e];
      double along = 0, length = 0;
      for (int k = 0; k < 3; ++k) {
        const double apart = S.points()[i * 3 + k] - S.points()[j * 3 + k];
        along += apart * (a[i * 3 + k] - a[j * 3 + k]);
        length += apart * apart;
      }
      const double strain = std::abs(along) / length;
      const bool stiff = links.stiffness[e] > 1e4;
      largest_stiff = std::max(largest_stiff, stiff ? strain : 0);
      tied += stiff;
      largest_soft = std::max(largest_soft, stiff ? 0 : strain);
    }
  REQUIRE(VecRestoreArrayRead(z, &a) == 0);
  CHECK(tied > 10);
  CHECK(largest_soft > 0);
  CHECK(largest_stiff < 1e-9 * largest_soft);
}
