// Lattices: counts against closed formulas, springs against a search by distance, chunks against the whole.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <vector>

#include "base/hash.hpp"
#include "lattice/generator.hpp"

using namespace bs;
using I = std::int64_t;

namespace {

GeneratorSpec make(LatticeType type, std::vector<I> size, int neighbors = 0, int dim = 0) {
  GeneratorSpec s;
  s.type = type;
  s.size = std::move(size);
  s.neighbors = neighbors;
  s.dim = dim;
  return s;
}

double distance(const Lattice& l, I i, I j) {
  double r2 = 0;
  for (int k = 0; k < l.dim; ++k) {
    const double dx = l.position[static_cast<std::size_t>(i * l.dim + k)] - l.position[static_cast<std::size_t>(j * l.dim + k)];
    r2 += dx * dx;
  }
  return std::sqrt(r2);
}

template <class T>
void append(std::vector<T>* all, const std::vector<T>& part) {
  all->insert(all->end(), part.begin(), part.end());
}

/// The whole lattice put together from `ranks` chunks.
Lattice gather(const GeneratorSpec& spec, int ranks) {
  Lattice all;
  I rows = 0;
  for (int r = 0; r < ranks; ++r) {
    const Lattice part = generate(spec, r, ranks);
    REQUIRE(part.particles.first == rows);
    REQUIRE(part.particles.total == particle_count(spec));
    REQUIRE(static_cast<I>(part.mass.size()) == part.particles.count);
    REQUIRE(static_cast<I>(part.pairs.size()) == 2 * part.springs.count);
    for (std::size_t s = 0; s < part.pairs.size(); s += 2) {
      REQUIRE(part.pairs[s] >= rows);
      REQUIRE(part.pairs[s] < rows + part.particles.count);
    }
    rows += part.particles.count;
    append(&all.position, part.position);
    append(&all.velocity, part.velocity);
    append(&all.mass, part.mass);
    all.particle_columns.resize(part.particle_columns.size());
    for (std::size_t c = 0; c < part.particle_columns.size(); ++c) append(&all.particle_columns[c].value, part.particle_columns[c].value);
    append(&all.fixed, part.fixed);
    append(&all.pairs, part.pairs);
    append(&all.stiffness, part.stiffness);
    append(&all.rest_length, part.rest_length);
    append(&all.damping, part.damping);
    all.dim = part.dim;
  }
  REQUIRE(rows == particle_count(spec));
  return all;
}

struct Sample {
  GeneratorSpec spec;
  std::vector<double> shells;  ///< distances that carry a spring, spacing 1
};

std::vector<Sample> samples() {
  const double r2 = std::sqrt(2.0), r3 = std::sqrt(3.0);
  return {{make(LatticeType::chain, {7}), {1}},
          {make(LatticeType::chain, {6}, 2, 3), {1}},
          {make(LatticeType::chain, {1}, 0, 2), {1}},
          {make(LatticeType::square, {5, 4}, 4), {1}},
          {make(LatticeType::square, {4, 6}, 8, 3), {1, r2}},
          {make(LatticeType::triangular, {5, 6}), {1}},
          {make(LatticeType::triangular, {4, 5}, 6, 3), {1}},
          {make(LatticeType::triangular, {4, 1}), {1}},
          {make(LatticeType::cloth, {5, 7}, 4), {1}},
          {make(LatticeType::cloth, {5, 7}, 8), {1, r2}},
          {make(LatticeType::cloth, {6, 4}, 12, 2), {1, r2, 2}},
          {make(LatticeType::cloth, {2, 5}), {1, r2, 2}},
          {make(LatticeType::cubic, {4, 3, 5}, 6), {1}},
          {make(LatticeType::cubic, {4, 3, 5}, 18), {1, r2}},
          {make(LatticeType::cubic, {3, 4, 3}, 26), {1, r2, r3}},
          {make(LatticeType::bcc, {3, 4, 2}, 8), {r3 / 2}},
          {make(LatticeType::bcc, {3, 2, 4}, 14), {r3 / 2, 1}},
          {make(LatticeType::fcc, {3, 2, 4}, 12), {r2 / 2}},
          {make(LatticeType::fcc, {2, 3, 3}, 18), {r2 / 2, 1}},
          {make(LatticeType::kagome, {3, 4}), {1}},
          {make(LatticeType::kagome, {4, 3}, 8, 3), {1, r3}},
          {make(LatticeType::honeycomb, {4, 3}), {1}},
          {make(LatticeType::honeycomb, {1, 4}), {1}},
          {make(LatticeType::honeycomb, {3, 4}, 9), {1, r3}},
          {make(LatticeType::honeycomb, {3, 4}, 12, 3), {1, r3, 2}},
          {make(LatticeType::diamond, {3, 2, 4}), {r3 / 4}},
          {make(LatticeType::diamond, {2, 3, 2}, 16), {r3 / 4, r2 / 2}}};
}

}  // namespace

