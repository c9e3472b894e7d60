#include "base/option_names.hpp"
#include <catch2/catch.hpp>

using namespace bs;

TEST_CASE("switches are on where their value says so") {
  std::string first = "of before";
  REQUIRE(first_on({"-test_a", "-test_b", "-test_c"}, &first) == 0);
  CHECK(first.empty());
  REQUIRE(PetscOptionsSetValue(nullptr, "-test_a", "false") == 0);
  REQUIRE(PetscOptionsSetValue(nullptr, "-test_b", nullptr) == 0);
  REQUIRE(PetscOptionsSetValue(nullptr, "-test_c", "1") == 0);
  REQUIRE(first_on({"-test_a"}, &first) == 0);
  CHECK(first.empty());
  CHECK(is_given("-test_a"));
  REQUIRE(first_on({"-test_a", "-test_b", "-test_c"}, &first) == 0);
  CHECK(first == "-test_b");
  for (const char* name : {"-test_a", "-test_b", "-test_c"}) REQUIRE(PetscOptionsClearValue(nullptr, name) == 0);
}

TEST_CASE("what is given stays, what is not is set and told if nothing reads it") {
  PetscBool used = PETSC_TRUE;
  REQUIRE(PetscOptionsSetValue(nullptr, "-test_given", "mine") == 0);
  REQUIRE(set_unless_given("-test_given", "other") == 0);
  REQUIRE(set_unless_given("-test_open", "other") == 0);
  REQUIRE(PetscOptionsUsed(nullptr, "-test_open", &used) == 0);
  CHECK_FALSE(used);
  CHECK(value_of("-test_given") == "mine");
  CHECK(value_of("-test_open") == "other");
  for (const char* name : {"-test_given", "-test_open"}) REQUIRE(PetscOptionsClearValue(nullptr, name) == 0);
}
