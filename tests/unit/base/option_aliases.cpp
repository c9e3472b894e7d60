#include "base/option_aliases.hpp"
#include <catch2/catch.hpp>
#include "base/error.hpp"
#include "base/option_names.hpp"

using namespace bs;

namespace {

struct Table {
  PetscOptions options = nullptr;
  Table() {
    REQUIRE(PetscOptionsCreate(&options) == 0);
    REQUIRE(PetscOptionsPush(options) == 0);
  }
  ~Table() {
    CHECK(PetscOptionsPop() == 0);
    CHECK(PetscOptionsDestroy(&options) == 0);
  }
};

void set(const char* name, const char* value) { REQUIRE(PetscOptionsSetValue(nullptr, name, value) == 0); }

}  // namespace

TEST_CASE("options of PETSc's have one name, whichever is given") {
  const Table table;
  set("-TS_time_step", "0.25");
  set("-ts_max_step_rejections", "7");
  set("-ts_max_time", "3");
  REQUIRE(unify_option_names(PETSC_COMM_WORLD) == 0);
  CHECK(value_of("-ts_dt") == "0.25");
  CHECK(value_of("-ts_max_reject") == "7");
  CHECK(value_of("-ts_max_time") == "3");
  CHECK_FALSE(is_given("-ts_time_step"));
  CHECK_FALSE(is_given("-ts_max_step_rejections"));
}

TEST_CASE("an option that got another name still counts as unread") {
  const Table table;
  PetscBool used = PETSC_TRUE;
  set("-ts_max_step_rejections", "7");
  REQUIRE(unify_option_names(PETSC_COMM_WORLD) == 0);
  REQUIRE(PetscOptionsUsed(nullptr, "-ts_max_reject", &used) == 0);
  CHECK_FALSE(used);
}

TEST_CASE("of two names of one option that on the command line counts, and without one they are refused") {
  const Table table;
  set("-ts_dt", "0.1");
  set("-ts_time_step", "0.2");
  const PetscErrors errors(PETSC_COMM_WORLD);
  clear_error(PETSC_COMM_WORLD);
  CHECK(unify_option_names(PETSC_COMM_WORLD, {"-bs_model", "linear"}) != 0);
  CHECK(last_error(PETSC_COMM_WORLD).text == "options -ts_dt and -ts_time_step are two names of one option: give one of them");
  clear_error(PETSC_COMM_WORLD);
  REQUIRE(unify_option_names(PETSC_COMM_WORLD, {"-ts_dt", "0.1"}) == 0);
  CHECK(value_of("-ts_dt") == "0.1");
  CHECK_FALSE(is_given("-ts_time_step"));
}

TEST_CASE("a reader of PETSc's finds the names that it knows, and later readers those that are kept") {
  const Table table;
  std::string step;
  set("-ts_time_step", "0.25");
  REQUIRE(unify_option_names(PETSC_COMM_WORLD) == 0);
  REQUIRE(with_names_of_petsc(PETSC_COMM_WORLD, [&step] {
            step = value_of(PETSC_VERSION_LT(3, 25, 0) ? "-ts_dt" : "-ts_time_step");
            return PetscErrorCode(0);
          }) == 0);
  CHECK(step == "0.25");
  CHECK(value_of("-ts_dt") == "0.25");
}

TEST_CASE("words of the command line get the names that are kept, values stay") {
  std::string words[] = {"program", "-ts_time_step", "-ts_time_stepping", "ts_time_step", "-TS_MAX_STEP_REJECTIONS"};
  char* argv[5];
  for (int k = 0; k < 5; ++k) argv[k] = words[k].data();
  translate_old_and_new_names(5, argv);
  CHECK(std::string(argv[1]) == "-ts_dt");
  CHECK(std::string(argv[2]) == "-ts_time_stepping");
  CHECK(std::string(argv[3]) == "ts_time_step");
  CHECK(std::string(argv[4]) == "-ts_max_reject");
}

TEST_CASE("the line search by secants is known under both its names") {
  const std::string known = known_value("-snes_linesearch_type", "secant");
  CHECK(known_value("-snes_linesearch_type", "l2") == known);
  CHECK(known_value("-snes_linesearch_type", "bt") == "bt");
  CHECK(known_value("-ts_arkimex_type", "l2") == "l2");
  CHECK(kept_name("-snes_linesearch_maxstep") == kept_name("-snes_linesearch_maxlambda"));
}
