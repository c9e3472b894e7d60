// Factors that overlap where the rank boundary cuts stiff springs, and the age of a preconditioner.
#include <algorithm>
#include "condensed_case.hpp"
#include "linalg/condensed/inner_solver.hpp"
#include "linalg/factor_pattern.hpp"

using namespace bs;

namespace {

using Dense = std::vector<std::vector<double>>;

/// z = (L D L^T)^-1 b, the factors those of a dense A with blocks of d rows, from which a block of fill is left out unless two stiff blocks make it;
/// `order`: of the blocks, in which they are eliminated; empty: their own.
std::vector<double> solve_incomplete(const Dense& whole, const std::vector<double>& right, std::size_t d, double least,
                                     const std::vector<PetscInt>& order) {
  const std::size_t n = right.size(), blocks = n / d;
  const auto row = [&](std::size_t k) { return order.empty() ? k : static_cast<std::size_t>(order[k / d]) * d + k % d; };
  Dense A(n, std::vector<double>(n));
  std::vector<double> b(n), out(n);
  for (std::size_t r = 0; r < n; ++r) {
    b[r] = right[row(r)];
    for (std::size_t c = 0; c < n; ++c) A[r][c] = whole[row(r)][row(c)];
  }
  std::vector<std::vector<int>> kept(blocks, std::vector<int>(blocks, 0));  // 1: is in the pattern, 2: stiff as well
  for (std::size_t i = 0; i < blocks; ++i)
    for (std::size_t j = 0; j < blocks; ++j) {
      double trace = 0, size = 0;
      for (std::size_t r = 0; r < d; ++r)
        for (std::size_t c = 0; c < d; ++c) {
          trace += r == c ? std::abs(A[i * d + r][j * d + c]) : 0;
          size += std::abs(A[i * d + r][j * d + c]);
        }
      kept[i][j] = trace > 0.1 * least ? 2 : size > 0 ? 1 : 0;
    }
  for (std::size_t k = 0; k < blocks; ++k)
    for (std::size_t i = k + 1; i < blocks; ++i)
      for (std::size_t j = k + 1; j < blocks; ++j)
        if (i != j && kept[k][i] == 2 && kept[k][j] == 2) kept[i][j] = 2;
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t r = k + 1; r < n; ++r) {
      if (!kept[k / d][r / d]) continue;
      const double f = A[r][k] / A[k][k];
      for (std::size_t c = k + 1; c < n; ++c)
        if (kept[k / d][c / d] && kept[r / d][c / d]) A[r][c] -= f * A[k][c];
    }
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t r = k + 1; r < n; ++r)
      if (kept[k / d][r / d]) b[r] -= A[k][r] / A[k][k] * b[k];
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t c = k + 1; c < n; ++c)
      if (kept[k / d][c / d]) b[k] -= A[k][c] * b[c];
    b[k] /= A[k][k];
  }
  for (std::size_t k = 0; k < n; ++k) out[row(k)] = b[k];
  return out;
}

/// All numbers of v on every rank.
std::vector<double> gathered(Vec v) {
  VecScatter scatter;
  Vec all;
  const PetscScalar* a = nullptr;
  PetscInt size;
  REQUIRE(VecScatterCreateToAll(v, &scatter, &all) == 0);
  REQUIRE(VecScatterBegin(scatter, v, all, INSERT_VALUES, SCATTER_FORWARD) == 0);
  REQUIRE(VecScatterEnd(scatter, v, all, INSERT_VALUES, SCATTER_FORWARD) == 0);
  REQUIRE(VecGetSize(all, &size) == 0);
  REQUIRE(VecGetArrayRead(all, &a) == 0);
  std::vector<double> out(a, a + size);
  REQUIRE(VecRestoreArrayRead(all, &a) == 0);
  REQUIRE(VecDestroy(&all) == 0);
  REQUIRE(VecScatterDestroy(&scatter) == 0);
  return out;
}