TEST_CASE("springs join exactly the pairs at the shells' distances", "[generator]") {
  for (Sample s : samples()) {
    const double a = 0.3;
    s.spec.spacing = {a};
    s.spec.origin = std::vector<double>(static_cast<std::size_t>(dimension(s.spec)), -1.7);
    s.spec.stiffness = {100, 200, 300};
    s.spec.damping = {1, 2};
    s.spec.rest_length_factor = 0.9;
    REQUIRE(check(s.spec).empty());
    const Lattice l = generate(s.spec, 0, 1);
    CAPTURE(l.source, l.dim);
    std::map<std::pair<I, I>, std::size_t> expected;  // pair -> shell
    for (I i = 0; i < l.particles.total; ++i)
      for (I j = i + 1; j < l.particles.total; ++j)
        for (std::size_t k = 0; k < s.shells.size(); ++k)
          if (std::abs(distance(l, i, j) - a * s.shells[k]) < 1e-6) expected[{i, j}] = k;
    REQUIRE(static_cast<std::size_t>(l.springs.count) == expected.size());
    auto e = expected.begin();  // both in ascending order
    for (std::size_t p = 0; p < l.stiffness.size(); ++p, ++e) {
      REQUIRE(l.pairs[2 * p] == e->first.first);
      REQUIRE(l.pairs[2 * p + 1] == e->first.second);
      REQUIRE(l.stiffness[p] == 100.0 * static_cast<double>(e->second + 1));
      REQUIRE(l.damping[p] == (e->second == 0 ? 1.0 : 2.0));
      REQUIRE(l.rest_length[p] == Approx(0.9 * distance(l, l.pairs[2 * p], l.pairs[2 * p + 1])).epsilon(1e-13));
    }
  }
}

TEST_CASE("an inner particle has the neighbours its lattice is named by", "[generator]") {
  for (const Sample& s : samples()) {
    GeneratorSpec spec = s.spec;
    spec.size = {7};
    const Lattice l = generate(spec, 0, 1);
    std::vector<int> degree(static_cast<std::size_t>(l.particles.total), 0);
    for (const I end : l.pairs) ++degree[static_cast<std::size_t>(end)];
    const int most = *std::max_element(degree.begin(), degree.end());
    CHECK(most == (spec.neighbors ? spec.neighbors : type_info(spec.type).neighbors_default));
  }
}

