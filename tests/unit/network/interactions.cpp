// Interactions of several ends, distributed with the particles.
#include <algorithm>
#include <catch2/catch.hpp>
#include "lattice/spring_laws.hpp"
#include "network/migrate.hpp"
#include "small_network.hpp"

using namespace bs;

TEST_CASE("couplings of angle springs leave ghosts and one link a pair", "[network]") {
  GeneratorSpec spec = lattice(LatticeType::chain, {14}, 2);
  spec.angle_stiffness = 1;
  const Lattice chain = chunk_of_lattice(PETSC_COMM_WORLD, spec);
  Network net;
  REQUIRE(build_network(PETSC_COMM_WORLD, chain, NetworkOptions{}, &net) == 0);
  REQUIRE(net.interactions.size() == interaction_schemas().size());
  const InteractionTable& table = net.interactions[0];
  CHECK(table.total == 12);
  CHECK(std::is_sorted(table.row.begin(), table.row.end()));
  std::int64_t owned = 0;
  for (std::size_t k = 0; k < table.row.size(); ++k)
    for (int e = 0; e < 3; ++e) {
      const PetscInt i = table.end[k * 3 + static_cast<std::size_t>(e)];
      REQUIRE(i < net.n + net.ghosts);
      // positions tell which particle it is: spacing 1 along x
      CHECK(net.held[i * 2] == Approx(static_cast<double>(table.row[k] + e)).margin(1e-12));
      owned += i < net.n;
    }
  MPI_Allreduce(MPI_IN_PLACE, &owned, 1, MPI_INT64_T, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(owned == 36);
  for (PetscInt i = 0; i < net.n; ++i) {
    std::vector<PetscInt> others(net.links.other.begin() + net.links.start[i], net.links.other.begin() + net.links.start[i + 1]);
    const std::int64_t row = net.row[i];
    CHECK(static_cast<std::int64_t>(others.size()) == std::min<std::int64_t>(row, 2) + std::min<std::int64_t>(13 - row, 2));
  }
}