/// Columns of S, whole on every rank.
Dense columns_of(Mat S, Vec like) {
  VecHandle unit, column;
  PetscInt size;
  REQUIRE(VecDuplicate(like, unit.out()) == 0);
  REQUIRE(VecDuplicate(like, column.out()) == 0);
  REQUIRE(VecGetSize(like, &size) == 0);
  Dense columns;
  for (PetscInt k = 0; k < size; ++k) {
    REQUIRE(VecSet(unit, 0) == 0);
    REQUIRE(VecSetValue(unit, k, 1, INSERT_VALUES) == 0);
    REQUIRE(VecAssemblyBegin(unit) == 0);
    REQUIRE(VecAssemblyEnd(unit) == 0);
    REQUIRE(MatMult(S, unit, column) == 0);
    columns.push_back(gathered(column));
  }
  return columns;
}

bool stiff_pair(const Dense& S, PetscInt i, PetscInt j, std::size_t d, double least) {
  double trace = 0;
  for (std::size_t c = 0; c < d; ++c) trace += std::abs(S[static_cast<std::size_t>(i) * d + c][static_cast<std::size_t>(j) * d + c]);
  return i != j && trace > 0.1 * least;
}

/// Ghosts that stiff springs tie to owned particles, by way of other ghosts or not; global numbers, ascending.
std::vector<PetscInt> reached_ghosts(const Dense& S, const Network& net, double least) {
  std::vector<PetscInt> reached(net.global.begin(), net.global.begin() + net.n), left(net.global.begin() + net.n, net.global.end());
  for (std::size_t k = 0; k < reached.size(); ++k)
    for (std::size_t g = left.size(); g-- > 0;)
      if (stiff_pair(S, reached[k], left[g], static_cast<std::size_t>(net.dim), least)) {
        reached.push_back(left[g]);
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(g));
      }
  reached.erase(reached.begin(), reached.begin() + net.n);
  std::sort(reached.begin(), reached.end());
  return reached;
}

/// sum over ranks of R^T M^-1 R b, R: the components of the given particles, the first `own` of them this rank's; M: the factors of R S R^T without
/// soft springs between the others.
std::vector<double> schwarz(const Dense& columns, const std::vector<PetscInt>& particles, std::size_t own, std::size_t d, double least,
                            const std::vector<double>& b, const std::vector<PetscInt>& order) {
  std::vector<std::size_t> rows;
  for (const PetscInt p : particles)
    for (std::size_t c = 0; c < d; ++c) rows.push_back(static_cast<std::size_t>(p) * d + c);
  Dense A(rows.size(), std::vector<double>(rows.size()));
  std::vector<double> right, sum(b.size(), 0.0);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    right.push_back(b[rows[r]]);
    for (std::size_t c = 0; c < rows.size(); ++c) A[r][c] = columns[rows[c]][rows[r]];
  }
  for (std::size_t i = own; i < particles.size(); ++i)
    for (std::size_t j = own; j < particles.size(); ++j)
      for (std::size_t k = 0; k < d * d && i != j && !stiff_pair(columns, particles[i], particles[j], d, least); ++k)
        A[i * d + k / d][j * d + k % d] = 0;
  const std::vector<double> z = solve_incomplete(A, right, d, least, order);
  for (std::size_t r = 0; r < rows.size(); ++r) sum[rows[r]] += z[r];
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), static_cast<int>(sum.size()), MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return sum;
}

/// Largest difference of `found` from `expected`, relative to the largest number; not finite: 1e300.
double worst_of(const std::vector<double>& found, const std::vector<double>& expected) {
  double size = 0, worst = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    size = std::max(size, std::abs(expected[k]));
    worst = std::max(worst, std::isfinite(found[k]) ? std::abs(found[k] - expected[k]) : 1e300);
  }
  return worst / size;
}

/// Of all ranks: rows and ties of ghosts, and factors whose rows are in an order of their own.
struct Counts {
  int rows = 0, ties = 0, ordered = 0;
};