TEST_CASE("numbers of particles and springs follow the closed formulas", "[generator]") {
  const I x = 6, y = 5, z = 4;
  const I axis = (x - 1) * y * z + x * (y - 1) * z + x * y * (z - 1);
  const I face = 2 * ((x - 1) * (y - 1) * z + (x - 1) * y * (z - 1) + x * (y - 1) * (z - 1));
  const I body = 4 * (x - 1) * (y - 1) * (z - 1);
  const I structural = (x - 1) * y + x * (y - 1), shear = 2 * (x - 1) * (y - 1), bend = (x - 2) * y + x * (y - 2);
  struct Row {
    GeneratorSpec spec;
    I particles, springs;
  };
  const std::vector<Row> rows = {
      {make(LatticeType::chain, {x}), x, x - 1},
      {make(LatticeType::chain, {1}), 1, 0},
      {make(LatticeType::square, {x, y}, 4), x * y, structural},
      {make(LatticeType::square, {x, y}, 8), x * y, structural + shear},
      // along the rows, and two from each particle to the next row but one at the end of each pair of rows
      {make(LatticeType::triangular, {x, y}), x * y, (x - 1) * y + (2 * x - 1) * (y - 1)},
      {make(LatticeType::cloth, {x, y}), x * y, structural + shear + bend},
      {make(LatticeType::cubic, {x, y, z}, 6), x * y * z, axis},
      {make(LatticeType::cubic, {x, y, z}, 18), x * y * z, axis + face},
      {make(LatticeType::cubic, {x, y, z}, 26), x * y * z, axis + face + body},
      // each body centre but the outer ones has 8 corners; a cell's centre sees the corners of cells up to one further
      {make(LatticeType::bcc, {x, y, z}, 8), 2 * x * y * z, (2 * x - 1) * (2 * y - 1) * (2 * z - 1)},
      {make(LatticeType::bcc, {x, y, z}, 14), 2 * x * y * z, (2 * x - 1) * (2 * y - 1) * (2 * z - 1) + 2 * axis},
      // in each plane of two axes, corners and face centres make a square lattice of half diagonals
      {make(LatticeType::fcc, {x, y, z}, 12), 4 * x * y * z,
       2 * ((2 * x - 1) * (2 * y - 1) * z + (2 * x - 1) * (2 * z - 1) * y + (2 * y - 1) * (2 * z - 1) * x)},
      {make(LatticeType::fcc, {x, y, z}, 18), 4 * x * y * z,
       2 * ((2 * x - 1) * (2 * y - 1) * z + (2 * x - 1) * (2 * z - 1) * y + (2 * y - 1) * (2 * z - 1) * x) + 4 * axis},
      // rows of 2 x particles, two a cell; of the particles between rows one has its four neighbours in its own cell, the
      // other one there and one each in the cells to the right, above, and above to the right
      {make(LatticeType::kagome, {x, y}), 6 * x * y, 2 * y * (2 * x - 1) + 5 * x * y + (x - 1) * y + x * (y - 1) + (x - 1) * (y - 1)},
      // zigzag rows of 2 x particles, two a cell, and upright springs between them
      {make(LatticeType::honeycomb, {x, y}), 4 * x * y, 2 * y * (2 * x - 1) + x * (2 * y - 1)},
      {make(LatticeType::cubic, {40}, 18), 64000, 552240}};
  for (const Row& row : rows) {
    REQUIRE(check(row.spec).empty());
    const Lattice l = generate(row.spec, 0, 1);
    CAPTURE(l.source);
    CHECK(particle_count(row.spec) == row.particles);
    CHECK(l.particles.count == row.particles);
    CHECK(l.springs.count == row.springs);
  }
}

TEST_CASE("a lattice does not depend on the number of ranks", "[generator]") {
  for (Sample s : samples()) {
    s.spec.perturbation = 0.1;
    s.spec.seed = 42;
    s.spec.stiff_fraction = 0.3;
    s.spec.stiff_factor = 50;
    s.spec.fixed = {"xmin"};
    s.spec.fixed_particles = {0, particle_count(s.spec) - 1};
    s.spec.total_mass = 3;
    s.spec.radius = 0.2;
    s.spec.velocity = {1};
    REQUIRE(check(s.spec).empty());
    const Lattice whole = gather(s.spec, 1);
    for (int ranks = 2; ranks <= 5; ++ranks) {
      const Lattice parts = gather(s.spec, ranks);
      CHECK(parts.position == whole.position);
      CHECK(parts.velocity == whole.velocity);
      CHECK(parts.mass == whole.mass);
      REQUIRE((parts.particle_columns.size() == 1 && whole.particle_columns.size() == 1));
      CHECK(parts.particle_columns[0].value == whole.particle_columns[0].value);
      CHECK(parts.fixed == whole.fixed);
      CHECK(parts.pairs == whole.pairs);
      CHECK(parts.stiffness == whole.stiffness);
      CHECK(parts.rest_length == whole.rest_length);
      CHECK(parts.damping == whole.damping);
    }
  }
}

