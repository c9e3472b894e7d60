// The coarse grid of the condensed solve: it must solve uniform motions exactly and linear ones nearly, whatever S is.
#include "condensed_case.hpp"
#include "linalg/block_icc.hpp"
#include "linalg/coarse_space.hpp"

using namespace bs;

namespace {

/// Displacements linear in where the particles started, or uniform: the hats hold them.
void linear(const Network& net, const std::vector<double>& points, double slope, Vec v) {
  PetscScalar* a = nullptr;
  const int d = net.dim;
  REQUIRE(VecGetArrayWrite(v, &a) == 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < d; ++c) {
      double u = 0.3 + c;
      for (int k = 0; k < d; ++k) u += slope * std::cos(2.0 * c + k) * points[static_cast<std::size_t>(i * d + k)];
      a[i * d + c] = u;
    }
  REQUIRE(VecRestoreArrayWrite(v, &a) == 0);
}

struct Solved {
  PetscInt unknowns;
  double uniform, linear;
};

/// |z - Z E^-1 Z^T S z| / |z| for a z the hats hold; it is added to what was there.
double difference_of(const GeneratorSpec& spec, double slope, bool (*rolling)(std::int64_t row), PetscInt* unknowns) {
  Case c(PETSC_COMM_WORLD, spec, 40.0, 0, rolling);
  MatHandle own;
  VecHandle z, r, found, before;
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(z.out()) == 0);
  for (VecHandle* v : {&r, &found, &before}) REQUIRE(VecDuplicate(z, v->out()) == 0);
  linear(c.net, c.net.held, slope, z);
  if (rolling) {
    PetscScalar* a = nullptr;
    REQUIRE(c.constraints.rolls());
    REQUIRE(VecGetArray(z, &a) == 0);
    c.constraints.clear(0, c.net.n, 1, a);
    REQUIRE(VecRestoreArray(z, &a) == 0);
  }
  REQUIRE(S.multiply(z, r) == 0);
  fill(c.net, before);
  REQUIRE(VecCopy(before, found) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, false, *unknowns) == 0);
  REQUIRE(coarse.active());
  REQUIRE(coarse.add(r, found) == 0);
  REQUIRE(VecAXPY(found, -1.0, before) == 0);
  *unknowns = coarse.unknowns();
  return relative_difference(found, z);
}

Solved solve(const GeneratorSpec& spec, PetscInt unknowns, bool (*rolling)(std::int64_t row) = nullptr) {
  const double linear = difference_of(spec, 1, rolling, &unknowns), uniform = difference_of(spec, 0, rolling, &unknowns);
  return {unknowns, uniform, linear};
}

}  // namespace

TEST_CASE("A coarse grid solves uniform motions, and linear ones but for springs between its cells") {
  for (const int d : {1, 2, 3}) {
    GeneratorSpec spec = d == 1   ? lattice(LatticeType::chain, {23}, 1)
                         : d == 2 ? lattice(LatticeType::square, {9, 7}, 2)
                                  : lattice(LatticeType::cubic, {6, 5, 7}, 3);
    spec.neighbors = d == 1 ? 0 : d == 2 ? 8 : 18;
    for (const PetscInt unknowns : {d == 1 ? 6 : 24, d == 1 ? 12 : d == 2 ? 60 : 100}) {
      const Solved solved = solve(spec, unknowns);
      INFO(d << " dimensions, " << solved.unknowns << " coarse unknowns");
      CHECK(solved.unknowns <= unknowns);
      CHECK(4 * solved.unknowns > unknowns);
      CHECK(solved.uniform < 1e-6);  // fractions and springs in single precision
      CHECK(solved.linear < 0.01);
    }
  }
}