/// Largest difference between the preconditioner and the same made of dense matrices, relative; `counts`: what this case has. Of the
/// first S, then of one with another diagonal and other springs, in the factors laid out for the first.
double worst_difference(const GeneratorSpec& spec, Counts* counts, bool (*rolling)(std::int64_t row) = nullptr) {
  Case c(PETSC_COMM_WORLD, spec, 30.0, 0, rolling);
  MatHandle S;
  PCHandle pc;
  VecHandle b, z;
  PairMatrix& matrix = assembled(&c, &S);
  create_bicc(S, "-unit_pc_bicc_precision double -unit_pc_bicc_coarse 0", pc.out());
  REQUIRE(matrix.create_vector(b.out()) == 0);
  REQUIRE(VecDuplicate(b, z.out()) == 0);
  fill(c.net, b);
  REQUIRE(PCApply(pc, b, z) == 0);
  Overlap overlap;
  double least = 0;
  REQUIRE(least_stiff_size(matrix, &least) == 0);
  REQUIRE(overlap.create(matrix, least) == 0);
  FactorPattern pattern;
  REQUIRE(make_factor_pattern(matrix, least, 16, &overlap, &pattern) == 0);
  REQUIRE((least == 0 || pattern.made()));  // no rank does without its rows
  int found[3] = {static_cast<int>(overlap.ghosts().size()), static_cast<int>(overlap.ties().size()), pattern.order.empty() ? 0 : 1};
  MPI_Allreduce(MPI_IN_PLACE, found, 3, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  counts->rows += found[0];
  counts->ties += found[1];
  counts->ordered += found[2];
  if (least == 0) least = 1e300;
  const Dense columns = columns_of(S, b);
  std::vector<PetscInt> particles(c.net.global.begin(), c.net.global.begin() + c.net.n), ghosts;
  for (const PetscInt g : overlap.ghosts()) ghosts.push_back(c.net.global[c.net.n + g]);
  particles.insert(particles.end(), ghosts.begin(), ghosts.end());
  std::sort(ghosts.begin(), ghosts.end());
  CHECK(ghosts == reached_ghosts(columns, c.net, least));
  const std::size_t own = static_cast<std::size_t>(c.net.n), d = static_cast<std::size_t>(c.net.dim);
  const std::vector<double> right = gathered(b);
  const double first = worst_of(gathered(z), schwarz(columns, particles, own, d, least, right, pattern.order));
  REQUIRE(c.tangent.linearise(0.0, c.y, 20.0, Form::momentum) == 0);
  REQUIRE(c.tangent.assemble(true, S) == 0);
  mark_changed(S);
  REQUIRE(PCApply(pc, b, z) == 0);
  return std::max(first, worst_of(gathered(z), schwarz(columns_of(S, b), particles, own, d, least, right, pattern.order)));
}

}  // namespace

TEST_CASE("factors overlap where stiff springs are cut, as additive Schwarz does with dense matrices") {
  int ranks;
  Counts counts;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  for (const int d : {1, 2, 3})
    for (std::int64_t seed = 1; seed <= 4; ++seed) {
      CAPTURE(d, seed);
      GeneratorSpec spec = d == 1 ? lattice(LatticeType::chain, {17}, d) : lattice(LatticeType::square, {8, 5}, d);
      if (d > 1) spec.neighbors = 8;
      spec.stiff_fraction = 0.2;
      spec.stiff_factor = 1e4;
      spec.seed = seed;
      CHECK(worst_difference(spec, &counts) < 1e-7);
    }
  CHECK((ranks == 1) == (counts.rows == 0));
  CHECK((ranks == 1) == (counts.ties == 0));
  // ranks that meet at an edge of their parts: a spring between ghosts of two other ranks; several ties of one ghost
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 5, 4}, 3);
  spec.neighbors = 18;
  spec.stiff_fraction = 0.12;
  spec.stiff_factor = 1e4;
  CHECK(worst_difference(spec, &counts) < 1e-7);
  CHECK(counts.ordered == 0);
  spec.stiff_fraction = 0.3;
  CHECK(worst_difference(spec, &counts) < 1e-7);
  CHECK(counts.ordered > 0);
}