TEST_CASE("a perturbation stays within its amplitude, follows the seed, and leaves fixed particles alone", "[generator]") {
  GeneratorSpec spec = make(LatticeType::cubic, {9, 8, 7});
  const Lattice plain = generate(spec, 0, 1);
  spec.perturbation = 0.25;
  spec.fixed = {"zmin"};
  const Lattice moved = generate(spec, 0, 1);
  CHECK(generate(spec, 0, 1).position == moved.position);
  spec.seed = 2;
  CHECK(generate(spec, 0, 1).position != moved.position);
  double largest = 0, sum = 0, squares = 0;
  int free_components = 0;
  for (std::size_t c = 0; c < plain.position.size(); ++c) {
    const double shift = moved.position[c] - plain.position[c];
    if (moved.fixed[c / 3]) {
      CHECK(shift == 0);
      continue;
    }
    largest = std::max(largest, std::abs(shift));
    sum += shift;
    squares += shift * shift;
    ++free_components;
  }
  CHECK(largest < 0.25 + 1e-14);
  CHECK(largest > 0.24);
  // mean 0 and variance a^2/3 of the uniform distribution, to four standard deviations
  const double n = free_components;
  CHECK(std::abs(sum / n) < 4 * 0.25 / std::sqrt(3 * n));
  CHECK(std::abs(squares / n - 0.0625 / 3) < 4 * 0.0625 * std::sqrt(4.0 / 45 / n));
  CHECK(moved.rest_length == plain.rest_length);
}

TEST_CASE("splitmix64 gives the published numbers", "[generator]") {
  // The sequence of state 0, 1 golden ratio further each: the generator's first outputs from seed 0.
  CHECK(splitmix64(0) == 0xE220A8397B1DCDAFu);
  CHECK(splitmix64(0x9E3779B97F4A7C15u) == 0x6E789E6AA1B965F4u);
  CHECK(splitmix64(2 * 0x9E3779B97F4A7C15u) == 0x06C45D188009454Fu);
}

TEST_CASE("the stiff springs are those the hash names", "[generator]") {
  GeneratorSpec spec = make(LatticeType::cubic, {12}, 18);
  spec.stiffness = {10, 5};
  const Lattice plain = generate(spec, 0, 1);
  spec.stiff_fraction = 0.05;
  spec.stiff_factor = 1e4;
  spec.seed = 7;
  const Lattice some = generate(spec, 0, 1);
  I stiff = 0;
  for (std::size_t p = 0; p < some.stiffness.size(); ++p) {
    const bool named = hash_uniform(7, Stream::stiff_springs, some.pairs[2 * p], some.pairs[2 * p + 1]) < 0.05;
    stiff += named;
    REQUIRE(some.stiffness[p] == plain.stiffness[p] * (named ? 1e4 : 1.0));
  }
  const double n = static_cast<double>(some.springs.count);
  CHECK(std::abs(static_cast<double>(stiff) - 0.05 * n) < 4 * std::sqrt(0.05 * 0.95 * n));
}

TEST_CASE("fixed faces and particles", "[generator]") {
  struct Row {
    GeneratorSpec spec;
    std::vector<std::string> faces;
    I count;
  };
  const std::vector<Row> rows = {{make(LatticeType::chain, {9}), {"xmin"}, 1},
                                 {make(LatticeType::chain, {9}), {"xmin", "xmax"}, 2},
                                 {make(LatticeType::square, {5, 4}), {"ymax"}, 5},
                                 {make(LatticeType::square, {5, 4}), {"xmin", "ymin"}, 5 + 4 - 1},
                                 {make(LatticeType::triangular, {5, 4}), {"xmin"}, 4},
                                 {make(LatticeType::triangular, {5, 1}), {"xmax"}, 1},
                                 {make(LatticeType::triangular, {5, 4}), {"xmax", "ymax"}, 4 + 5 - 1},
                                 {make(LatticeType::cloth, {6, 5}), {"ymin", "ymax"}, 12},
                                 {make(LatticeType::cubic, {4, 5, 6}), {"zmin"}, 20},
                                 {make(LatticeType::cubic, {4, 5, 6}), {"xmax", "ymin"}, 30 + 24 - 6},
                                 {make(LatticeType::bcc, {4, 5, 6}), {"zmax"}, 20},
                                 {make(LatticeType::fcc, {4, 5, 6}), {"xmin"}, 2 * 30},
                                 {make(LatticeType::kagome, {4, 5}), {"xmin"}, 2 * 5},
                                 {make(LatticeType::kagome, {4, 5}), {"ymin", "ymax"}, 2 * 4 + 4},
                                 {make(LatticeType::honeycomb, {4, 5}), {"xmin", "xmax"}, 4 * 5},
                                 {make(LatticeType::honeycomb, {4, 5}), {"ymin"}, 4},
                                 {make(LatticeType::diamond, {4, 5, 6}), {"zmin"}, 2 * 20},
                                 {make(LatticeType::diamond, {4, 5, 6}), {"xmax"}, 2 * 30}};
  for (const Row& row : rows) {
    GeneratorSpec spec = row.spec;
    spec.fixed = row.faces;
    spec.spacing = {1e-3};
    spec.origin = {1e4};
    spec.velocity = {1};
    REQUIRE(check(spec).empty());
    const Lattice l = generate(spec, 0, 1);
    CAPTURE(l.source, row.faces);
    CHECK(std::count(l.fixed.begin(), l.fixed.end(), 1) == row.count);
    for (std::size_t p = 0; p < l.fixed.size(); ++p) REQUIRE(l.velocity[p * static_cast<std::size_t>(l.dim)] == (l.fixed[p] ? 0.0 : 1.0));
  }
  GeneratorSpec spec = make(LatticeType::chain, {9});
  spec.fixed_particles = {4, 0, 4};
  CHECK(generate(spec, 0, 1).fixed == std::vector<std::uint8_t>{1, 0, 0, 0, 1, 0, 0, 0, 0});
}

