// Sums over the ranks in several reductions are those of one; what rank 0 knows reaches all.
#include "base/collective.hpp"
#include <catch2/catch.hpp>
#include <vector>

using namespace bs;

TEST_CASE("Sums in pieces") {
  PetscMPIInt rank, size;
  REQUIRE(MPI_Comm_rank(PETSC_COMM_WORLD, &rank) == 0);
  REQUIRE(MPI_Comm_size(PETSC_COMM_WORLD, &size) == 0);
  for (const std::size_t count : {0U, 1U, 6U, 7U, 8U})
    for (const std::size_t piece : {1U, 3U, 7U, 100U}) {
      std::vector<double> values(count + 1, -5.0);
      for (std::size_t k = 0; k < count; ++k) values[k] = static_cast<double>(k) + 100.0 * rank;
      REQUIRE(sum_over_ranks(PETSC_COMM_WORLD, values.data(), count, piece) == 0);
      INFO(count << " numbers in pieces of " << piece);
      for (std::size_t k = 0; k < count; ++k) CHECK(values[k] == size * static_cast<double>(k) + 50.0 * size * (size - 1));
      CHECK(values[count] == -5.0);
    }
}

TEST_CASE("what rank 0 answers and says is known on every rank") {
  const PetscMPIInt rank = rank_of(PETSC_COMM_WORLD);
  int asked = 0;
  CHECK(ask_rank_0(PETSC_COMM_WORLD, [&] {
          ++asked;
          return 7 + rank;
        }) == 7);
  CHECK(asked == (rank == 0 ? 1 : 0));
  for (const char* word : {"", "a name of rank 0"}) {
    std::string text = rank == 0 ? word : std::string(static_cast<std::size_t>(rank), 'x');
    REQUIRE(share_text(PETSC_COMM_WORLD, &text) == 0);
    CHECK(text == word);
  }
}