/// As worst_difference, of factors that overlap everywhere: sum over ranks of W R^T M^-1 R W b, W = 1/sqrt of how many ranks have the particle.
double worst_everywhere(const GeneratorSpec& spec, int* rows) {
  Case c(PETSC_COMM_WORLD, spec, 30.0);
  MatHandle S;
  VecHandle b, z;
  PairMatrix& matrix = assembled(&c, &S);
  const std::unique_ptr<BlockFactor> factor = create_block_factor(matrix.dim(), false);
  std::vector<double> diagonal;
  REQUIRE(matrix.create_vector(b.out()) == 0);
  REQUIRE(VecDuplicate(b, z.out()) == 0);
  fill(c.net, b);
  REQUIRE(factor->lay_out(matrix, 16, true) == 0);
  matrix.diagonal_blocks(&diagonal);
  REQUIRE(factor->overlap().update(matrix, &diagonal) == 0);
  REQUIRE(factor->factor(matrix, diagonal, 0));
  const auto solve = [&](const double* in, double* out) { factor->solve(in, out); };
  if (factor->overlap().active()) {
    REQUIRE(factor->overlap().apply(matrix, b, z, solve) == 0);
  } else {
    const ReadArray in(b);
    solve(in.data(), WriteArray(z).data());
  }
  std::vector<PetscInt> particles(c.net.global.begin(), c.net.global.begin() + c.net.n);
  for (const PetscInt g : factor->overlap().ghosts()) particles.push_back(c.net.global[c.net.n + g]);
  CHECK(static_cast<PetscInt>(particles.size()) == c.net.n + c.net.ghosts);
  const std::size_t d = static_cast<std::size_t>(c.net.dim);
  std::vector<double> right = gathered(b), count(right.size() / d, 0.0);
  for (const PetscInt p : particles) count[static_cast<std::size_t>(p)] += 1;
  MPI_Allreduce(MPI_IN_PLACE, count.data(), static_cast<int>(count.size()), MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  *rows += static_cast<int>(factor->overlap().ghosts().size());
  for (std::size_t k = 0; k < right.size(); ++k) right[k] /= std::sqrt(count[k / d]);
  std::vector<double> expected = schwarz(columns_of(S, b), particles, particles.size(), d, 1e300, right, {});
  for (std::size_t k = 0; k < right.size(); ++k) expected[k] /= std::sqrt(count[k / d]);
  return worst_of(gathered(z), expected);
}

TEST_CASE("factors that overlap at all springs count what several ranks have in parts") {
  int ranks = 1, rows = 0;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  for (const int d : {1, 2, 3}) {
    CAPTURE(d);
    GeneratorSpec spec = d == 1 ? lattice(LatticeType::chain, {17}, d) : lattice(LatticeType::square, {8, 5}, d);
    if (d > 1) spec.neighbors = 8;
    CHECK(worst_everywhere(spec, &rows) < 1e-7);
  }
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 5, 4}, 3);
  spec.neighbors = 18;
  CHECK(worst_everywhere(spec, &rows) < 1e-7);
  CHECK((ranks == 1) == (rows == 0));
}

TEST_CASE("factors with fill of stiff springs leave out what is held of rollers") {
  int ranks = 1;
  Counts counts;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (ranks > 1) return;  // the test tells stiff springs by S, in which those along held directions are 0
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=free,y=fixed") == 0);
  GeneratorSpec spec = lattice(LatticeType::square, {8, 5}, 2);
  spec.neighbors = 8;
  spec.stiff_fraction = 0.3;
  spec.stiff_factor = 1e4;
  CHECK(worst_difference(spec, &counts, [](std::int64_t row) { return row % 3 == 0; }) < 1e-7);
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
}

TEST_CASE("factors hold the blocks of angle springs, as factors of dense matrices do") {
  Counts counts;
  for (const int d : {2, 3})
    for (const double stiffness : {0.05, 8.0}) {
      CAPTURE(d, stiffness);
      GeneratorSpec spec = lattice(LatticeType::square, {8, 5}, d);
      spec.angle_stiffness = stiffness;
      CHECK(worst_difference(spec, &counts) < 1e-7);
      GeneratorSpec block = lattice(LatticeType::cubic, {4, 5, 4}, 3);
      block.angle_stiffness = stiffness;
      if (d == 3) CHECK(worst_difference(block, &counts) < 1e-7);
    }
  CHECK(counts.rows == 0);
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (ranks > 1) return;  // blocks between ghosts are not sent
  GeneratorSpec block = lattice(LatticeType::cubic, {6, 6, 6}, 3);
  block.neighbors = 18;
  block.angle_stiffness = 0.5;
  block.stiff_fraction = 0.3;
  block.stiff_factor = 1e4;
  CHECK(worst_difference(block, &counts) < 1e-7);
  CHECK(counts.ordered > 0);
}

