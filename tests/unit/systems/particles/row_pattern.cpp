// The pattern of the Jacobian against a list of all springs, and what is written into it against sums written out.
#include "systems/particles/row_pattern.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include "held_network.hpp"
#include "small_network.hpp"

using namespace bs;

namespace {

const OptionTexts cube = {
    {"-bs_lattice_type", "cubic"}, {"-bs_lattice_size", "4,3,3"}, {"-bs_lattice_neighbors", "18"}, {"-bs_lattice_fixed", "xmin"}};

/// By row in the input: the rows of the particles that share a spring with it, fixed ones left out, and itself.
std::vector<std::set<std::int64_t>> neighbours() {
  GeneratorSpec spec = lattice(LatticeType::cubic, {4, 3, 3}, 3);
  spec.neighbors = 18;
  const Lattice whole = generate(spec, 0, 1);
  std::vector<std::set<std::int64_t>> found(36);
  const auto fixed = [](std::int64_t row) { return row % 4 == 0; };  // x is counted first
  for (std::int64_t row = 0; row < 36; ++row) found[static_cast<std::size_t>(row)].insert(row);
  for (std::size_t k = 0; k < whole.pairs.size(); ++k) {
    const std::int64_t a = whole.pairs[k], b = whole.pairs[k ^ 1];
    if (!fixed(a) && !fixed(b)) found[static_cast<std::size_t>(a)].insert(b);
  }
  return found;
}

std::vector<std::int64_t> rows_of_globals(const Network& net) {
  std::vector<std::int64_t> rows(static_cast<std::size_t>(net.total), 0);
  for (PetscInt i = 0; i < net.n; ++i) rows[static_cast<std::size_t>(net.first + i)] = net.row[static_cast<std::size_t>(i)];
  MPI_Allreduce(MPI_IN_PLACE, rows.data(), static_cast<int>(rows.size()), MPI_INT64_T, MPI_SUM, PETSC_COMM_WORLD);
  return rows;
}

/// Any number for an entry of the panel of the particle with that row, in the columns of particle `other`.
double value(std::int64_t row, std::int64_t other, PetscInt r, PetscInt c) {
  return std::sin(static_cast<double>(row * 71 + other * 13 + r * 7 + c) + 0.5);
}

PetscErrorCode write_values(const Network& net, const RowPattern& pattern, const std::vector<std::int64_t>& rows, Mat J) {
  PetscFunctionBegin;
  RowWriter writer(net, pattern);
  std::vector<double> panel;
  PetscCall(writer.begin(J));
  for (PetscInt i = 0; i < net.n; ++i) {
    const PetscInt width = pattern.count(i) * 6;
    panel.assign(static_cast<std::size_t>(3 * width), 0.0);
    for (PetscInt r = 0; r < 3; ++r)
      for (PetscInt c = 0; c < width; ++c)
        panel[static_cast<std::size_t>(r * width + c)] =
            value(net.row[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(pattern.columns(i)[c / 6])], r, c % 6);
    PetscCall(writer.write(i, 3.0, 0.5 + static_cast<double>(net.row[static_cast<std::size_t>(i)]), panel.data()));
  }
  PetscCall(writer.end());
  PetscFunctionReturn(0);
}

}  // namespace

TEST_CASE("a row has the columns of its particle and of those that springs tie to it, fixed ones left out", "[row_pattern]") {
  for (const char* partition : {"graph", "geometric", "rows"}) {
    OptionTexts texts = cube;
    texts["-bs_partition"] = partition;
    const HeldNetwork at(texts);
    const auto expected = neighbours();
    const auto rows = rows_of_globals(at.net);
    RowPattern pattern;
    REQUIRE_FALSE(pattern.created());
    pattern.create(at.net);
    REQUIRE(pattern.created());
    PetscInt widest = 0, blocks = 0;
    for (PetscInt i = 0; i < at.net.n; ++i) {
      const PetscInt* columns = pattern.columns(i);
      std::set<std::int64_t> found;
      PetscInt low = 0, own = 0;
      for (PetscInt k = 0; k < pattern.count(i); ++k) {
        if (k > 0) REQUIRE(columns[k - 1] < columns[k]);
        found.insert(rows[static_cast<std::size_t>(columns[k])]);
        low += columns[k] < at.net.first;
        own += columns[k] >= at.net.first && columns[k] < at.net.first + at.net.n;
      }
      REQUIRE(found == expected[static_cast<std::size_t>(at.net.row[static_cast<std::size_t>(i)])]);
      REQUIRE(columns[pattern.self(i)] == at.net.first + i);
      REQUIRE((pattern.low(i) == low && pattern.own(i) == own));
      for (PetscInt e = at.net.links.start[static_cast<std::size_t>(i)]; e < at.net.links.start[static_cast<std::size_t>(i) + 1]; ++e) {
        const PetscInt other = at.net.links.other[static_cast<std::size_t>(e)];
        const bool dropped = at.net.fixed[static_cast<std::size_t>(i)] || at.net.fixed[static_cast<std::size_t>(other)];
        if (dropped) REQUIRE(pattern.slot(e) == -1);
        else REQUIRE(columns[pattern.slot(e)] == at.net.global[static_cast<std::size_t>(other)]);
      }
      widest = std::max(widest, pattern.count(i));
      blocks += pattern.count(i);
    }
    CHECK(pattern.widest() == widest);
    CHECK(pattern.blocks() == blocks);
  }
}

