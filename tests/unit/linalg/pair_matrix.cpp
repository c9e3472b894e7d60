// The condensed matrix: its own storage against PETSc's, block by block; incomplete factors that must be exact.
#include <unistd.h>
#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>
#include <string>
#include "condensed_case.hpp"
#include "linalg/block_icc.hpp"

using namespace bs;

/// Products of S by springs and of PETSc's matrices. The images of a periodic lattice stand at their particles' places here; what is compared is who
/// is joined to whom.
static void check_storages(GeneratorSpec spec, bool (*rolling)(std::int64_t row) = nullptr) {
  spec.neighbors = spec.dim == 1 ? 0 : spec.dim == 2 ? 8 : 18;
  spec.fixed_particles = {0, 3};
  Case c(PETSC_COMM_WORLD, spec, 40.0, 0, rolling);
  MatHandle own;
  REQUIRE(c.tangent.create(CondensedStorage::springs, own.out()) == 0);
  VecHandle p, expected, found;
  REQUIRE(PairMatrix::from(own)->create_vector(p.out()) == 0);
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

TEST_CASE("S multiplies alike in every storage") {
  for (const char* periodic : {"", "all"})
    for (const int d : {1, 2, 3}) {
      GeneratorSpec spec = d == 1   ? lattice(LatticeType::chain, {17}, 1)
                           : d == 2 ? lattice(LatticeType::square, {7, 6}, 2)
                                    : lattice(LatticeType::cubic, {4, 5, 4}, 3);
      if (*periodic) spec.periodic = std::string("xyz").substr(0, static_cast<std::size_t>(d));
      check_storages(spec);
    }
  // two particles along x are joined in more than one box
  GeneratorSpec narrow = lattice(LatticeType::cubic, {2, 5, 4}, 3);
  narrow.periodic = "xz";
  check_storages(narrow);
}

TEST_CASE("S of rollers multiplies alike in every storage") {
  const auto rolling = [](std::int64_t row) { return row % 5 == 1; };
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=fixed,y=free") == 0);
  check_storages(lattice(LatticeType::square, {7, 6}, 2), rolling);
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=free,y=fixed,z=fixed") == 0);
  check_storages(lattice(LatticeType::cubic, {4, 5, 4}, 3), rolling);
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
}

TEST_CASE("a rank's incomplete factors contain springs across a periodic box") {
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  GeneratorSpec spec = lattice(LatticeType::cubic, {4, 5, 4}, 3);
  spec.neighbors = 18;
  spec.periodic = "xyz";
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  const PairPattern pattern = pairs_of(c.net);
  // 80 particles on 18 neighbours each
  if (ranks == 1) CHECK(pattern.pairs() == 720);
  if (ranks == 1) CHECK(pattern.ghost.empty());
}

TEST_CASE("the pattern of S has each pair once, however many springs it has, and no particle beside itself") {
  for (const std::int64_t narrow : {1, 2, 4}) {
    GeneratorSpec spec = lattice(LatticeType::cubic, {narrow, 5, 4}, 3);
    spec.neighbors = 6;
    spec.periodic = "xz";
    Case c(PETSC_COMM_WORLD, spec, 40.0);
    const PairPattern pattern = pairs_of(c.net);
    bool once = true;
    for (PetscInt i = 0; i < pattern.n; ++i) {
      std::vector<PetscInt> others(pattern.other.begin() + pattern.start[i], pattern.other.begin() + pattern.start[i + 1]);
      std::sort(others.begin(), others.end());
      once = once && std::adjacent_find(others.begin(), others.end()) == others.end() && (others.empty() || others.front() > i);
    }
    for (std::size_t r = 0; r < pattern.cut_row.size(); ++r)
      for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k)
        once = once && c.net.global[pattern.n + pattern.ghost[k]] != c.net.global[pattern.cut_row[r]];
    CAPTURE(narrow);
    CHECK(once);
  }
}

