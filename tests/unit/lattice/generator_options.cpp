// Descriptions of lattices: how options fill them, and what is said of bad ones.
#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <vector>

#include "lattice/generator.hpp"

using namespace bs;
using I = std::int64_t;

namespace {

GeneratorSpec make(LatticeType type, std::vector<I> size) {
  GeneratorSpec s;
  s.type = type;
  s.size = std::move(size);
  return s;
}

}  // namespace

TEST_CASE("a bad description is answered with its remedy", "[generator]") {
  struct Row {
    void (*spoil)(GeneratorSpec*);
    const char* said;
  };
  using S = GeneratorSpec;
  const std::vector<Row> rows = {{[](S* s) { s->size = {}; }, "-bs_lattice_size is missing"},
                                 {[](S* s) {
                                    s->size = {3, 0};
                                  },
                                  "-bs_lattice_size 0"},
                                 {[](S* s) {
                                    s->size = {1, 2, 3, 4};
                                  },
                                  "takes up to 3"},
                                 {[](S* s) {
                                    s->type = LatticeType::chain, s->size = {2, 2};
                                  },
                                  "a chain lattice takes one"},
                                 {[](S* s) {
                                    s->size = {I(1) << 62, 4, 1};
                                  },
                                  "64 bits"},
                                 {[](S* s) { s->size = {I(1) << 21}; }, "64 bits"},
                                 {[](S* s) { s->dim = 2; }, "needs d = 3"},
                                 {[](S* s) { s->dim = -1; }, "needs d = 3"},
                                 {[](S* s) {
                                    s->type = LatticeType::cloth, s->size = {4, 4}, s->dim = 1;
                                  },
                                  "needs d = 2 or 3"},
                                 {[](S* s) { s->neighbors = 8; }, "6 or 18 or 26 neighbours"},
                                 {[](S* s) { s->neighbors = -1; }, "6 or 18 or 26 neighbours"},
                                 {[](S* s) {
                                    s->spacing = {1, 0};
                                  },
                                  "-bs_lattice_spacing 0: write a number > 0"},
                                 {[](S* s) { s->spacing = {}; }, "-bs_lattice_spacing has 0 numbers"},
                                 {[](S* s) {
                                    s->origin = {1, 2, 3, 4};
                                  },
                                  "-bs_lattice_origin has 4"},
                                 {[](S* s) { s->total_mass = 1, s->particle_mass = 1; }, "both given"},
                                 {[](S* s) { s->total_mass = -1; }, "-bs_lattice_total_mass must be > 0"},
                                 {[](S* s) { s->particle_mass = std::nan(""); }, "-bs_lattice_particle_mass must be > 0"},
                                 {[](S* s) {
                                    s->stiffness = {1, -2};
                                  },
                                  "-bs_lattice_stiffness -2"},
                                 {[](S* s) { s->stiffness = {}; }, "-bs_lattice_stiffness has 0 numbers"},
                                 {[](S* s) { s->damping = {-1}; }, "-bs_lattice_damping -1"},
                                 {[](S* s) { s->rest_length_factor = -1; }, "-bs_lattice_rest_length_factor -1"},
                                 {[](S* s) { s->radius = -1; }, "-bs_lattice_radius -1"},
                                 {[](S* s) { s->fixed = {"front"}; }, "-bs_lattice_fixed front"},
                                 {[](S* s) {
                                    s->type = LatticeType::cloth, s->size = {4, 4}, s->fixed = {"zmin"};
                                  },
                                  "xmin, xmax, ymin, ymax"},
                                 {[](S* s) { s->fixed_particles = {64}; }, "write numbers from 0 to 63"},
                                 {[](S* s) { s->fixed_particles = {-1}; }, "write numbers from 0 to 63"},
                                 {[](S* s) {
                                    s->velocity = {1, 2, 3, 4};
                                  },
                                  "-bs_lattice_velocity has 4"},
                                 {[](S* s) {
                                    s->velocity_gradient = {1, 2, 3, 4};
                                  },
                                  "write 9"},
                                 {[](S* s) { s->perturbation = 0.5; }, "write less than 0.5"},
                                 {[](S* s) { s->perturbation = -0.1; }, "-bs_lattice_perturbation -0.1"},
                                 {[](S* s) { s->type = LatticeType::fcc, s->perturbation = 0.3; }, "write less than 0.25"},
                                 {[](S* s) { s->stiff_fraction = 1.5; }, "a share from 0 to 1"},
                                 {[](S* s) { s->stiff_factor = -1; }, "-bs_lattice_stiff_factor -1"},
                                 {[](S* s) { s->remove_fraction = 1.5; }, "-bs_lattice_remove_fraction 1.5: write a share from 0 to 1"},
                                 {[](S* s) { s->remove_fraction = -0.1; }, "-bs_lattice_remove_fraction -0.1"}};
  REQUIRE(check(make(LatticeType::cubic, {4})).empty());
  REQUIRE(check(GeneratorSpec{}).empty());
  for (const Row& row : rows) {
    GeneratorSpec spec = make(LatticeType::cubic, {4});
    row.spoil(&spec);
    CHECK_THAT(check(spec), Catch::Contains(row.said));
  }
}

