#include <catch2/catch.hpp>

#include <cstdarg>
#include <functional>

#include "base/error.hpp"
#include "base/options.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

/// Sets an option of PETSc's table while it lives; a null value is a bare flag.
class Given {
 public:
  Given(const char* name, const char* value) : name_(name) { (void)PetscOptionsSetValue(nullptr, name, value); }
  ~Given() { (void)PetscOptionsClearValue(nullptr, name_); }

 private:
  const char* name_;
};

/// What rank 0 says while `read` reads `value` for `name`; empty if it is accepted.
std::string said_of(const char* name, const char* value, const std::function<void(Section&)>& read) {
  const Handled handled;
  const Given given(name, value);
  Caught said;
  const PetscErrorCode code = read_section(PETSC_COMM_WORLD, "Test", read);
  const std::string text = said.text();
  if (rank_of(PETSC_COMM_WORLD) != 0) {
    REQUIRE(text.empty());
    return code ? "failed" : "";
  }
  REQUIRE((code == ERR_FAILED) == !text.empty());
  return text;
}

/// The same on rank 0; other ranks only know that something failed.
void require_said(const std::string& said, const std::string& line) {
  if (rank_of(PETSC_COMM_WORLD) == 0) REQUIRE(said == "backspring: error: " + line + "\n");
  else REQUIRE(said == "failed");
}

}  // namespace

TEST_CASE("real options") {
  double x = 1.5;
  const auto any = [&](Section& s) { s.real("-bs_test_x", "a mass [kg]", x); };
  const auto positive = [&](Section& s) { s.real("-bs_test_x", "a mass [kg]", x, Range::positive); };
  const auto nonnegative = [&](Section& s) { s.real("-bs_test_x", "a mass [kg]", x, Range::nonnegative); };
  REQUIRE(said_of("-bs_test_x", "-2.5e-3", any).empty());
  REQUIRE(x == -2.5e-3);
  REQUIRE(said_of("-bs_test_x", "0", nonnegative).empty());
  REQUIRE(x == 0);
  x = 4;
  require_said(said_of("-bs_test_x", "-3", positive), "option -bs_test_x: -3 is not positive: give a number > 0 [kg]");
  require_said(said_of("-bs_test_x", "0", positive), "option -bs_test_x: 0 is not positive: give a number > 0 [kg]");
  require_said(said_of("-bs_test_x", "-1", nonnegative), "option -bs_test_x: -1 is negative: give a number >= 0 [kg]");
  require_said(said_of("-bs_test_x", "12abc", any), "option -bs_test_x: 12abc is not a number: give a number [kg]");
  require_said(said_of("-bs_test_x", "nan", any), "option -bs_test_x: nan is not finite: give a number [kg]");
  require_said(said_of("-bs_test_x", "1e999", any), "option -bs_test_x: 1e999 is not finite: give a number [kg]");
  require_said(said_of("-bs_test_x", nullptr, any), "option -bs_test_x needs a value: a mass [kg]");
  REQUIRE(x == 4);
}

TEST_CASE("whole numbers and lists") {
  std::int64_t n = 3;
  std::vector<std::int64_t> sizes = {1};
  double v[3] = {1, 2, 3};
  int count = 0;
  const auto whole = [&](Section& s) { s.integer("-bs_test_n", "a count", n, Range::positive); };
  const auto many = [&](Section& s) { s.integers("-bs_test_n", "sizes", sizes); };
  const auto vector = [&](Section& s) { s.reals("-bs_test_v", "a velocity [m/s]", v, 3, &count); };
  REQUIRE(said_of("-bs_test_n", "9007199254740993", whole).empty());  // 2^53 + 1: no double has passed
  REQUIRE(n == 9007199254740993);
  require_said(said_of("-bs_test_n", "1.5", whole), "option -bs_test_n: 1.5 is not a whole number: give a whole number");
  require_said(said_of("-bs_test_n", "99999999999999999999", whole), "option -bs_test_n: 99999999999999999999 is too large: give a whole number");
  require_said(said_of("-bs_test_n", "0", whole), "option -bs_test_n: 0 is not positive: give a whole number > 0");
  REQUIRE(said_of("-bs_test_n", "4, 5,-6", many).empty());
  REQUIRE(sizes == std::vector<std::int64_t>{4, 5, -6});
  REQUIRE(said_of("-bs_test_v", "-1,-2e-3", vector).empty());
  REQUIRE(count == 2);
  REQUIRE((v[0] == -1 && v[1] == -2e-3 && v[2] == 3));
  require_said(said_of("-bs_test_v", "1,2,3,4", vector), "option -bs_test_v: 1,2,3,4 are 4 numbers: give at most 3, separated by commas [m/s]");
  require_said(said_of("-bs_test_v", "1,,3", vector), "option -bs_test_v: an empty value is not a number: give a number [m/s]");
}

