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
      REQUIRE(reduce_over_ranks(PETSC_COMM_WORLD, MPI_SUM, values.data(), count, piece) == 0);
      INFO(count << " numbers in pieces of " << piece);
      for (std::size_t k = 0; k < count; ++k) CHECK(values[k] == size * static_cast<double>(k) + 50.0 * size * (size - 1));
      CHECK(values[count] == -5.0);
    }
}

TEST_CASE("sums, extremes and whether it is so on some rank, of numbers of every kind") {
  const PetscMPIInt rank = rank_of(PETSC_COMM_WORLD), size = size_of(PETSC_COMM_WORLD);
  const auto check = [&](auto number) {
    using T = decltype(number);
    T values[2] = {static_cast<T>(rank + 1), static_cast<T>(7)}, low = values[0], high = values[0];
    REQUIRE(sum_over_ranks(PETSC_COMM_WORLD, values, 2) == 0);
    REQUIRE(min_over_ranks(PETSC_COMM_WORLD, &low) == 0);
    REQUIRE(max_over_ranks(PETSC_COMM_WORLD, &high) == 0);
    CHECK(values[0] == static_cast<T>(size * (size + 1) / 2));
    CHECK(values[1] == static_cast<T>(7 * size));
    CHECK(low == static_cast<T>(1));
    CHECK(high == static_cast<T>(size));
  };
  check(0.5);
  check(int{});
  check(std::int64_t{});
  check(std::uint64_t{});
  check(std::uint8_t{});
  std::int64_t large = -(std::int64_t{1} << 40);
  REQUIRE(min_over_ranks(PETSC_COMM_WORLD, &large) == 0);
  CHECK(large == -(std::int64_t{1} << 40));
  for (PetscMPIInt one = -1; one < size; ++one) {
    bool some = one < 0;
    REQUIRE(on_some_rank(PETSC_COMM_WORLD, rank == one, &some) == 0);
    CHECK(some == (one >= 0));
  }
}

TEST_CASE("lists of all ranks, end to end on rank 0") {
  const PetscMPIInt rank = rank_of(PETSC_COMM_WORLD), size = size_of(PETSC_COMM_WORLD);
  std::vector<std::int64_t> all(static_cast<std::size_t>(2 * rank), rank), expected;
  std::string text(static_cast<std::size_t>(rank + 1), static_cast<char>('a' + rank)), whole;
  for (PetscMPIInt one = 0; one < size && rank == 0; ++one) {
    expected.insert(expected.end(), static_cast<std::size_t>(2 * one), one);
    whole.append(static_cast<std::size_t>(one + 1), static_cast<char>('a' + one));
  }
  REQUIRE(gather_on_rank_0(PETSC_COMM_WORLD, all, &all) == 0);
  REQUIRE(gather_on_rank_0(PETSC_COMM_WORLD, text, &text) == 0);
  CHECK(all == expected);
  CHECK(text == whole);
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