/// w.J z = z.J^T w for the shell's J, of a step and of an equilibrium, in both forms; refused where axial dampers make it unsymmetric.
static void check_transposed(double axial_damping, Form form, bool at_rest) {
  GeneratorSpec spec = lattice(LatticeType::triangular, {4, 5}, 2);
  Case c(PETSC_COMM_WORLD, spec, 25.0, axial_damping);
  MatHandle J;
  VecHandle w, z, product;
  PetscScalar one = 0, other = 0;
  std::get<StokesDrag>(c.laws).D = 1.7;
  for (double& m : c.net.inertia) m *= 0.7;
  if (at_rest) {
    c.tangent.set_static(3.0);
    REQUIRE(zero_velocities(c.y) == 0);
  }
  REQUIRE(c.tangent.linearise(0.0, c.y, 25.0, form) == 0);
  REQUIRE(c.tangent.create_shell(J.out()) == 0);
  for (VecHandle* made : {&w, &z, &product}) REQUIRE(VecDuplicate(c.y, made->out()) == 0);
  REQUIRE(VecCopy(c.y, z) == 0);
  REQUIRE(VecPointwiseMult(w, c.y, c.y) == 0);
  REQUIRE(MatMult(J, z, product) == 0);
  REQUIRE(VecDot(product, w, &one) == 0);
  if (axial_damping > 0 && !at_rest) {
    PetscBool has = PETSC_TRUE;
    REQUIRE(MatHasOperation(J, MATOP_MULT_TRANSPOSE, &has) == 0);
    CHECK_FALSE(has);
    c.tangent.set_static(3.0);  // dampers play no part any more
    REQUIRE(c.tangent.offer_transposed(J) == 0);
    REQUIRE(MatHasOperation(J, MATOP_MULT_TRANSPOSE, &has) == 0);
    CHECK(has);
    return;
  }
  REQUIRE(MatMultTranspose(J, w, product) == 0);
  REQUIRE(VecDot(product, z, &other) == 0);
  CHECK(other == Approx(one).epsilon(1e-12));
}

TEST_CASE("the shell of the full Jacobian multiplies by its transposed where that is symmetric") {
  for (const Form form : {Form::momentum, Form::velocity}) {
    check_transposed(0, form, false);
    check_transposed(0.4, form, false);
  }
  for (const double damping : {0.0, 0.4}) check_transposed(damping, Form::momentum, true);
}

/// For any z, r = J z: the exact S (sigma z_x), or S z_v where dampers are strong and this is the smaller one, must be the condensed right-hand side
/// of r, and z come back from both.
static void check_elimination(double axial_damping) {
  GeneratorSpec spec = lattice(LatticeType::cubic, {3, 4, 3}, 3);
  spec.neighbors = 18;
  Case c(PETSC_COMM_WORLD, spec, 25.0, axial_damping);
  const PetscInt d = 3;
  MatHandle S;
  VecHandle w, b, z, r, Sw;
  REQUIRE(c.tangent.create(CondensedStorage::aij, S.out()) == 0);
  REQUIRE(c.tangent.assemble(false, S) == 0);
  REQUIRE(MatCreateVecs(S, w.out(), b.out()) == 0);
  REQUIRE(VecDuplicate(b, Sw.out()) == 0);
  REQUIRE(VecDuplicate(c.y, z.out()) == 0);
  REQUIRE(VecDuplicate(c.y, r.out()) == 0);
  REQUIRE(c.tangent.multiply(c.y, r) == 0);
  REQUIRE(c.tangent.condense(r, b) == 0);
  const PetscScalar* ay = nullptr;
  PetscScalar* aw = nullptr;
  REQUIRE(VecGetArrayRead(c.y, &ay) == 0);
  REQUIRE(VecGetArray(w, &aw) == 0);
  for (PetscInt i = 0; i < c.net.n; ++i)
    for (PetscInt k = 0; k < d; ++k) aw[i * d + k] = axial_damping > 1e6 ? ay[i * 2 * d + d + k] : 25.0 * ay[i * 2 * d + k];
  REQUIRE(VecRestoreArray(w, &aw) == 0);
  REQUIRE(VecRestoreArrayRead(c.y, &ay) == 0);
  REQUIRE(c.tangent.multiply_condensed(w, Sw) == 0);
  CHECK(relative_difference(Sw, b) < 1e-13);
  REQUIRE(c.tangent.expand(r, w, z) == 0);
  CHECK(relative_difference(z, c.y) < 1e-13);
  // the assembled S holds all of it but what axial dampers owe to the places of their ends
  fill(c.net, w);
  REQUIRE(c.tangent.multiply_condensed(w, b) == 0);
  REQUIRE(MatMult(S, w, Sw) == 0);
  const double left_out = relative_difference(Sw, b);
  CHECK(c.tangent.exact_symmetric() == (axial_damping == 0));
  if (axial_damping == 0) CHECK(left_out < 1e-13);
  else CHECK(left_out > 1e-4);
}