TEST_CASE("A coarse grid solves motions of rollers, and leaves held components alone") {
  for (const int d : {2, 3}) {
    GeneratorSpec spec = d == 2 ? lattice(LatticeType::square, {9, 7}, 2) : lattice(LatticeType::cubic, {6, 5, 7}, 3);
    spec.neighbors = d == 2 ? 8 : 18;
    REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", d == 2 ? "x=free,y=fixed" : "x=fixed,y=free,z=fixed") == 0);
    const Solved solved = solve(spec, d == 2 ? 60 : 100, [](std::int64_t row) { return row % 5 == 0; });
    REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
    INFO(d << " dimensions, " << solved.unknowns << " coarse unknowns");
    CHECK(solved.unknowns > 20);
    CHECK(solved.uniform < 1e-6);  // fractions and springs in single precision
    CHECK(solved.linear < 0.01);
  }
}

TEST_CASE("A flat lattice in space has one layer of coarse nodes") {
  GeneratorSpec spec = lattice(LatticeType::square, {9, 8}, 3);
  spec.neighbors = 8;
  const Solved solved = solve(spec, 48);
  CHECK(solved.unknowns == 48);  // 4 x 4 nodes
  CHECK(solved.uniform < 1e-6);  // fractions and springs in single precision
  CHECK(solved.linear < 0.01);
}

TEST_CASE("With a node at every particle the coarse grid solves all of S, which joins nodes that are no neighbours") {
  for (const double angle_stiffness : {0.0, 8.0}) {
    GeneratorSpec spec = lattice(LatticeType::cloth, {6, 6}, 3);
    spec.neighbors = 12;  // springs over two edges
    spec.angle_stiffness = angle_stiffness;
    Case c(PETSC_COMM_WORLD, spec, 40.0);
    MatHandle own;
    VecHandle z, r, found;
    PairMatrix& S = assembled(&c, &own);
    REQUIRE(S.create_vector(z.out()) == 0);
    for (VecHandle* v : {&r, &found}) REQUIRE(VecDuplicate(z, v->out()) == 0);
    fill(c.net, z);
    REQUIRE(S.multiply(z, r) == 0);
    CoarseSpace coarse;
    REQUIRE(coarse.create(S, false, 108) == 0);
    CHECK(coarse.unknowns() == 108);
    REQUIRE(coarse.add(r, found) == 0);
    CHECK(relative_difference(found, z) < 1e-5);
  }
}

TEST_CASE("A coarse grid whose matrix is not positive definite stands aside, and comes back") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 6, 6}, 3);
  spec.neighbors = 18;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  VecHandle r, z;
  PetscReal size = 0;
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(r.out()) == 0);
  REQUIRE(VecDuplicate(r, z.out()) == 0);
  fill(c.net, r);
  CoarseSpace coarse;
  const auto created = [&](double more) {
    for (PetscInt i = 0; i < c.net.n; ++i) S.node(i)[0] += more;
    REQUIRE(coarse.create(S, false, 81) == 0);
    REQUIRE(VecZeroEntries(z) == 0);
    REQUIRE(coarse.add(r, z) == 0);
    REQUIRE(VecNorm(z, NORM_2, &size) == 0);
    CHECK((size > 0) == coarse.active());
    return coarse.active();
  };
  CHECK(created(0));
  CHECK_FALSE(created(-1e6));
  CHECK(created(1e6));
}

namespace {

void check_symmetric_and_positive(bool (*rolling)(std::int64_t row)) {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 6, 6}, 3);
  spec.neighbors = 18;
  spec.fixed_particles = {0, 7, 100};
  Case c(PETSC_COMM_WORLD, spec, 40.0, 0, rolling);
  MatHandle own;
  VecHandle p, q, Mp, Mq;
  PetscScalar pMq, qMp, pMp;
  PairMatrix& S = assembled(&c, &own);
  for (VecHandle* v : {&p, &q, &Mp, &Mq}) REQUIRE(S.create_vector(v->out()) == 0);
  fill(c.net, p);  // held components as well
  REQUIRE(S.multiply(p, q) == 0);
  REQUIRE(VecZeroEntries(Mp) == 0);
  REQUIRE(VecZeroEntries(Mq) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, false, 81) == 0);
  REQUIRE(coarse.add(p, Mp) == 0);
  REQUIRE(coarse.add(q, Mq) == 0);
  REQUIRE(VecDot(p, Mq, &pMq) == 0);
  REQUIRE(VecDot(q, Mp, &qMp) == 0);
  REQUIRE(VecDot(p, Mp, &pMp) == 0);
  CHECK(std::abs(pMq - qMp) < 1e-12 * std::abs(pMq));
  CHECK(pMp > 0);
}

}  // namespace

