// Springs that are left out: those of the smallest numbers, on any number of ranks, and the angle springs along them.
#include "input/dilution.hpp"
#include <algorithm>
#include <catch2/catch.hpp>
#include <set>
#include "base/collective.hpp"
#include "input/remote.hpp"
#include "lattice/random.hpp"

using namespace bs;
using I = std::int64_t;

namespace {

MPI_Comm const world = MPI_COMM_WORLD;  // NOLINT(misc-misplaced-const): the handle is constant

template <class T>
std::vector<T> everywhere(const std::vector<T>& mine) {
  std::vector<T> all;
  REQUIRE(gather_all(world, mine, &all) == 0);
  return all;
}

GeneratorSpec spec_of(LatticeType type, std::vector<I> size, double fraction, const char* periodic = "") {
  GeneratorSpec s;
  s.type = type;
  s.size = std::move(size);
  s.remove_fraction = fraction;
  s.periodic = periodic;
  s.seed = 11;
  return s;
}

Lattice diluted(const GeneratorSpec& spec) {
  Lattice l = generate(spec, rank_of(world), size_of(world));
  REQUIRE(remove_springs(world, spec, &l) == 0);
  return l;
}

/// Rows of the springs of the whole lattice by the numbers drawn for them, smallest first.
std::vector<I> by_number(const GeneratorSpec& spec, I springs) {
  std::vector<std::pair<double, I>> all;
  for (I s = 0; s < springs; ++s) all.emplace_back(hash_uniform(spec.seed, Stream::removal, s, 0), s);
  std::sort(all.begin(), all.end());
  std::vector<I> rows;
  for (const auto& [number, row] : all) rows.push_back(row);
  return rows;
}

}  // namespace

TEST_CASE("the springs of the smallest numbers are left out, exactly as many as asked for", "[dilution]") {
  for (const double fraction : {1e-9, 0.001, 0.25, 0.34, 0.5, 0.999, 1.0})
    for (GeneratorSpec spec : {spec_of(LatticeType::triangular, {9, 8}, fraction, "xy"), spec_of(LatticeType::kagome, {3, 3}, fraction),
                               spec_of(LatticeType::cubic, {4, 3, 5}, fraction, "z"), spec_of(LatticeType::chain, {1}, fraction)}) {
      spec.stiffness = {1, 2, 3};
      const Lattice whole = generate(spec, 0, 1), left = diluted(spec);
      std::vector<I> rows = by_number(spec, whole.springs.count);
      rows.erase(rows.begin(), rows.begin() + std::llround(fraction * static_cast<double>(whole.springs.count)));
      std::sort(rows.begin(), rows.end());
      std::vector<I> pairs;
      std::vector<double> stiffness, rest;
      for (const I r : rows) {
        const std::size_t s = static_cast<std::size_t>(r);
        pairs.insert(pairs.end(), {whole.pairs[2 * s], whole.pairs[2 * s + 1]});
        stiffness.push_back(whole.stiffness[s]);
        rest.push_back(whole.rest_length[s]);
      }
      CAPTURE(left.source, fraction);
      CHECK(left.springs.total == static_cast<I>(rows.size()));
      CHECK(everywhere(left.pairs) == pairs);
      CHECK(everywhere(left.stiffness) == stiffness);
      CHECK(everywhere(left.rest_length) == rest);
      CHECK(everywhere(left.shift).size() == (spec.periodic.empty() ? 0 : rows.size() * static_cast<std::size_t>(left.dim)));
    }
}

TEST_CASE("each spring is left out with the probability asked for", "[dilution]") {
  GeneratorSpec spec = spec_of(LatticeType::cubic, {12}, 0.3);
  spec.remove_each = true;
  const I springs = generate(spec, 0, 1).springs.count;
  I stay = 0;
  for (I s = 0; s < springs; ++s) stay += hash_uniform(spec.seed, Stream::removal, s, 0) >= 0.3;
  const Lattice left = diluted(spec);
  CHECK(left.springs.total == stay);
  CHECK(std::abs(static_cast<double>(stay) - 0.7 * static_cast<double>(springs)) < 4 * std::sqrt(0.21 * static_cast<double>(springs)));
  CHECK_THAT(left.source, Catch::Contains(" of " + std::to_string(springs) + " springs removed"));
}

TEST_CASE("angle springs lie along springs that are there", "[dilution]") {
  for (GeneratorSpec spec : {spec_of(LatticeType::square, {6, 5}, 0.3), spec_of(LatticeType::square, {6, 5}, 0.3, "xy"),
                             spec_of(LatticeType::cubic, {4, 4, 4}, 0.2, "y"), spec_of(LatticeType::square, {2, 5}, 0.3, "x")}) {
    spec.neighbors = spec.type == LatticeType::square ? 4 : 6;
    spec.angle_stiffness = 1;
    const Lattice whole = generate(spec, 0, 1), left = diluted(spec);
    const std::vector<I> pairs = everywhere(left.pairs), shift = everywhere(left.shift);
    const std::size_t d = static_cast<std::size_t>(whole.dim);
    std::multiset<std::vector<I>> there;  // both ways of every spring
    for (std::size_t s = 0; 2 * s < pairs.size(); ++s) {
      std::vector<I> up{pairs[2 * s], pairs[2 * s + 1]}, down{pairs[2 * s + 1], pairs[2 * s]};
      for (std::size_t k = 0; k < d; ++k) {
        up.push_back(shift.empty() ? 0 : shift[s * d + k]);
        down.push_back(-up.back());
      }
      there.insert(up);
      there.insert(down);
    }
    std::vector<I> expected;
    const InteractionRows& all = whole.interactions[0];
    for (std::size_t a = 0; 3 * a < all.ends.size(); ++a) {
      bool along = true;
      for (std::size_t e = 3 * a; e < 3 * a + 2; ++e) {
        std::vector<I> leg{all.ends[e], all.ends[e + 1]};
        for (std::size_t k = 0; k < d; ++k) leg.push_back(all.shift.empty() ? 0 : all.shift[(e + 1) * d + k] - all.shift[e * d + k]);
        along = along && there.count(leg);
      }
      if (along) expected.insert(expected.end(), &all.ends[3 * a], &all.ends[3 * a] + 3);
    }
    CHECK(everywhere(left.interactions[0].ends) == expected);
    CHECK(expected.size() < all.ends.size());
    CHECK(left.interactions[0].parameter.size() == 2 * static_cast<std::size_t>(left.interactions[0].rows.count));
  }
}
