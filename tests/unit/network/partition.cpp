// Which rank each particle goes to, and which of other ranks it needs: against counts and lists that every rank makes of the whole lattice.
#include "network/partition.hpp"
#include <algorithm>
#include <catch2/catch.hpp>
#include <set>
#include "held_network.hpp"
#include "input/remote.hpp"
#include "small_network.hpp"

using namespace bs;

namespace {

/// The rank of every row of the lattice, on every rank.
std::vector<int> ranks_of(const GeneratorSpec& spec, int kind, std::string* used) {
  const Lattice part = chunk_of_lattice(PETSC_COMM_WORLD, spec);
  RowGraph graph;
  std::vector<int> here;
  REQUIRE(partition_rows(PETSC_COMM_WORLD, part, &graph, kind, &here, used) == 0);
  REQUIRE(static_cast<std::int64_t>(here.size()) == part.particles.count);
  std::vector<int> all(static_cast<std::size_t>(part.particles.total), 0);
  std::copy(here.begin(), here.end(), all.begin() + part.particles.first);
  MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  return all;
}

}  // namespace

TEST_CASE("every particle goes to one rank, in equal shares by coordinates and by rows", "[partition]") {
  const int size = size_of(PETSC_COMM_WORLD);
  for (const std::int64_t length : {std::int64_t{50}, std::int64_t{51}, std::int64_t{4}})
    for (const int kind : {1, 2}) {
      std::string used;
      const std::vector<int> rank = ranks_of(lattice(LatticeType::chain, {length}, 1), kind, &used);
      CHECK(used == (size == 1 ? "one rank" : kind == 1 ? "coordinate bisection" : "rows"));
      std::vector<std::int64_t> count(static_cast<std::size_t>(size), 0);
      for (const int r : rank) {
        REQUIRE((r >= 0 && r < size));
        ++count[static_cast<std::size_t>(r)];
      }
      CAPTURE(length, kind);
      CHECK(*std::max_element(count.begin(), count.end()) - *std::min_element(count.begin(), count.end()) <= 1);
      CHECK(std::is_sorted(rank.begin(), rank.end()));  // parts of a chain are intervals of it
    }
}

TEST_CASE("parts by coordinates are intervals along the longest side", "[partition]") {
  const int size = size_of(PETSC_COMM_WORLD);
  std::string used;
  for (const bool upright : {false, true}) {
    const std::vector<std::int64_t> shape = upright ? std::vector<std::int64_t>{3, 12} : std::vector<std::int64_t>{12, 3};
    const std::vector<int> rank = ranks_of(lattice(LatticeType::square, shape, 2), 1, &used);
    for (std::int64_t row = 0; row < 36; ++row) {
      const std::int64_t along = upright ? row / 3 : row % 12;
      CHECK(rank[static_cast<std::size_t>(row)] == along * size / 12);
    }
  }
}

TEST_CASE("the graph is used where there are several ranks, particles enough, and nothing else is asked for", "[partition]") {
  Lattice l;
  for (const int size : {2, 3}) {
    l.particles = {0, 0, 8 * size};
    const bool possible = needs_graph(l, 0, size);
    CHECK_FALSE((needs_graph(l, 1, size) || needs_graph(l, 2, size)));
    l.particles.total -= 1;
    CHECK_FALSE(needs_graph(l, 0, size));
    l.particles.total = 1000000;
    CHECK(needs_graph(l, 0, size) == possible);
    CHECK_FALSE(needs_graph(l, 0, 1));
  }
}

TEST_CASE("where no graph is cut though one would be, the reason is told", "[partition]") {
  const int size = size_of(PETSC_COMM_WORLD);
  for (const std::int64_t length : {8 * size, 8 * size - 1}) {
    const GeneratorSpec chain = lattice(LatticeType::chain, {length}, 1);
    if (needs_graph(chunk_of_lattice(PETSC_COMM_WORLD, chain), 0, size)) continue;
    std::string used;
    ranks_of(chain, 0, &used);
    CAPTURE(length, used);
    const bool told = used.rfind("coordinate bisection (the PTScotch", 0) == 0 || used.rfind("coordinate bisection (this PETSc has", 0) == 0;
    CHECK(told == (size > 1 && length == 8 * size));
    CHECK((told || used == (size == 1 ? "one rank" : "coordinate bisection")));
  }
}