namespace {

/// Stands in for the reader of options: gives what the table holds.
struct FakeSection {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::vector<std::string>> words;
  std::set<std::string> asked;
  bool has(const char* n) { return asked.insert(n), numbers.count(n) > 0; }
  bool real(const char* n, const char*, double& v) { return has(n) && (v = numbers[n].at(0), true); }
  bool reals(const char* n, const char*, double* v, int max, int* count) {
    if (!has(n)) return false;
    REQUIRE(static_cast<int>(numbers[n].size()) <= max);
    std::copy(numbers[n].begin(), numbers[n].end(), v);
    *count = static_cast<int>(numbers[n].size());
    return true;
  }
  bool integer(const char* n, const char*, I& v) { return has(n) && (v = static_cast<I>(numbers[n].at(0)), true); }
  bool integers(const char* n, const char*, std::vector<I>& v) { return has(n) && (v.assign(numbers[n].begin(), numbers[n].end()), true); }
  bool flag(const char* n, const char*, bool& v) { return has(n) && (v = numbers[n].at(0) != 0, true); }
  bool text(const char* n, const char*, std::string& v) {
    asked.insert(n);
    return words.count(n) > 0 && (v = words[n].at(0), true);
  }
  bool texts(const char* n, const char*, std::vector<std::string>& v) {
    asked.insert(n);
    return words.count(n) > 0 && (v = words[n], true);
  }
  bool choice(const char* n, const char*, const std::vector<std::string>& choices, int& index) {
    asked.insert(n);
    if (!words.count(n)) return false;
    index = static_cast<int>(std::find(choices.begin(), choices.end(), words[n].at(0)) - choices.begin());
    return true;
  }
};

}  // namespace

TEST_CASE("options fill the description", "[generator]") {
  GeneratorSpec spec;
  FakeSection none;
  spec.options(none);
  CHECK(spec.type == LatticeType::none);
  CHECK(none.asked.size() == 27);

  FakeSection some;
  some.words = {{"-bs_lattice_type", {"bcc"}}, {"-bs_lattice_fixed", {"xmin", "zmax"}}};
  some.numbers = {{"-bs_lattice_size", {3, 4}},    {"-bs_lattice_neighbors", {14}},  {"-bs_lattice_stiffness", {9, 8}},
                  {"-bs_lattice_total_mass", {0}}, {"-bs_lattice_velocity", {0, 1}}, {"-bs_lattice_seed", {5}}};
  spec.options(some);
  CHECK(spec.type == LatticeType::bcc);
  CHECK(spec.fixed == std::vector<std::string>{"xmin", "zmax"});
  CHECK(particle_count(spec) == 2 * 3 * 4 * 4);
  CHECK(spec.neighbors == 14);
  CHECK(spec.stiffness == std::vector<double>{9, 8});
  CHECK(spec.velocity == std::vector<double>{0, 1});
  CHECK(spec.seed == 5);
  CHECK(spec.spacing == std::vector<double>{1});
  CHECK_THAT(check(spec), Catch::Contains("-bs_lattice_total_mass must be > 0"));
}
