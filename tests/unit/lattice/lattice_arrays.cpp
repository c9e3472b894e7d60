// Lattices in memory: what of the arrays becomes rows, and what is refused.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>

#include "full_arrays.hpp"
#include "lattice/lattice_arrays.hpp"

using namespace bs;

namespace {

LatticeArrays triangle() {
  LatticeArrays a;
  a.dim = 2;
  a.position = {0, 0, 1, 0, 0, 1};
  a.mass = {1, 2, 3};
  a.springs = {0, 1, 1, 2};
  a.stiffness = {10, 20};
  return a;
}

std::string refusal(const LatticeArrays& arrays) {
  Lattice l;
  std::string error;
  return lattice_of(arrays, &l, &error) ? std::string() : error;
}

}  // namespace

TEST_CASE("arrays in memory become rows, with what is left out filled in") {
  LatticeArrays a = triangle();
  Lattice l;
  std::string error;
  REQUIRE(lattice_of(a, &l, &error));
  REQUIRE((l.particles.total == 3 && l.springs.total == 2 && l.dim == 2));
  REQUIRE(l.velocity == std::vector<double>(6, 0.0));
  REQUIRE(l.fixed == std::vector<std::uint8_t>(3, 0));
  REQUIRE((std::isnan(l.rest_length[0]) && std::isnan(l.rest_length[1])));
  REQUIRE(l.damping == std::vector<double>(2, 0.0));
  a.box.periodic[0] = true;
  a.box.edges[0] = 3;
  a.shift = {0, 0, 1, 0};
  a.rest_length = {1, 2};
  a.groups = {{"lower", {1, 1, 0}}};
  REQUIRE(lattice_of(a, &l, &error));
  REQUIRE((l.box.active() && l.box.edges[3] == 1 && l.shift == a.shift && l.rest_length == a.rest_length && l.groups[0].member[2] == 0));
}

TEST_CASE("arrays whose sizes do not fit are refused by name") {
  REQUIRE(refusal(triangle()).empty());
  LatticeArrays a = triangle();
  a.position.pop_back();
  REQUIRE(refusal(a) == "lattice in memory: position has 5 numbers: give 6");
  a = triangle();
  a.fixed = {1};
  REQUIRE(refusal(a) == "lattice in memory: fixed has 1 number: give 3, or none");
  a = triangle();
  a.groups = {{"lower", {1}}};
  REQUIRE(refusal(a) == "lattice in memory: group lower has 1 number: give 3");
  a = triangle();
  a.dim = 4;
  REQUIRE(refusal(a) == "lattice in memory: dim is 4: give 1, 2 or 3");
  REQUIRE(refusal({}) == "lattice in memory: mass is empty: give at least one particle");
}

TEST_CASE("arrays in memory come back from the lattice that is made of them") {
  for (const int dim : {2, 3}) {
    const LatticeArrays a = full_arrays(dim);
    Lattice l;
    std::string error;
    REQUIRE(lattice_of(a, &l, &error));
    REQUIRE((l.anchors.total == 2 && l.interactions.size() == interaction_schemas().size() && l.interactions[0].rows.total == 2));
    REQUIRE((l.spring_law == SpringLaw::strain && l.spring_law_given && l.damping_law == DampingLaw::simple && l.damping_law_given));
    REQUIRE(l.law_by_row);
    REQUIRE((spring_laws()[l.spring_laws[6]].name == std::string("maxwell") && spring_laws()[l.spring_laws[7]].name == std::string("polynomial")));
    REQUIRE((l.area.name == AREA && l.break_columns[0].path == "springs/critical_strain" && l.particle_columns[2].path == "particles/force"));
    REQUIRE(difference(arrays_of(l), a).empty());
    LatticeArrays other = a;
    other.break_columns[1].value[19] += 1;
    REQUIRE(difference(arrays_of(l), other) == "break_columns");
  }
  REQUIRE(difference(arrays_of(Lattice()), LatticeArrays()).empty());
  Lattice l;
  std::string error;
  REQUIRE(lattice_of(triangle(), &l, &error));
  REQUIRE((!l.spring_law_given && !l.damping_law_given && !l.law_by_row && !l.has_area() && l.interactions.empty() && l.anchors.total == 0));
}