TEST_CASE("parts of a graph have equal shares of the work, not of the particles", "[partition]") {
  // a long row of 600 particles beside a block of 9 x 9 x 9 whose particles have up to 18 springs each
  const int size = size_of(PETSC_COMM_WORLD), rank = rank_of(PETSC_COMM_WORLD);
  Lattice whole = generate(lattice(LatticeType::chain, {600}, 3), 0, 1);
  GeneratorSpec spec = lattice(LatticeType::cubic, {9, 9, 9}, 3);
  spec.neighbors = 18;
  const Lattice block = generate(spec, 0, 1);
  for (const std::int64_t end : block.pairs) whole.pairs.push_back(end + 600);
  for (const double x : block.position) whole.position.push_back(x + 2);
  const auto append = [](auto* to, const auto& from) { to->insert(to->end(), from.begin(), from.end()); };
  append(&whole.velocity, block.velocity);
  append(&whole.mass, block.mass);
  append(&whole.fixed, block.fixed);
  append(&whole.stiffness, block.stiffness);
  append(&whole.rest_length, block.rest_length);
  append(&whole.damping, block.damping);
  const std::int64_t particles = 600 + 729, springs = static_cast<std::int64_t>(whole.pairs.size()) / 2;
  whole.particles = {0, particles, particles};
  whole.springs = {0, springs, springs};
  Network net;
  REQUIRE(build_network(PETSC_COMM_WORLD, chunk_of(whole, rank, size), NetworkOptions(), &net) == 0);
  if (net.partition.rfind("graph", 0) != 0) return;
  double work = 12.0 * static_cast<double>(net.n) + static_cast<double>(net.links.other.size()), most = work, sum = work;
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(most <= 1.05 * sum / size);
}

TEST_CASE("ghosts are the particles that springs of owned ones need, once each, and no others", "[partition]") {
  for (const char* partition : {"graph", "geometric", "rows"})
    for (const bool periodic : {false, true}) {
      OptionTexts texts = {{"-bs_lattice_type", "square"},
                           {"-bs_lattice_size", "7,6"},
                           {"-bs_lattice_fixed_particles", "3,20"},
                           {"-bs_lattice_perturbation", "0.1"},
                           {"-bs_partition", partition}};
      if (periodic) texts["-bs_lattice_periodic"] = "xy";
      const HeldNetwork at(texts);
      const Network& net = at.net;
      CAPTURE(partition, periodic);
      GeneratorSpec spec = lattice(LatticeType::square, {7, 6}, 2);
      spec.perturbation = 0.1;
      spec.fixed_particles = {3, 20};
      spec.periodic = periodic ? "xy" : "";
      const Lattice whole = generate(spec, 0, 1);
      std::vector<std::int64_t> row(static_cast<std::size_t>(net.total), 0), owner(row);
      for (PetscInt i = 0; i < net.n; ++i) {
        row[static_cast<std::size_t>(net.first + i)] = net.row[static_cast<std::size_t>(i)];
        owner[static_cast<std::size_t>(net.row[static_cast<std::size_t>(i)])] = 1 + rank_of(PETSC_COMM_WORLD);
      }
      MPI_Allreduce(MPI_IN_PLACE, row.data(), static_cast<int>(row.size()), MPI_INT64_T, MPI_SUM, PETSC_COMM_WORLD);
      MPI_Allreduce(MPI_IN_PLACE, owner.data(), static_cast<int>(owner.size()), MPI_INT64_T, MPI_SUM, PETSC_COMM_WORLD);
      using Place = std::vector<std::int64_t>;  // row, box along x, box along y
      std::set<Place> needed, found;
      // a spring goes the shortest way: springs of this lattice span one cell at most
      const auto shift = [](std::int64_t a, std::int64_t b) { return std::abs(b - a) <= 1 ? 0 : b > a ? -1 : 1; };
      const int mine = 1 + rank_of(PETSC_COMM_WORLD);
      for (std::size_t k = 0; k < whole.pairs.size(); ++k) {
        const std::int64_t a = whole.pairs[k], b = whole.pairs[k ^ 1];
        if (owner[static_cast<std::size_t>(a)] != mine) continue;
        const Place place{b, shift(a % 7, b % 7), shift(a / 7, b / 7)};
        if (owner[static_cast<std::size_t>(b)] != mine || place[1] != 0 || place[2] != 0) needed.insert(place);
      }
      for (PetscInt g = 0; g < net.ghosts; ++g) {
        const std::size_t i = static_cast<std::size_t>(net.n + g);
        Place place{row[static_cast<std::size_t>(net.global[i])], 0, 0};
        for (std::size_t k = 0; periodic && k < 2; ++k) place[1 + k] = net.image[2 * static_cast<std::size_t>(g) + k];
        CHECK(found.insert(place).second);
      }
      CHECK(found == needed);
      for (std::size_t i = 0; i < net.global.size(); ++i) {
        const std::size_t r = static_cast<std::size_t>(row[static_cast<std::size_t>(net.global[i])]);
        CHECK(net.fixed[i] == (r == 3 || r == 20));
        CHECK((net.held[2 * i] == whole.position[2 * r] && net.held[2 * i + 1] == whole.position[2 * r + 1]));
      }
    }
}
