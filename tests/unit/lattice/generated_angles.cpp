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