TEST_CASE("What is added is symmetric and positive") {
  check_symmetric_and_positive(nullptr);
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=fixed,y=free,z=free") == 0);
  check_symmetric_and_positive([](std::int64_t row) { return row % 5 == 1; });
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
}

TEST_CASE("The matrix of a coarse grid contains what angle springs resist, rollers or not") {
  GeneratorSpec spec = lattice(LatticeType::cloth, {9, 9}, 3);
  spec.angle_stiffness = 8;
  const Solved solved = solve(spec, 48);
  CHECK(solved.uniform < 1e-6);
  CHECK(solved.linear < 0.01);
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=fixed,y=free,z=fixed") == 0);
  const Solved rolling = solve(spec, 48, [](std::int64_t row) { return row % 5 == 0; });
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
  CHECK(rolling.uniform < 1e-6);
  CHECK(rolling.linear < 0.01);
}

TEST_CASE("Nodes of a coarse grid without particles near by do no harm") {
  GeneratorSpec spec = lattice(LatticeType::square, {12, 4}, 2);
  spec.neighbors = 8;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  for (PetscInt i = 0; i < c.net.n + c.net.ghosts; ++i)
    if (c.net.held[static_cast<std::size_t>(2 * i)] > 5.5) c.net.held[static_cast<std::size_t>(2 * i)] += 40;
  MatHandle own;
  VecHandle z, r, found;
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(z.out()) == 0);
  for (VecHandle* v : {&r, &found}) REQUIRE(VecDuplicate(z, v->out()) == 0);
  linear(c.net, c.net.held, 0, z);
  REQUIRE(S.multiply(z, r) == 0);
  REQUIRE(VecZeroEntries(found) == 0);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, false, 80) == 0);
  CHECK(coarse.active());
  REQUIRE(coarse.add(r, found) == 0);
  CHECK(relative_difference(found, z) < 1e-6);
}

TEST_CASE("A body fills its space where particles are in more than half of the cells, of whatever rank they are") {
  int rank, ranks;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  constexpr int n = 12;
  // all of a cube; two thirds of it and a corner; a third and a corner; its diagonal plane; a flat sheet
  const auto inside = [](int shape, int x, int y, int z) {
    const bool corner = x == n - 1 && y == n - 1 && z == n - 1;
    return shape == 0 || (shape == 1 && (corner || 3 * x < 2 * n)) || (shape == 2 && (corner || 3 * x < n)) || (shape == 3 && x == y) ||
           (shape == 4 && z == 0);
  };
  for (int shape = 0; shape < 5; ++shape) {
    std::vector<double> points;
    for (int x = 0; x < n; ++x)
      for (int y = 0; y < n; ++y)
        for (int z = 0; z < n; ++z)
          if (y % ranks == rank && inside(shape, x, y, z)) points.insert(points.end(), {1.0 * x, 1.0 * y, 1.0 * z});
    const PetscInt own = static_cast<PetscInt>(points.size() / 3);
    HatGrid grid;
    bool fills = false;
    REQUIRE(grid.create(PETSC_COMM_WORLD, 3, own, points, std::vector<std::uint8_t>(static_cast<std::size_t>(own), 0), 343) == 0);  // 6 x 6 x 6 cells
    REQUIRE(grid.fills_space(PETSC_COMM_WORLD, &fills) == 0);
    CAPTURE(shape);
    CHECK(fills == (shape < 2));
  }
}