TEST_CASE("flags, words and choices") {
  bool flag = false;
  int law = 0;
  std::string file = "none";
  std::vector<std::string> words;
  const auto switched = [&](Section& s) { s.flag("-bs_test_flag", "a switch", flag); };
  const auto chosen = [&](Section& s) { s.choice("-bs_test_law", "the law", {"hooke", "strain"}, law); };
  REQUIRE(said_of("-bs_test_flag", nullptr, switched).empty());
  REQUIRE(flag);
  REQUIRE(said_of("-bs_test_flag", "No", switched).empty());
  REQUIRE_FALSE(flag);
  require_said(said_of("-bs_test_flag", "maybe", switched),
               "option -bs_test_flag: maybe is neither true nor false: give true, false or nothing (true)");
  REQUIRE(said_of("-bs_test_law", "Strain", chosen).empty());
  REQUIRE(law == 1);
  require_said(said_of("-bs_test_law", "springy", chosen), "option -bs_test_law: springy does not exist: give one of hooke, strain");
  // what one word alone begins with is that word
  REQUIRE(said_of("-bs_test_law", "hoo", chosen).empty());
  REQUIRE(law == 0);
  REQUIRE_FALSE(said_of("-bs_test_law", "st", chosen).empty());
  const auto alike = [&](Section& s) { s.choice("-bs_test_law", "the law", {"plastic", "plaster", "plas"}, law); };
  REQUIRE_FALSE(said_of("-bs_test_law", "plast", alike).empty());
  REQUIRE(said_of("-bs_test_law", "plas", alike).empty());
  REQUIRE(law == 2);
  REQUIRE(said_of("-bs_test_file", "-3.h5", [&](Section& s) { s.text("-bs_test_file", "a file", file); }).empty());
  REQUIRE(file == "-3.h5");
  REQUIRE(said_of("-bs_test_words", "a, b", [&](Section& s) { s.texts("-bs_test_words", "words", words); }).empty());
  REQUIRE(words == std::vector<std::string>{"a", "b"});
}

namespace {
std::string help_text;
PetscErrorCode keep_help(MPI_Comm, const char pattern[], ...) {
  char line[1024];
  va_list list;
  va_start(list, pattern);
  std::vsnprintf(line, sizeof line, pattern, list);
  va_end(list);
  help_text += line;
  return 0;
}
}  // namespace

TEST_CASE("-help lists every option, after a bad value too") {
  const Handled handled;
  const Given given("-bs_test_a", "-1");
  std::remove_pointer_t<OptionItems> items = {};
  items.count = 1;
  items.printhelp = PETSC_TRUE;
  auto before = PetscHelpPrintf;
  PetscHelpPrintf = keep_help;
  help_text.clear();
  Section section(&items, PETSC_COMM_WORLD);
  double a = 2, b[2] = {3, 4};
  bool c = true;
  int law = 1;
  Caught said;
  section.real("-bs_test_a", "a 100% mass [kg]", a, Range::positive);
  section.reals("-bs_test_b", "a pair", b, 2);
  section.flag("-bs_test_c", "a switch", c);
  section.choice("-bs_test_d", "the law", {"hooke", "strain"}, law);
  (void)said.text();
  PetscHelpPrintf = before;
  REQUIRE(section.status() == ERR_FAILED);
  REQUIRE(help_text ==
          "  -bs_test_a: <2>: a 100% mass [kg]\n  -bs_test_b: <3,4>: a pair\n  -bs_test_c: <true>: a switch\n"
          "  -bs_test_d: <strain>: the law (one of hooke, strain)\n");
}

TEST_CASE("an option nobody asked for is answered with the nearest name") {
  const Handled handled;
  double gravity = 0;
  const auto read = [&](Section& s) { s.real("-bs_test_gravity", "gravity [m/s2]", gravity); };
  const auto rejected = [&](const char* name, const char* value) {
    const Given given(name, value);
    Caught said;
    PetscErrorCode code = read_section(PETSC_COMM_WORLD, "Test", read);
    if (!code) code = reject_unknown_options(PETSC_COMM_WORLD);
    const std::string text = said.text();
    REQUIRE((code == 0 || code == ERR_FAILED));
    return rank_of(PETSC_COMM_WORLD) == 0 ? text : code ? std::string("failed") : "";
  };
  REQUIRE(rejected("-BS_TEST_GRAVITY", "-9.8").empty());
  REQUIRE(gravity == -9.8);
  REQUIRE(rejected("-not_ours", "-bs_test_gravty").empty());
  require_said(rejected("-bs_test_gravty", "-1"), "option -bs_test_gravty does not exist: did you mean -bs_test_gravity?");
  require_said(rejected("-bs_zzzzzzzz", "1"), "option -bs_zzzzzzzz does not exist: -help lists the options");
  REQUIRE(known_options(PETSC_COMM_WORLD).count("-bs_test_gravity") == 1);
}
