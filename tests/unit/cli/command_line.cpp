// The look at the command line and at option files before PETSc reads them.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "cli/command_line.hpp"

using namespace bs;

TEST_CASE("Words that are neither options nor values are found") {
  const auto stray = [](const std::vector<std::string>& words) { return stray_words(words); };
  CHECK(stray({}).empty());
  CHECK(stray({"-bs_gravity", "0,-9.81", "-bs_overwrite", "-ts_dt", "-1e-3", "-ts_type"}).empty());
  CHECK(stray({"word", "-ts_dt", "1"}) == std::vector<std::string>{"word"});
  CHECK(stray({"-bs_gravity", "0,", "-9.81", "-help", "a", "b", ""}) == std::vector<std::string>{"-9.81", "b", ""});
}

TEST_CASE("Options written as other programs want them are explained") {
  CHECK(fault_of_form({"-bs_gravity", "0,-9.81", "-ts_dt", "1e-3", "-1", "--", "a=b", "-bs_linear_source", "sine(a=1)"}).empty());
  CHECK_THAT(fault_of_form({"-ts_dt=0.1"}), Catch::Contains("write -ts_dt 0.1"));
  CHECK_THAT(fault_of_form({"-x", "--bs_gravity"}), Catch::Contains("write -bs_gravity"));
  CHECK_THAT(fault_of_form({"--bs_gravity=0,-1"}), Catch::Contains("write -bs_gravity 0,-1"));
}

TEST_CASE("YAML that PETSc would refuse is told with its line") {
  CHECK(fault_of_yaml("", "f").empty());
  CHECK(fault_of_yaml("# only a comment\n", "f").empty());
  CHECK(fault_of_yaml("a: 1\nb: [1, 2]\nc: {d: x, e: }\nf: &g 3\nh: *g\n", "f").empty());
  CHECK_THAT(fault_of_yaml("a: 1\nb: 2: 3\n", "f"), Catch::StartsWith("f line 2: not valid YAML (mapping values are not allowed"));
  CHECK_THAT(fault_of_yaml("a: 1\n- b\n", "f"), Catch::StartsWith("f line 2: not valid YAML"));
  CHECK_THAT(fault_of_yaml("a b\n", "f"), Catch::StartsWith("f line 1: holds no options"));
  CHECK_THAT(fault_of_yaml("\na:\n  - [1]\n", "f"), Catch::StartsWith("f line 3: a list in a list"));
  CHECK_THAT(fault_of_yaml("a: 1\n? [x]\n: 2\n", "f"), Catch::StartsWith("f line 2: a name must be a word"));
  CHECK_THAT(fault_of_yaml("a: &a {b: *a}\n", "f"), Catch::Contains("aliases that never end"));
  CHECK_THAT(fault_of_yaml(std::string("\0\1\2", 3), "f"), Catch::StartsWith("f line 1: not valid YAML"));
}

TEST_CASE("Option files are looked at where the command line and PETSC_OPTIONS name them") {
  const char* const missing[] = {"program", "-options_file", "/nowhere/o.yaml"};
  CHECK_THAT(fault_of_option_files(3, missing), Catch::StartsWith("option file /nowhere/o.yaml: no such file"));
  const char* const folder[] = {"program", "-ts_dt", "1", "-options_file_yaml", "/"};
  CHECK_THAT(fault_of_option_files(5, folder), Catch::StartsWith("option file /: is a folder"));
  const char* const none[] = {"program", "-options_file"};
  CHECK(fault_of_option_files(2, none).empty());
  setenv("PETSC_OPTIONS", "-ts_dt 1 -options_file /nowhere/p.yaml", 1);
  CHECK_THAT(fault_of_option_files(1, none), Catch::StartsWith("option file /nowhere/p.yaml: no such file"));
  unsetenv("PETSC_OPTIONS");
}
