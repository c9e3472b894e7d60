// Angle springs of generated lattices.
#include <catch2/catch.hpp>
#include "lattice/generator.hpp"
#include "small_network.hpp"

using namespace bs;

TEST_CASE("generated angle springs join three neighbours along each axis, whatever the ranks", "[generator]") {
  GeneratorSpec spec = lattice(LatticeType::square, {4, 3}, 2);
  spec.angle_stiffness = 5;
  spec.rest_angle = 3;
  // rows count along x first: 0 1 2 3 / 4 5 6 7 / 8 9 10 11
  const std::vector<std::int64_t> expected = {0, 1, 2, 0, 4, 8, 1, 2, 3, 1, 5, 9, 2, 6, 10, 3, 7, 11, 4, 5, 6, 5, 6, 7, 8, 9, 10, 9, 10, 11};
  for (const int size : {1, 2, 3, 5}) {
    std::vector<std::int64_t> found;
    for (int rank = 0; rank < size; ++rank) {
      const Lattice part = generate(spec, rank, size);
      REQUIRE(part.interactions.size() == 1);
      const InteractionRows& rows = part.interactions[0];
      CHECK(rows.rows.count * 3 == static_cast<std::int64_t>(rows.ends.size()));
      REQUIRE(rows.parameter.size() == 2 * rows.ends.size() / 3);
      for (std::size_t k = 0; k < rows.parameter.size(); ++k) CHECK(rows.parameter[k] == (k % 2 ? 3 : 5));
      found.insert(found.end(), rows.ends.begin(), rows.ends.end());
    }
    CHECK(found == expected);
  }
  spec.angle_stiffness = 0;
  CHECK(generate(spec, 0, 1).interactions.empty());
  CHECK_FALSE(check(spec).empty());
}

TEST_CASE("angle springs lie on all straight lines of nearest neighbours", "[generator]") {
  const std::pair<LatticeType, std::int64_t> lines[] = {
      {LatticeType::chain, 1}, {LatticeType::square, 2}, {LatticeType::triangular, 3}, {LatticeType::cloth, 2},     {LatticeType::cubic, 3},
      {LatticeType::bcc, 4},   {LatticeType::fcc, 6},    {LatticeType::kagome, 2},     {LatticeType::honeycomb, 0}, {LatticeType::diamond, 0}};
  for (const auto& [type, count] : lines) {
    GeneratorSpec spec = lattice(type, {4}, type == LatticeType::chain ? 2 : 0);
    spec.size.assign(static_cast<std::size_t>(type_info(type).axes), 4);
    spec.periodic = std::string("xyz").substr(0, spec.size.size());
    spec.angle_stiffness = 2;
    CHECK(has_lines(type) == (count > 0));
    CHECK(check(spec).empty() == (count > 0));
    const Lattice whole = generate(spec, 0, 1);
    CHECK(whole.interactions[0].rows.count == count * particle_count(spec));
  }
}

TEST_CASE("of an open triangular lattice rows of n have n - 2 angle springs", "[generator]") {
  GeneratorSpec spec = lattice(LatticeType::triangular, {5, 4}, 2);
  spec.angle_stiffness = 1;
  // 4 rows of 5; slanted lines that start in the lowest two rows and stay inside: 10 + 10, less those that leave at an end
  const Lattice whole = generate(spec, 0, 1);
  std::int64_t slanted = 0;
  for (int start = 0; start < 2; ++start)
    for (int i = 0; i < 5; ++i)
      for (const double way : {-0.5, 0.5}) {
        const double left = start % 2 ? 0.5 : 0.0, x = i + left + 2 * way;
        slanted += x >= left - 1e-9 && x <= left + 4 + 1e-9;
      }
  CHECK(whole.interactions[0].rows.count == 4 * 3 + slanted);
}
