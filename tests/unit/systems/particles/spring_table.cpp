// Numbers of springs between links and rows of the input.
#include "systems/particles/spring_table.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include "held_network.hpp"

using namespace bs;

namespace {

const OptionTexts net = {
    {"-bs_lattice_type", "square"}, {"-bs_lattice_size", "6,5"}, {"-bs_lattice_rest_length_factor", "0.9"}, {"-bs_lattice_perturbation", "0.2"}};

double number_of(std::int64_t spring) { return std::cos(static_cast<double>(spring)); }

}  // namespace

TEST_CASE("numbers of springs come into the order of the input, and from there to both ends", "[spring_table]") {
  for (const char* partition : {"graph", "rows"}) {
    OptionTexts texts = net;
    texts["-bs_partition"] = partition;
    const HeldNetwork at(texts);
    SpringTable table;
    CHECK_FALSE(table.created());
    REQUIRE(table.create(at.net, at.lattice.springs) == 0);
    VecHandle rows;
    const auto value = [&](PetscInt, PetscInt e) { return number_of(at.net.links.spring[static_cast<std::size_t>(e)]); };
    REQUIRE(table.gather(value, &rows) == 0);
    PetscInt count = 0;
    const PetscScalar* found = nullptr;
    REQUIRE(VecGetLocalSize(rows, &count) == 0);
    REQUIRE(count == at.lattice.springs.count);
    REQUIRE(VecGetArrayRead(rows, &found) == 0);
    for (PetscInt k = 0; k < count; ++k) REQUIRE(found[k] == number_of(at.lattice.springs.first + k));
    REQUIRE(VecRestoreArrayRead(rows, &found) == 0);
    REQUIRE(VecScale(rows, 2) == 0);
    std::vector<double> put(at.net.links.spring.size(), NAN);
    for (int turn = 0; turn < 2; ++turn) {  // the second time by the scatter of the first
      REQUIRE(table.spread(rows, [&](PetscInt e, double x) { put[static_cast<std::size_t>(e)] = x; }) == 0);
      for (std::size_t e = 0; e < put.size(); ++e) REQUIRE(put[e] == 2 * number_of(at.net.links.spring[e]));
    }
  }
}