TEST_CASE("what readers of files refuse is refused of arrays, too") {
  struct Case {
    std::function<void(LatticeArrays&)> spoil;
    const char* says;
  };
  const Case cases[] = {
      {[](LatticeArrays& a) { a.id.pop_back(); }, "id has 11 numbers: give 12, or none"},
      {[](LatticeArrays& a) { a.area.pop_back(); }, "area has 19 numbers: give 20, or none"},
      {[](LatticeArrays& a) { a.shift.push_back(0); }, "shift has 61 numbers: give 60, or none"},
      {[](LatticeArrays& a) { a.fixed[3] = 2; }, "particle 3: fixed is 2: give 1 (fixed) or 0 (free)"},
      {[](LatticeArrays& a) { a.particle_columns[2].value.pop_back(); }, "particles/force has 35 numbers: give 36"},
      {[](LatticeArrays& a) { a.particle_columns[0].name = "colour"; }, "column of particles 'colour' is unknown: give radius, drag or force"},
      {[](LatticeArrays& a) {
         a.particle_columns[0].name = "drag";
         a.particle_columns[0].value = a.mass;
       },
       "particles/drag is there twice: give it once"},
      {[](LatticeArrays& a) { a.spring_columns[1].name = "stifness_2"; },
       "column of springs 'stifness_2' is unknown: give stiffness_2, stiffness_3, yield_force, hardening, relaxation_time, plastic_stretch, "
       "plastic_path, viscous_stretch or viscous_loss"},
      {[](LatticeArrays& a) { a.spring_columns[1].value.pop_back(); }, "springs/stiffness_3 has 19 numbers: give 20"},
      {[](LatticeArrays& a) { a.break_columns[0].name = "strain"; },
       "limit of springs 'strain' is unknown: give critical_strain, critical_force, critical_energy or broken"},
      {[](LatticeArrays& a) { a.break_columns[2].value.clear(); }, "springs/critical_energy has 0 numbers: give 20"},
      {[](LatticeArrays& a) { a.groups[0].name = "a b"; }, "'a b' is no name of a group: give letters, digits and underscores"},
      {[](LatticeArrays& a) { a.groups[0].name = "some"; }, "group some is there twice: give it once"},
      {[](LatticeArrays& a) { a.groups[1].member[4] = 3; }, "particle 4: member of group some is 3: give 1 (it belongs to the group) or 0"},
      {[](LatticeArrays& a) { a.spring_law = "hook"; }, "spring_law 'hook' is unknown: give hooke, strain, tension, polynomial, plastic or maxwell"},
      {[](LatticeArrays& a) { a.damping_law = "none"; }, "damping_law 'none' is unknown: give axial or simple"},
      {[](LatticeArrays& a) { a.laws[1] = "plastik"; }, "laws: 'plastik' is unknown: give hooke, strain, tension, polynomial, plastic or maxwell"},
      {[](LatticeArrays& a) { a.law[8] = 4; }, "spring 8: law is 4: give places in laws, 0 to 3"},
      {[](LatticeArrays& a) { a.law[8] = -1; }, "spring 8: law is -1: give places in laws, 0 to 3"},
      {[](LatticeArrays& a) { a.law.pop_back(); }, "law has 19 numbers: give 20, or none"},
      {[](LatticeArrays& a) { a.laws.clear(); }, "law has a number for each spring and laws is empty: give the names that these are places of"},
      {[](LatticeArrays& a) { a.box.edges[4] = 0, a.box.edges[3] = 0; },
       "the edges of the box span no volume: give finite vectors [m] that do not lie in one plane or line"},
      {[](LatticeArrays& a) { a.box.edges[8] = NAN; },
       "the edges of the box span no volume: give finite vectors [m] that do not lie in one plane or line"},
      {[](LatticeArrays& a) { a.box = {}; },
       "shift is given and the box is not periodic: leave it out, or say along which edges the box is periodic"},
      {[](LatticeArrays& a) { a.anchors.particle.push_back(1); }, "anchors/particle has 3 numbers: give 2"},
      {[](LatticeArrays& a) { a.anchors.point.pop_back(); }, "anchors/point has 5 numbers: give 6"},
      {[](LatticeArrays& a) { a.anchors.rest_length.pop_back(); }, "anchors/rest_length has 1 number: give 2, or none"},
      {[](LatticeArrays& a) { a.anchors.damping.pop_back(); }, "anchors/damping has 1 number: give 2, or none"},
      {[](LatticeArrays& a) { a.interactions[0].kind = "angle"; }, "kind of interactions 'angle' is unknown: give angles or hinges"},
      {[](LatticeArrays& a) { a.interactions[1].kind = "angles"; }, "angles are there twice: give them once"},
      {[](LatticeArrays& a) { a.interactions[0].ends.pop_back(); }, "angles/ends has 5 numbers: give 3 for each of them"},
      {[](LatticeArrays& a) { a.interactions[1].parameter.pop_back(); }, "hinges/parameter has 3 numbers: give 4"},
      {[](LatticeArrays& a) { a.interactions[0].break_columns[0].name = "critical_strain"; },
       "limit of interactions 'critical_strain' is unknown: give broken, critical_change, critical_moment or critical_energy"},
      {[](LatticeArrays& a) { a.interactions[1].break_columns[0].value.pop_back(); }, "hinges/critical_energy has 1 number: give 2"},
      {[](LatticeArrays& a) { a.interactions[1].shift.pop_back(); }, "hinges/shift has 23 numbers: give 24, or none"},
      {[](LatticeArrays& a) { a.implied_options[0].first = "-bs_output"; },
       "implied option '-bs_output' is none of a scene's: give it with the settings"},
      {[](LatticeArrays& a) { a.implied_options[0].second = "0, 1"; }, "implied option -bs_gravity has the value '0, 1': give one without blanks"},
  };
  REQUIRE(refusal(full_arrays(3)).empty());
  for (const Case& one : cases) {
    LatticeArrays a = full_arrays(3);
    one.spoil(a);
    CHECK(refusal(a) == std::string("lattice in memory: ") + one.says);
  }
  LatticeArrays flat = triangle();
  flat.box.periodic[2] = true;
  CHECK(refusal(flat) == "lattice in memory: box is periodic along edge 2 (from 0): there are 2");
}