TEST_CASE("S is what J leaves when positions are eliminated") {
  check_elimination(0);
  check_elimination(3);
  check_elimination(1e7);
}

TEST_CASE("the definite part of S is positive definite where S is not") {
  GeneratorSpec spec = lattice(LatticeType::cubic, {4, 3, 4}, 3);
  spec.rest_length_factor = 6;
  Case c(PETSC_COMM_WORLD, spec, 0.5, 2.0);
  MatHandle S;
  VecHandle w, Sw;
  REQUIRE(c.tangent.create(CondensedStorage::aij, S.out()) == 0);
  REQUIRE(MatCreateVecs(S, w.out(), Sw.out()) == 0);
  double lowest[2];
  for (const bool positive : {false, true}) {
    REQUIRE(c.tangent.assemble(positive, S) == 0);
    PetscBool symmetric = PETSC_FALSE;
    REQUIRE(MatIsSymmetric(S, 1e-10, &symmetric) == 0);
    CHECK(symmetric);
    // the smallest Ritz value
    KSP ksp;
    PC pc;
    REQUIRE(KSPCreate(PETSC_COMM_WORLD, &ksp) == 0);
    REQUIRE(KSPSetOperators(ksp, S, S) == 0);
    REQUIRE(KSPGetPC(ksp, &pc) == 0);
    REQUIRE(PCSetType(pc, PCNONE) == 0);
    REQUIRE(KSPSetType(ksp, KSPGMRES) == 0);
    REQUIRE(KSPGMRESSetRestart(ksp, 200) == 0);
    REQUIRE(KSPSetComputeEigenvalues(ksp, PETSC_TRUE) == 0);
    REQUIRE(KSPSetTolerances(ksp, 1e-10, 0, 1e10, 150) == 0);
    fill(c.net, w);
    REQUIRE(KSPSolve(ksp, w, Sw) == 0);
    std::vector<PetscReal> re(200), im(200);
    PetscInt count = 0;
    REQUIRE(KSPComputeEigenvalues(ksp, 200, re.data(), im.data(), &count) == 0);
    REQUIRE(count > 0);
    lowest[positive] = *std::min_element(re.begin(), re.begin() + count);
    REQUIRE(KSPDestroy(&ksp) == 0);
  }
  CHECK(lowest[0] < 0);
  CHECK(lowest[1] > 0);
}

/// z for which L D L^T z = S x + shift size x, on a chain, where nothing is left out of the factors; size: of a diagonal block.
static double worst_of_chain(int d, bool single, double shift, double sigma = 30, double rest_length_factor = 1, bool positive = true,
                             bool (*rolling)(std::int64_t row) = nullptr, std::int64_t particles = 23) {
  GeneratorSpec spec = lattice(LatticeType::chain, {particles}, d);
  spec.rest_length_factor = rest_length_factor;
  Case c(PETSC_COMM_SELF, spec, sigma, 0, rolling);
  MatHandle S;
  REQUIRE(c.tangent.create(CondensedStorage::springs, S.out()) == 0);
  REQUIRE(c.tangent.assemble(positive, S) == 0);
  auto factor = create_block_factor(d, single);
  REQUIRE(factor->lay_out(*PairMatrix::from(S), 1, false) == 0);
  std::vector<double> diagonal;
  PairMatrix::from(S)->diagonal_blocks(&diagonal);
  if (!factor->factor(*PairMatrix::from(S), diagonal, shift)) return -1;
  VecHandle x, b;
  REQUIRE(PairMatrix::from(S)->create_vector(x.out()) == 0);
  REQUIRE(VecDuplicate(x, b.out()) == 0);
  fill(c.net, x);
  REQUIRE(MatMult(S, x, b) == 0);
  std::vector<double> z(static_cast<std::size_t>(c.net.n * d));
  PetscScalar* ab = nullptr;
  const PetscScalar* ax = nullptr;
  REQUIRE(VecGetArray(b, &ab) == 0);
  REQUIRE(VecGetArrayRead(x, &ax) == 0);
  for (PetscInt i = 0; i < c.net.n; ++i) {
    float size = 0;
    for (int k = 0; k < d; ++k) size = std::max(size, static_cast<float>(std::abs(diagonal[static_cast<std::size_t>(i * d * d + k * (d + 1))])));
    for (int k = 0; k < d; ++k) ab[i * d + k] += shift * static_cast<double>(size) * ax[i * d + k];
  }
  factor->solve(ab, z.data());
  double worst = 0;
  for (std::size_t k = 0; k < z.size(); ++k) worst = std::max(worst, std::abs(z[k] - ax[k]));
  REQUIRE(VecRestoreArray(b, &ab) == 0);
  REQUIRE(VecRestoreArrayRead(x, &ax) == 0);
  return worst;
}