namespace {

/// Whether P, a preconditioner that was made anew of S, does what one does that is made of S now.
bool acts_as_new(const Network& net, PairMatrix& S, Mat own, PC P) {
  PCHandle fresh;
  VecHandle r, z, expected;
  create_bicc(own, "-unit_pc_bicc_coarse_space hats -unit_pc_bicc_coarse 81", fresh.out());
  REQUIRE(S.create_vector(r.out()) == 0);
  for (VecHandle* v : {&z, &expected}) REQUIRE(VecDuplicate(r, v->out()) == 0);
  fill(net, r);
  mark_changed(own);
  REQUIRE(PCApply(P, r, z) == 0);
  REQUIRE(PCApply(fresh, r, expected) == 0);
  return relative_difference(z, expected) < 1e-12;
}

}  // namespace

TEST_CASE("New factors keep the coarse grid where they are told so and there is one") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 6, 6}, 3);
  spec.neighbors = 18;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  PCHandle pc;
  PairMatrix& S = assembled(&c, &own);
  create_bicc(own, "-unit_pc_bicc_coarse_space hats -unit_pc_bicc_coarse 81", pc.out());
  PetscErrorCode (*keep)(PC, KeptParts) = nullptr;
  REQUIRE(PetscObjectQueryFunction(reinterpret_cast<PetscObject>(pc.get()), "BSKeepParts_C", &keep) == 0);
  REQUIRE(keep);
  const auto soften = [&](double by) {
    for (PetscInt i = 0; i < c.net.n; ++i)
      for (int k = 0; k < 3; ++k) S.node(i)[4 * k] += by;
  };
  CHECK(acts_as_new(c.net, S, own, pc));
  soften(30);
  REQUIRE(keep(pc, KeptParts::coarse_space) == 0);
  CHECK_FALSE(acts_as_new(c.net, S, own, pc));
  soften(30);
  REQUIRE(keep(pc, KeptParts::choices) == 0);
  CHECK(acts_as_new(c.net, S, own, pc));
  soften(-1e6);  // E is not positive definite: there is no coarse grid
  mark_changed(own);
  REQUIRE(PCSetUp(pc) == 0);
  soften(1e6);
  REQUIRE(keep(pc, KeptParts::coarse_space) == 0);
  CHECK(acts_as_new(c.net, S, own, pc));
  for (std::size_t k = 0; k < S.pattern().pairs(); k += 7)  // become stiff, which the pattern depends on
    for (int n = 0; n < 4; ++n) S.pair(k)[n] *= n == 0 ? 1e4F : 1e2F;
  soften(1e7);
  REQUIRE(keep(pc, KeptParts::choices) == 0);
  CHECK_FALSE(acts_as_new(c.net, S, own, pc));
  REQUIRE(keep(pc, KeptParts::none) == 0);
  CHECK(acts_as_new(c.net, S, own, pc));
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
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(r.out()) == 0);
  REQUIRE(VecDuplicate(r, z.out()) == 0);
  fill(c.net, r);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, false, 192) == 0);
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

/// |Q S Q r - Q r| / |Q r| of Q = Z E^-1 Z^T: 0 where E is Z^T S Z.
static double inexactness(double stiff_fraction) {
  GeneratorSpec spec = lattice(LatticeType::cubic, {8, 7, 9}, 3);
  spec.neighbors = 18;
  spec.stiff_fraction = stiff_fraction;
  spec.stiff_factor = 1e4;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  VecHandle r, once, twice;
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(r.out()) == 0);
  for (VecHandle* v : {&once, &twice}) REQUIRE(VecDuplicate(r, v->out()) == 0);
  fill(c.net, r);
  CoarseSpace coarse;
  REQUIRE(coarse.create(S, false, 192) == 0);
  for (VecHandle* v : {&once, &twice}) REQUIRE(VecZeroEntries(*v) == 0);
  REQUIRE(coarse.add(r, once) == 0);
  REQUIRE(S.multiply(once, r) == 0);
  REQUIRE(coarse.add(r, twice) == 0);
  return relative_difference(twice, once);
}

