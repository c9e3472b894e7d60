// Springs that are left out: those of the smallest numbers, on any number of ranks, and the angle springs along them. Particles that then bear
// nothing: against a plain search, particle by particle.
#include "input/dilution.hpp"
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include "base/collective.hpp"
#include "base/hash.hpp"

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

/// The same with a rule for particles, and another seed.
GeneratorSpec pruned(LatticeType type, std::vector<I> size, double fraction, PruneRule rule, const char* periodic = "") {
  GeneratorSpec s = spec_of(type, std::move(size), fraction, periodic);
  s.prune = rule;
  s.seed = 3;
  return s;
}

/// The largest determinant of d ways among `ways`, over the product of their lengths: 0 where they do not span; of fewer than d ways the same of
/// their plane.
bool can_balance(const std::vector<std::vector<double>>& ways) {
  if (ways.size() < 2) return false;
  const std::size_t d = ways[0].size();
  if (ways.size() > d) return true;
  // Gram's determinant
  std::vector<std::vector<double>> g(ways.size(), std::vector<double>(ways.size()));
  double scale = 1;
  for (std::size_t a = 0; a < ways.size(); ++a)
    for (std::size_t b = 0; b < ways.size(); ++b)
      for (std::size_t k = 0; k < d; ++k) g[a][b] += ways[a][k] * ways[b][k];
  for (std::size_t a = 0; a < ways.size(); ++a) scale *= g[a][a];
  const double det = ways.size() == 2 ? g[0][0] * g[1][1] - g[0][1] * g[1][0]
                                      : g[0][0] * (g[1][1] * g[2][2] - g[1][2] * g[2][1]) - g[0][1] * (g[1][0] * g[2][2] - g[1][2] * g[2][0]) +
                                            g[0][2] * (g[1][0] * g[2][1] - g[1][1] * g[2][0]);
  return std::abs(det) < 1e-12 * scale;
}

/// Rows of the particles that stay, by looking at all of them until nothing changes.
std::set<I> search(const GeneratorSpec& spec, const Lattice& l, const std::vector<I>& pairs, const std::vector<I>& shift) {
  const std::size_t d = static_cast<std::size_t>(l.dim);
  std::set<I> stay;
  for (I p = 0; p < l.particles.total; ++p) stay.insert(p);
  for (bool changed = true; changed;) {
    changed = false;
    for (I p = 0; p < l.particles.total; ++p) {
      const bool grouped = !l.groups.empty() && l.groups[0].member[static_cast<std::size_t>(p)];
      if (!stay.count(p) || l.fixed[static_cast<std::size_t>(p)] || grouped) continue;
      std::vector<std::vector<double>> ways;
      for (std::size_t s = 0; 2 * s < pairs.size(); ++s)
        for (std::size_t end = 0; end < 2; ++end) {
          if (pairs[2 * s + end] != p || !stay.count(pairs[2 * s + 1 - end])) continue;
          std::vector<double> way(d);
          for (std::size_t k = 0; k < d; ++k) {
            way[k] = l.position[static_cast<std::size_t>(pairs[2 * s + 1]) * d + k] - l.position[static_cast<std::size_t>(pairs[2 * s]) * d + k];
            if (!shift.empty()) way[k] += static_cast<double>(shift[s * d + k]) * l.box.edges[k * d + k];
          }
          ways.push_back(way);
        }
      if (spec.prune == PruneRule::dangling ? ways.size() > 1 : can_balance(ways)) continue;
      stay.erase(p);
      changed = true;
    }
  }
  return stay;
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

TEST_CASE("particles that bear nothing are left out, the others are numbered anew", "[prune]") {
  I went = 0;
  for (const PruneRule rule : {PruneRule::dangling, PruneRule::rattlers})
    for (GeneratorSpec spec : {pruned(LatticeType::triangular, {9, 8}, 0.45, rule, "xy"), pruned(LatticeType::triangular, {9, 8}, 0.5, rule),
                               pruned(LatticeType::square, {7, 7}, 0.3, rule), pruned(LatticeType::honeycomb, {4, 4}, 0.2, rule),
                               pruned(LatticeType::cubic, {4, 4, 4}, 0.6, rule, "z"), pruned(LatticeType::diamond, {2, 3, 2}, 0.15, rule, "xyz"),
                               pruned(LatticeType::square, {2, 6}, 0.2, rule, "x")}) {
      spec.fixed = {"xmin"};
      GroupSpec some;
      some.name = "some";
      some.ranges = {{5, 9}};
      spec.groups = {some};
      spec.velocity = {1, 2};
      if (spec.type == LatticeType::square) {
        spec.neighbors = 4;
        spec.angle_stiffness = 1;
      }
      const Lattice whole = generate(spec, 0, 1);
      Lattice l = generate(spec, rank_of(world), size_of(world));
      REQUIRE(remove_springs(world, spec, &l) == 0);
      const std::vector<I> pairs = everywhere(l.pairs), shift = everywhere(l.shift),
                           angles = l.interactions.empty() ? std::vector<I>() : everywhere(l.interactions[0].ends);
      const std::set<I> stay = search(spec, whole, pairs, shift);
      REQUIRE(prune_particles(world, spec, &l) == 0);
      CAPTURE(l.source);
      went += whole.particles.total - static_cast<I>(stay.size());
      CHECK(everywhere(l.id) == std::vector<I>(stay.begin(), stay.end()));
      CHECK(l.particles.count == split_rows(static_cast<I>(stay.size()), rank_of(world), size_of(world)).count);
      const auto row_now = [&](I row) { return static_cast<I>(std::distance(stay.begin(), stay.find(row))); };
      std::vector<I> left, left_angles;
      for (std::size_t s = 0; 2 * s < pairs.size(); ++s)
        if (stay.count(pairs[2 * s]) && stay.count(pairs[2 * s + 1])) left.insert(left.end(), {row_now(pairs[2 * s]), row_now(pairs[2 * s + 1])});
      for (std::size_t a = 0; 3 * a < angles.size(); ++a)
        if (std::all_of(&angles[3 * a], &angles[3 * a] + 3, [&](I end) { return stay.count(end) > 0; }))
          for (std::size_t e = 0; e < 3; ++e) left_angles.push_back(row_now(angles[3 * a + e]));
      CHECK(everywhere(l.pairs) == left);
      CHECK(everywhere(l.stiffness).size() * 2 == left.size());
      if (!l.interactions.empty()) CHECK(everywhere(l.interactions[0].ends) == left_angles);
      const std::size_t d = static_cast<std::size_t>(l.dim);
      const std::vector<double> position = everywhere(l.position), velocity = everywhere(l.velocity), mass = everywhere(l.mass);
      const std::vector<std::uint8_t> fixed = everywhere(l.fixed), member = everywhere(l.groups[0].member);
      std::size_t p = 0;
      bool same = position.size() == d * stay.size() && mass.size() == stay.size();
      for (const I row : stay) {
        const std::size_t r = static_cast<std::size_t>(row);
        same = same && fixed[p] == whole.fixed[r] && member[p] == whole.groups[0].member[r] && mass[p] == whole.mass[r];
        for (std::size_t k = 0; k < d; ++k)
          same = same && position[p * d + k] == whole.position[r * d + k] && velocity[p * d + k] == whole.velocity[r * d + k];
        ++p;
      }
      CHECK(same);
    }
  CHECK(went > 50);
}