TEST_CASE("incomplete factors of a chain are complete") {
  for (const int d : {1, 2, 3})
    for (const bool single : {false, true})
      for (const double shift : {0.0, 1e-3, 0.5}) {
        CAPTURE(d, single, shift);
        const double worst = worst_of_chain(d, single, shift);
        CHECK(worst >= 0);
        CHECK(worst < (single ? 1e-4 : 1e-11));
        CHECK(worst > (single ? 1e-12 : -1.0));  // single precision leaves its mark
      }
}

TEST_CASE("incomplete factors of a chain with rollers are complete") {
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=free,y=fixed") == 0);
  for (const bool single : {false, true}) {
    const double worst = worst_of_chain(2, single, 0, 30, 1, true, [](std::int64_t row) { return row % 3 == 0; });
    CHECK(worst >= 0);
    CHECK(worst < (single ? 1e-4 : 1e-11));
  }
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
}

TEST_CASE("a matrix that is singular but for rounding is refused by the factors") {
  for (const int d : {1, 2, 3}) {
    CAPTURE(d);
    CHECK(worst_of_chain(d, false, 0, 1e-9) == -1);
  }
  // Two masses of 0.5 kg on a spring of k = 70/sigma kg/s: of the last pivot, the inertia sigma of the whole, rounding takes or adds up to 1.5 eps k
  // (in the inverse of the first pivot, the product and the difference), and what is below 4 eps k is refused. The inertia is 1.5 eps k, and 65 eps
  // k: neither verdict hangs on how the processor rounds, as it does along a longer chain, where every link adds its rounding errors.
  const auto two = [](double sigma) { return worst_of_chain(1, false, 0, sigma, 1, true, nullptr, 2); };
  CHECK(two(1.5e-7) == -1);
  CHECK(two(1e-6) >= 0);
}

/// bicc of an indefinite S, whose factors need a shift: the smallest of those tried with which they exist, and their solution.
TEST_CASE("the shift of the preconditioner grows until its factors exist") {
  GeneratorSpec spec = lattice(LatticeType::chain, {23}, 3);
  spec.rest_length_factor = 6;
  Case c(PETSC_COMM_SELF, spec, 0.5);
  MatHandle S;
  PCHandle pc;
  VecHandle b, z;
  REQUIRE(c.tangent.create(CondensedStorage::springs, S.out()) == 0);
  REQUIRE(c.tangent.assemble(false, S) == 0);
  PairMatrix& matrix = *PairMatrix::from(S);
  REQUIRE(matrix.create_vector(b.out()) == 0);
  REQUIRE(VecDuplicate(b, z.out()) == 0);
  fill(c.net, b);
  create_bicc(S, "-unit_pc_bicc_precision double -unit_pc_bicc_coarse 0", pc.out());
  PCFailedReason reason = PC_FACTOR_OTHER;
  REQUIRE(PCSetUp(pc) == 0);
  REQUIRE(PCGetFailedReason(pc, &reason) == 0);
  CHECK(reason == PC_NOERROR);
  REQUIRE(PCApply(pc, b, z) == 0);
  auto factor = create_block_factor(3, false);
  std::vector<double> diagonal, expected(static_cast<std::size_t>(c.net.n * 3));
  REQUIRE(factor->lay_out(matrix, 1, false) == 0);
  matrix.diagonal_blocks(&diagonal);
  double shift = 0;
  int refused = 0;
  for (; refused < 20 && !factor->factor(matrix, diagonal, shift); ++refused) shift = refused == 0 ? 1e-3 : 4 * shift;
  CHECK(refused > 2);
  const PetscScalar *ab = nullptr, *az = nullptr;
  REQUIRE(VecGetArrayRead(b, &ab) == 0);
  REQUIRE(VecGetArrayRead(z, &az) == 0);
  factor->solve(ab, expected.data());
  for (std::size_t k = 0; k < expected.size(); ++k) CHECK(az[k] == expected[k]);
  REQUIRE(VecRestoreArrayRead(z, &az) == 0);
  REQUIRE(VecRestoreArrayRead(b, &ab) == 0);
}

