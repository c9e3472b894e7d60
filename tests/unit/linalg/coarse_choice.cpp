// Which coarse functions a system gets.
#include "linalg/coarse_choice.hpp"
#include "condensed_case.hpp"

using namespace bs;

namespace {

bool prefers_rigid(const GeneratorSpec& spec) {
  bool rigid = false;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  REQUIRE(prefers_rigid_motions(assembled(&c, &own), &rigid) == 0);
  return rigid;
}

double resisted(const GeneratorSpec& spec) {
  double ratio = -1;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  MatHandle own;
  REQUIRE(least_resisted_strain(assembled(&c, &own), &ratio) == 0);
  return ratio;
}

}  // namespace

TEST_CASE("Rigid motions are chosen for thin bodies of even stiffness") {
  GeneratorSpec beam = lattice(LatticeType::cubic, {4, 4, 40}, 3), plate = lattice(LatticeType::cubic, {30, 30, 3}, 3),
                cube = lattice(LatticeType::cubic, {6, 6, 6}, 3), block = lattice(LatticeType::cubic, {5, 5, 30}, 3),
                cloth = lattice(LatticeType::square, {12, 12}, 3), square = lattice(LatticeType::square, {12, 12}, 2),
                line = lattice(LatticeType::chain, {50}, 3);
  GeneratorSpec uneven = beam;
  uneven.stiff_fraction = 0.05;
  uneven.stiff_factor = 1e4;
  for (const GeneratorSpec& spec : {beam, plate, cloth}) CHECK(prefers_rigid(spec));
  for (const GeneratorSpec& spec : {cube, block, square, line, uneven}) CHECK(!prefers_rigid(spec));
}

TEST_CASE("Hats are chosen for thin bodies where angle springs alone resist some shear") {
  GeneratorSpec beam = lattice(LatticeType::cubic, {4, 4, 40}, 3), sheet = lattice(LatticeType::square, {20, 20}, 3),
                strip = lattice(LatticeType::square, {4, 50}, 2);
  beam.neighbors = 6;
  sheet.neighbors = strip.neighbors = 4;
  for (GeneratorSpec spec : {beam, sheet, strip}) {
    CHECK(prefers_rigid(spec));  // nothing but springs
    spec.angle_stiffness = 8;
    CHECK(!prefers_rigid(spec));
    spec.neighbors = spec.type == LatticeType::cubic ? 18 : 8;
    CHECK(prefers_rigid(spec));
  }
}

// A square of n x n points has A = n (n - 1) pairs along each axis and D = (n - 1)^2 along each diagonal: the uniform strain costs A + D, the stretch
// of one axis and shortening of the other A, shear D.
TEST_CASE("How well pairs resist the strain they resist least") {
  GeneratorSpec cube = lattice(LatticeType::cubic, {6, 6, 6}, 3), square = lattice(LatticeType::square, {12, 12}, 2);
  cube.neighbors = 6;
  square.neighbors = 4;
  CHECK(resisted(cube) == 0);
  CHECK(resisted(square) == 0);
  square.neighbors = 8;
  GeneratorSpec sheet = square;
  sheet.dim = 3;
  for (const GeneratorSpec& spec : {square, sheet}) CHECK(std::abs(resisted(spec) - 11.0 / 23) < 1e-12);
}