TEST_CASE("The matrix of a coarse grid counts springs much stiffer than others as hats strain them") {
  const double even = inexactness(0), some = inexactness(0.01), many = inexactness(0.2);
  CAPTURE(even, some, many);
  CHECK(even > 1e-3);  // hats are continued to the springs between cells
  CHECK(even < 0.1);
  CHECK(some < 0.1);
  CHECK(many < 0.01);
}

TEST_CASE("Stiff springs tie points for hats in clusters of up to two cells; longer ones bend and stretch with the hats") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {10, 9, 11}, 3);
  spec.neighbors = 18;
  spec.stiff_factor = 1e4;
  spec.stiff_fraction = 0.3;  // one cluster from side to side, of each rank's part, too
  const Solved through = solve(spec, 375);
  CHECK(through.uniform < 1e-6);
  CHECK(through.linear < 0.01);  // few small clusters are left
  spec.stiff_fraction = 0.02;
  const Solved tied = solve(spec, 375);
  CHECK(tied.uniform < 1e-6);
  CHECK(tied.linear > 0.01);  // a linear motion would strain the pairs
}

TEST_CASE("The operations of a coarse grid are those counted by hand") {
  Case c(PETSC_COMM_SELF, lattice(LatticeType::chain, {9}, 1), 40.0);
  MatHandle own;
  VecHandle r, z;
  PetscLogDouble before, made, added;
  PairMatrix& S = assembled(&c, &own);
  REQUIRE(S.create_vector(r.out()) == 0);
  REQUIRE(VecDuplicate(r, z.out()) == 0);
  CoarseSpace coarse;
  REQUIRE(PetscGetFlops(&before) == 0);
  REQUIRE(coarse.create(S, false, 3) == 0);
  REQUIRE(PetscGetFlops(&made) == 0);
  REQUIRE(coarse.add(r, z) == 0);
  REQUIRE(PetscGetFlops(&added) == 0);
  REQUIRE(coarse.active());
  // nine particles and eight springs have 2 corners of a cell each, multiplied once, and 3 pairs of these, multiplied and added; columns of the
  // factor of a tridiagonal matrix with 2, 2 and 1 entries, squared
  CHECK(made - before == (9 + 8) * (2 + 3 * 2) + 9);
  // a share and two products, added, of each particle in either direction; products with the factor's 5 entries, added, twice
  CHECK(added - made == 2 * 9 * (1 + 4) + 20);
}

TEST_CASE("The operations of the block factors are those counted by hand") {
  // a chain has no triangles; four particles, each linked to the others, have four
  GeneratorSpec square = lattice(LatticeType::square, {2, 2}, 2);
  square.neighbors = 8;
  const struct {
    GeneratorSpec spec;
    PetscLogDouble flops;  // 2 d^2 a pair, d^3 a pivot, 2 d^3 for each of two products a pair and one a triangle
  } cases[] = {{lattice(LatticeType::chain, {9}, 1), 2 * 8 + 9 + 2 * 2 * 8}, {square, 8 * 6 + 8 * 4 + 16 * (2 * 6 + 4)}};
  for (const auto& [spec, flops] : cases) {
    Case c(PETSC_COMM_SELF, spec, 40.0);
    MatHandle own;
    PCHandle pc;
    PetscLogDouble before, after;
    assembled(&c, &own);
    create_bicc(own, "", pc.out());
    REQUIRE(PetscGetFlops(&before) == 0);
    REQUIRE(PCSetUp(pc) == 0);
    REQUIRE(PetscGetFlops(&after) == 0);
    CHECK(after - before == flops);
  }
}