TEST_CASE("positions are numbered x fastest", "[generator]") {
  GeneratorSpec spec = make(LatticeType::cubic, {3, 4, 2});
  spec.spacing = {2, 3, 5};
  spec.origin = {0.5, -1};
  const Lattice l = generate(spec, 0, 1);
  for (I z = 0; z < 2; ++z)
    for (I y = 0; y < 4; ++y)
      for (I x = 0; x < 3; ++x) {
        const std::size_t p = static_cast<std::size_t>((z * 4 + y) * 3 + x);
        CHECK(l.position[3 * p] == Approx(0.5 + 2.0 * static_cast<double>(x)));
        CHECK(l.position[3 * p + 1] == Approx(-1 + 3.0 * static_cast<double>(y)));
        CHECK(l.position[3 * p + 2] == Approx(5.0 * static_cast<double>(z)));
      }
  for (std::size_t p = 0; p < l.rest_length.size(); ++p) CHECK(l.rest_length[p] == Approx(distance(l, l.pairs[2 * p], l.pairs[2 * p + 1])));
}

TEST_CASE("a skew velocity field is a rigid motion, and momentum is mass times the centre's velocity", "[generator]") {
  GeneratorSpec spec = make(LatticeType::fcc, {3, 2, 2});
  spec.total_mass = 7;
  spec.origin = {1, 2, 3};
  spec.velocity = {0.5, -0.25, 2};
  spec.velocity_gradient = {0, -3, 2, 3, 0, -1, -2, 1, 0};  // A x = (1, 2, 3) x x
  REQUIRE(check(spec).empty());
  const Lattice l = generate(spec, 0, 1);
  for (std::size_t p = 0; p < l.stiffness.size(); ++p) {
    double rate = 0;  // d.dv: no spring changes its length
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = static_cast<std::size_t>(3 * l.pairs[2 * p]) + k, j = static_cast<std::size_t>(3 * l.pairs[2 * p + 1]) + k;
      rate += (l.position[i] - l.position[j]) * (l.velocity[i] - l.velocity[j]);
    }
    REQUIRE(std::abs(rate) < 1e-12);
  }
  double mass = 0, center[3] = {}, momentum[3] = {};
  for (std::size_t p = 0; p < l.mass.size(); ++p) {
    mass += l.mass[p];
    for (std::size_t k = 0; k < 3; ++k) {
      center[k] += l.mass[p] * l.position[3 * p + k] / 7;
      momentum[k] += l.mass[p] * l.velocity[3 * p + k];
    }
  }
  CHECK(mass == Approx(7).epsilon(1e-14));
  // p = M (u + w x X), w = (1, 2, 3)
  CHECK(momentum[0] == Approx(7 * (0.5 + 2 * center[2] - 3 * center[1])));
  CHECK(momentum[1] == Approx(7 * (-0.25 + 3 * center[0] - 1 * center[2])));
  CHECK(momentum[2] == Approx(7 * (2.0 + 1 * center[1] - 2 * center[0])));
}