TEST_CASE("a spring that can exert no force has no block, unless it is broken", "[row_pattern]") {
  OptionTexts texts = cube;
  texts["-bs_lattice_stiff_fraction"] = "0.4";
  texts["-bs_lattice_stiff_factor"] = "0";
  HeldNetwork at(texts);
  Links& links = at.net.links;
  for (const bool broken : {false, true}) {
    if (broken) links.broken.assign(links.spring.size(), 1);
    RowPattern pattern;
    pattern.create(at.net);
    PetscInt none = 0;
    for (PetscInt i = 0; i < at.net.n; ++i) {
      PetscInt blocks = 1;
      for (PetscInt e = links.start[static_cast<std::size_t>(i)]; e < links.start[static_cast<std::size_t>(i) + 1]; ++e) {
        const auto other = static_cast<std::size_t>(links.other[static_cast<std::size_t>(e)]);
        if (at.net.fixed[static_cast<std::size_t>(i)] || at.net.fixed[other]) continue;
        const bool there = broken || links.stiffness[static_cast<std::size_t>(e)] > 0;
        none += !there;
        blocks += there;
        if (there) REQUIRE(pattern.columns(i)[pattern.slot(e)] == at.net.global[other]);
        else REQUIRE(pattern.slot(e) == -1);
      }
      REQUIRE(pattern.count(i) == blocks);
    }
    REQUIRE((none > 0) == !broken);
  }
}

TEST_CASE("rows are written where they belong, into AIJ and into types that are filled entry by entry", "[row_pattern]") {
  const auto expected = neighbours();
  for (const char* type : {"aij", "baij"}) {
    const HeldNetwork at(cube);
    const auto rows = rows_of_globals(at.net);
    RowPattern pattern;
    pattern.create(at.net);
    MatHandle J;
    {
      const Given given(OptionTexts{{"-mat_type", type}});
      REQUIRE(pattern.create_matrix(at.net, J.out()) == 0);
    }
    // twice: what is written replaces what was there
    for (int turn = 0; turn < 2; ++turn) REQUIRE(write_values(at.net, pattern, rows, J) == 0);
    VecHandle product;
    REQUIRE(VecDuplicate(at.y, product.out()) == 0);
    REQUIRE(MatMult(J, at.y, product) == 0);
    const PetscScalar* found = nullptr;
    REQUIRE(VecGetArrayRead(product, &found) == 0);
    std::vector<PetscInt> global_of(36);
    for (std::size_t g = 0; g < 36; ++g) global_of[static_cast<std::size_t>(rows[g])] = static_cast<PetscInt>(g);
    for (PetscInt i = 0; i < at.net.n; ++i) {
      const std::int64_t row = at.net.row[static_cast<std::size_t>(i)];
      const double scale = 0.5 + static_cast<double>(row);
      for (PetscInt r = 0; r < 3; ++r) {
        const double x = at.entry(at.net.first + i, r, 0), v = at.entry(at.net.first + i, 3 + r, 0);
        CHECK(found[6 * i + r] == Approx(scale * (3 * x - v)).epsilon(1e-13).margin(1e-13));
        double sum = 0;
        for (const std::int64_t other : expected[static_cast<std::size_t>(row)])
          for (PetscInt c = 0; c < 6; ++c) sum += value(row, other, r, c) * at.entry(global_of[static_cast<std::size_t>(other)], c, 0);
        CHECK(found[6 * i + 3 + r] == Approx(sum).epsilon(1e-12).margin(1e-12));
      }
    }
    REQUIRE(VecRestoreArrayRead(product, &found) == 0);
  }
}

TEST_CASE("the matrix has no more room than its entries take, and the bytes told of it are theirs", "[row_pattern]") {
  const HeldNetwork at(cube);
  RowPattern pattern;
  pattern.create(at.net);
  MatHandle J;
  MatInfo info;
  REQUIRE(pattern.create_matrix(at.net, J.out()) == 0);
  REQUIRE(MatGetInfo(J, MAT_LOCAL, &info) == 0);
  const double rows = 3.0 * static_cast<double>(at.net.n), entries = 2 * rows + 18.0 * static_cast<double>(pattern.blocks());
  CHECK(info.nz_used == entries);
  CHECK(info.nz_allocated == entries);
  CHECK(pattern.jacobian_bytes(3) == entries * (sizeof(PetscScalar) + sizeof(PetscInt)) + 2 * rows * sizeof(PetscInt));
}