/// What bicc says of its factors.
static std::string said(PC pc) {
  const std::string file = "/tmp/backspring_view_" + std::to_string(getpid());
  PetscViewer viewer;
  REQUIRE(PetscViewerASCIIOpen(PETSC_COMM_WORLD, file.c_str(), &viewer) == 0);
  REQUIRE(PCView(pc, viewer) == 0);
  REQUIRE(PetscViewerDestroy(&viewer) == 0);
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  unlink(file.c_str());
  return text;
}

TEST_CASE("factors are in double precision where stiffnesses of any two ranks differ by 1e5, fixed particles apart") {
  for (const double contrast : {1e3, 1e7}) {
    GeneratorSpec spec = lattice(LatticeType::chain, {60}, 2);
    spec.fixed_particles = {0, 31};
    Case c(PETSC_COMM_WORLD, spec, 1e-3);  // inertia, which fixed particles have as well, is nothing beside the springs
    MatHandle S;
    PCHandle pc;
    PairMatrix& matrix = assembled(&c, &S);
    for (PetscInt i = 0; i < c.net.n; ++i)  // the first third is the stiff part: no rank but the first has both
      for (int k = 0; k < 2 && c.net.row[i] < 20 && !c.net.fixed[i]; ++k) matrix.node(i)[3 * k] *= 1, matrix.node(i)[3 * k] += contrast * 1e5;
    create_bicc(S, "-unit_pc_bicc_coarse 0", pc.out());
    REQUIRE(PCSetUp(pc) == 0);
    const std::string text = said(pc);
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    CAPTURE(contrast, text);
    if (rank == 0) CHECK((text.find("in double precision") != std::string::npos) == (contrast > 1e5));
    if (rank == 0) CHECK((text.find("in single precision") != std::string::npos) == (contrast < 1e5));
  }
}

TEST_CASE("an indefinite tangent is refused by the factors until the shift is large enough") {
  const double squeezed = 6, slow = 0.5;  // springs of a sixth of their rest length push sideways harder than masses hold
  for (const int d : {2, 3})
    for (const bool single : {false, true}) {
      CAPTURE(d, single);
      CHECK(worst_of_chain(d, single, 0, slow, squeezed, false) == -1);
      const double worst = worst_of_chain(d, single, 64, slow, squeezed, false);
      CHECK(worst >= 0);
      CHECK(worst < (single ? 1e-4 : 1e-11));
    }
}

/// The numbers of all ranks.
static std::vector<double> of_all_ranks(const double* own, PetscInt count) {
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  std::vector<int> counts(static_cast<std::size_t>(ranks)), starts(counts.size() + 1, 0);
  const int mine = static_cast<int>(count);
  MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, PETSC_COMM_WORLD);
  std::partial_sum(counts.begin(), counts.end(), starts.begin() + 1);
  std::vector<double> all(static_cast<std::size_t>(starts.back()));
  MPI_Allgatherv(own, mine, MPI_DOUBLE, all.data(), counts.data(), starts.data(), MPI_DOUBLE, PETSC_COMM_WORLD);
  return all;
}

