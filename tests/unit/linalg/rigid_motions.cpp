// The coarse space of rigid motions of groups: what its groups can do together it must solve exactly, whatever S is.
#include "condensed_case.hpp"
#include "linalg/block_icc.hpp"
#include "linalg/coarse_space.hpp"

using namespace bs;

namespace {

/// A rigid motion of all free particles where they are in the state S was made of.
void move_rigidly(const PairMatrix& S, Vec v) {
  PetscScalar* a = nullptr;
  const Graph& graph = S.graph();
  const int d = graph.dim;
  const std::vector<double> points = S.positions();
  REQUIRE(VecGetArrayWrite(v, &a) == 0);
  for (PetscInt i = 0; i < graph.n; ++i) {
    const double* x = points.data() + i * d;
    double u[3] = {0.3, -0.7, 0.2};
    if (d == 2) u[0] -= 0.9 * x[1], u[1] += 0.9 * x[0];
    if (d == 3) {
      u[0] += 0.5 * x[2] - 0.9 * x[1];
      u[1] += 0.9 * x[0] + 0.4 * x[2];
      u[2] += -0.4 * x[1] - 0.5 * x[0];
    }
    for (int c = 0; c < d; ++c) a[i * d + c] = graph.fixed[i] ? 0 : u[c];
  }
  graph.clear_held(a);
  REQUIRE(VecRestoreArrayWrite(v, &a) == 0);
}

struct Solved {
  PetscInt unknowns;
  double difference;  ///< |z - Q S z| / |z| of a rigid motion z, Q = Z E^-1 Z^T, which is added to what was there
  double left;        ///< |Q S (y - Q S y)| / |y| of any y: Q S is a projection
};

Solved solve_rigid(MPI_Comm comm, const GeneratorSpec& spec, PetscInt unknowns, bool (*rolling)(std::int64_t row) = nullptr) {
  Case c(comm, spec, 40.0, 0, rolling);
  MatHandle own;
  VecHandle z, r, found, before;
  PetscReal size, left;
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(z.out()) == 0);
  for (VecHandle* v : {&r, &found, &before}) REQUIRE(VecDuplicate(z, v->out()) == 0);
  move_rigidly(S, z);
  REQUIRE(S.multiply(z, r) == 0);
  fill(c.net, before);
  REQUIRE(VecCopy(before, found) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, true, unknowns) == 0);
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

TEST_CASE("A coarse space of rigid motions solves these, and what it solves is solved") {
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

TEST_CASE("The coarse matrix of rigid motions contains what angle springs resist, rollers or not") {
  GeneratorSpec spec = lattice(LatticeType::cloth, {19, 18}, 3);
  spec.angle_stiffness = 8;
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=fixed,y=free,z=fixed") == 0);
  for (auto rolling : {static_cast<bool (*)(std::int64_t)>(nullptr), +[](std::int64_t row) { return row % 5 == 0; }}) {
    const Solved solved = solve_rigid(PETSC_COMM_WORLD, spec, -1, rolling);
    CHECK(solved.difference < 1e-6);
    CHECK(solved.left < 1e-6);
  }
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
}

TEST_CASE("Rigid motions of rollers lack their held components") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {4, 4, 40}, 3);
  spec.neighbors = 18;
  for (const char* hold : {"x=fixed,y=free,z=fixed", "x=free,y=free,z=fixed"}) {
    REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", hold) == 0);
    for (auto rolling : {+[](std::int64_t row) { return row % 5 == 0; }, +[](std::int64_t row) { return row < 320; }}) {
      const Solved solved = solve_rigid(PETSC_COMM_WORLD, spec, -1, rolling);
      CHECK(solved.difference < 1e-6);
      CHECK(solved.left < 1e-6);
    }
    REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
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
  REQUIRE(coarse.create(assembled(&c, &own), true, -1) == 0);
  CHECK(!coarse.active());
}

TEST_CASE("The number of unknowns of rigid motions can be bounded") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {10, 10, 10}, 3);
  spec.neighbors = 18;
  const PetscInt by_size = solve_rigid(PETSC_COMM_SELF, spec, -1).unknowns;
  const PetscInt few = solve_rigid(PETSC_COMM_SELF, spec, 12).unknowns;
  CHECK(by_size > 30);
  CHECK(by_size < 80);
  CHECK(few <= 12);
  CHECK(few >= 6);
}

TEST_CASE("The preconditioner with rigid motions is symmetric and positive, of the present S and of an older one") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {4, 4, 40}, 3);
  spec.neighbors = 18;
  spec.fixed_particles = {0, 7, 100};
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  VecHandle p, q, Mp, Mq;
  PCHandle pc;
  PetscScalar pMq, qMp, pMp;
  PairMatrix& S = assembled(&c, &own);
  for (VecHandle* v : {&p, &q, &Mp, &Mq}) REQUIRE(S.create_vector(v->out()) == 0);
  fill(c.net, p);
  REQUIRE(S.multiply(p, q) == 0);
  create_bicc(own, "-unit_pc_bicc_coarse_space rigid", pc.out());
  REQUIRE(PCSetUp(pc) == 0);
  for (const double sigma : {40.0, 2.0}) {  // the second S is twenty times as stiff against its inertia
    REQUIRE(c.tangent.linearise(0.0, c.y, sigma, Form::momentum) == 0);
    REQUIRE(c.tangent.assemble(true, own) == 0);
    REQUIRE(PCApply(pc, p, Mp) == 0);
    REQUIRE(PCApply(pc, q, Mq) == 0);
    REQUIRE(VecDot(p, Mq, &pMq) == 0);
    REQUIRE(VecDot(q, Mp, &qMp) == 0);
    REQUIRE(VecDot(p, Mp, &pMp) == 0);
    INFO("sigma " << sigma);
    CHECK(std::abs(pMq - qMp) < 1e-5 * std::abs(pMq));  // factors in single precision
    CHECK(pMp > 0);
  }
}

TEST_CASE("Groups of a periodic box hold particles that are near each other") {
  GeneratorSpec spec = lattice(LatticeType::square, {24, 4}, 2);
  spec.periodic = "x";
  Case c(PETSC_COMM_SELF, spec, 40.0);
  MatHandle own;
  const PairMatrix& S = assembled(&c, &own);
  CHECK_FALSE(S.pattern().across.empty());
  RigidGroups groups;
  groups.create(S, 16, 2);
  const Shares& shares = groups.shares();
  const std::vector<double>& x = S.graph().start;
  std::vector<double> low(static_cast<std::size_t>(groups.count()), 1e300), high(low.size(), -1e300);
  for (std::size_t i = 0; i + 1 < shares.start.size(); ++i)
    for (PetscInt k = shares.start[i]; k < shares.start[i + 1]; ++k) {
      const std::size_t a = static_cast<std::size_t>(shares.group[k]);
      low[a] = std::min(low[a], x[2 * i]);
      high[a] = std::max(high[a], x[2 * i]);
    }
  for (std::size_t a = 0; a < low.size(); ++a) CHECK(high[a] - low[a] < 12);  // half of the box
}