TEST_CASE("images of particles in a periodic box are not tied to each other") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 5, 4}, 3);
  spec.neighbors = 18;
  spec.periodic = "xyz";
  spec.stiff_fraction = 0.12;
  spec.stiff_factor = 1e4;
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  Case c(PETSC_COMM_WORLD, spec, 30.0);
  MatHandle S;
  PairMatrix& matrix = assembled(&c, &S);
  Overlap overlap;
  double least = 0;
  REQUIRE(least_stiff_size(matrix, &least) == 0);
  REQUIRE(overlap.create(matrix, least) == 0);
  CHECK(overlap.active() == (ranks > 1));
  CHECK(overlap.ties().empty());  // which of the images a tie is between is not told: those of one particle have one number
}

TEST_CASE("ranks whose stiff springs would fill their factors do without those of other ranks") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {6, 5, 4}, 3);
  spec.neighbors = 18;
  spec.stiff_fraction = 0.3;
  spec.stiff_factor = 2000;
  Case c(PETSC_COMM_WORLD, spec, 1000.0);  // inertia enough for factors without fill
  MatHandle S;
  PCHandle pc;
  VecHandle b, z;
  PairMatrix& matrix = assembled(&c, &S);
  create_bicc(S, "-unit_pc_bicc_precision double -unit_pc_bicc_coarse 0 -unit_pc_bicc_fill 0", pc.out());
  REQUIRE(matrix.create_vector(b.out()) == 0);
  REQUIRE(VecDuplicate(b, z.out()) == 0);
  fill(c.net, b);
  REQUIRE(PCApply(pc, b, z) == 0);
  Overlap overlap;
  FactorPattern pattern;
  double least = 0;
  REQUIRE(least_stiff_size(matrix, &least) == 0);
  REQUIRE(overlap.create(matrix, least) == 0);
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  CHECK(overlap.active() == (ranks > 1));
  CHECK(make_factor_pattern(matrix, least, 0, &overlap, &pattern) == 0);
  CHECK_FALSE(pattern.made());
  const std::vector<PetscInt> own(c.net.global.begin(), c.net.global.begin() + c.net.n);
  CHECK(worst_of(gathered(z), schwarz(columns_of(S, b), own, own.size(), 3, 1e300, gathered(b), {})) < 1e-7);
}

TEST_CASE("a preconditioner that has aged gets new factors first, a new coarse grid where these do not help") {
  PreconditionerAge age;
  const double most = 1.3;
  CHECK(age.due());
  CHECK(age.renew() == KeptParts::none);  // the first is new in all its parts
  age.note(10, true, most);
  CHECK_FALSE(age.due());
  age.note(14, false, most);  // 1.3 times, and one more, is borne
  CHECK_FALSE(age.due());
  age.note(14.1, false, most);
  CHECK(age.due());
  CHECK(age.renew() == KeptParts::coarse_space);
  age.note(13.9, true, most);
  CHECK_FALSE(age.due());  // that of the first one is the measure, not 13.9
  age.note(15, false, most);
  CHECK(age.due());
  CHECK(age.renew() == KeptParts::coarse_space);
  age.note(20, true, most);  // new factors did not help
  CHECK(age.due());
  CHECK(age.renew() == KeptParts::none);
  age.note(20, true, most);  // a harder matrix: the new measure
  CHECK_FALSE(age.due());
  age.discard();
  CHECK(age.due());
  CHECK(age.renew() == KeptParts::choices);
  age.note(15, false, most);  // less than with all parts new
  CHECK_FALSE(age.due());
  age.discard();
  age.forget();
  age.discard();
  CHECK(age.renew() == KeptParts::none);
}