/// The modes given to multigrid with S: what they do to any two particles, of whatever ranks.
static void check_rigid_modes(const GeneratorSpec& spec, PetscInt expected, bool (*rolling)(std::int64_t row) = nullptr) {
  Case c(PETSC_COMM_WORLD, spec, 40.0, 0, rolling);
  const PetscInt d = c.net.dim;
  LinearisedForces before;  // not linearised at anything, as when the header describes the solver
  REQUIRE(before.create(c.net, *c.terms, c.pattern, c.y, false) == 0);
  for (Linearisation* forces : {static_cast<Linearisation*>(&before), static_cast<Linearisation*>(&c.linearised)}) {
    CAPTURE(d, forces == &before);
    const auto at = [&](PetscInt i) { return forces == &before ? c.net.held.data() + i * d : c.linearised.state().at(i); };
    MatHandle S;
    MatNullSpace space = nullptr;
    PetscBool constant = PETSC_TRUE;
    PetscInt count = 0;
    const Vec* modes = nullptr;
    REQUIRE(forces->create(CondensedStorage::aij, S.out()) == 0);
    REQUIRE(MatGetNearNullSpace(S, &space) == 0);
    REQUIRE((space != nullptr) == (expected > 0));
    if (space) REQUIRE(MatNullSpaceGetVecs(space, &constant, &count, &modes) == 0);
    REQUIRE(count == expected);
    for (PetscInt k = 0; k < count; ++k) {
      for (PetscInt l = 0; l <= k; ++l) {
        PetscScalar product = 0;
        REQUIRE(VecDot(modes[k], modes[l], &product) == 0);
        CHECK(std::abs(product - (k == l)) < 1e-12);
      }
      const PetscScalar* own = nullptr;
      std::vector<double> points, held;
      for (PetscInt i = 0; i < c.net.n; ++i)
        for (PetscInt a = 0; a < d; ++a) {
          points.push_back(at(i)[a]);
          held.push_back(c.constraints.held(i) >> a & 1);
        }
      REQUIRE(VecGetArrayRead(modes[k], &own) == 0);
      const std::vector<double> u = of_all_ranks(own, c.net.n * d), x = of_all_ranks(points.data(), c.net.n * d),
                                hold = of_all_ranks(held.data(), c.net.n * d);
      REQUIRE(VecRestoreArrayRead(modes[k], &own) == 0);
      double worst = 0;
      const std::size_t n = u.size(), width = static_cast<std::size_t>(d);
      for (std::size_t p = 0; p < n; ++p) worst = std::max(worst, std::abs(hold[p] * u[p]));
      const auto free = [&](std::size_t p) { return std::all_of(hold.begin() + p, hold.begin() + p + width, [](double one) { return one == 0; }); };
      for (std::size_t p = 0; p < n; p += width)
        for (std::size_t q = 0; q < n && free(p); q += width) {
          if (!free(q)) continue;
          double change = 0;  // of half the squared distance
          for (std::size_t a = 0; a < width; ++a) change += (u[p + a] - u[q + a]) * (x[p + a] - x[q + a]);
          worst = std::max(worst, std::abs(change));
        }
      CHECK(worst < 1e-12);
    }
  }
}

TEST_CASE("multigrid is told the rotations of the lattice, too, and that fixed particles do not move") {
  check_rigid_modes(lattice(LatticeType::chain, {9}, 1), 1);
  GeneratorSpec net = lattice(LatticeType::square, {5, 4}, 2), block = lattice(LatticeType::cubic, {3, 4, 3}, 3);
  check_rigid_modes(net, 3);
  net.fixed_particles = {2, 7};
  check_rigid_modes(net, 3);
  check_rigid_modes(block, 6);
  block.fixed_particles = {0, 1, 2, 3, 11};
  check_rigid_modes(block, 6);
  GeneratorSpec held = lattice(LatticeType::chain, {2}, 2);
  held.fixed_particles = {0, 1};
  check_rigid_modes(held, 0);
  GeneratorSpec box = lattice(LatticeType::square, {5, 4}, 2);
  box.periodic = "xy";
  check_rigid_modes(box, 2);  // it does not turn
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_motion_rolling", "x=fixed,y=free,z=free") == 0);
  check_rigid_modes(lattice(LatticeType::cubic, {3, 4, 3}, 3), 6, [](std::int64_t row) { return row < 6; });
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_motion_rolling") == 0);
}

TEST_CASE("velocities of other ranks' particles travel only where dampers need them") {
  for (const double damping : {0.0, 2.0}) {
    Case c(PETSC_COMM_WORLD, lattice(LatticeType::cubic, {4, 3, 5}, 3), 40.0, damping);
    double worst = 0, fastest = 0;
    for (PetscInt i = c.net.n; i < c.net.n + c.net.ghosts; ++i)
      for (int k = 0; k < 3; ++k) {
        worst = std::max(worst, std::abs(c.linearised.state().at(i)[k] - c.net.held[i * 3 + k]));
        fastest = std::max(fastest, std::abs(c.linearised.state().at(i)[3 + k]));
      }
    CAPTURE(damping, c.net.ghosts);
    CHECK(worst <= 0.05);
    if (c.net.ghosts > 0) CHECK((fastest > 0.1) == (damping > 0));
  }
}
