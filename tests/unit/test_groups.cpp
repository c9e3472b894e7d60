// Groups as options say them, and the motions of groups.
#include <catch2/catch.hpp>
#include <cmath>
#include "lattice/groups.hpp"
#include "physics/whole/drive.hpp"

using bs::Drive;

namespace {

bs::Lattice row_of_five(std::int64_t first, std::int64_t count) {
  bs::Lattice l;
  l.dim = 2;
  l.particles = {first, count, 5};
  for (std::int64_t k = first; k < first + count; ++k) {
    l.position.push_back(static_cast<double>(k));
    l.position.push_back(0.5 * static_cast<double>(k % 2));
  }
  return l;
}

/// Velocity and acceleration against central differences.
void differentiate(const Drive& drive, int dim, double t) {
  const double x0[3] = {0.7, -0.4, 1.3}, h = 1e-4;
  double x[3][3] = {}, v[3][3] = {}, a[3][3] = {};
  for (int k = 0; k < 3; ++k) drive.at(t + (k - 1) * h, x0, x[k], v[k], a[k]);
  for (int c = 0; c < dim; ++c) {
    CHECK(v[1][c] == Approx((x[2][c] - x[0][c]) / (2 * h)).margin(1e-6));
    CHECK(a[1][c] == Approx((v[2][c] - v[0][c]) / (2 * h)).margin(1e-5));
  }
}

}  // namespace

TEST_CASE("groups by faces, boxes and rows are the same in any chunks") {
  bs::GroupSpec spec;
  spec.name = "some";
  REQUIRE(bs::parse_group("xmax,ids:0,2-2,box:0.9,0.4,1.1,0.6", 2, 2, 5, &spec).empty());
  bs::Box box;
  box.hi[0] = 4;
  box.hi[1] = 0.5;
  std::vector<int> found;
  for (const auto& [first, count] : {std::pair<std::int64_t, std::int64_t>{0, 2}, {2, 3}}) {
    bs::Lattice l = row_of_five(first, count);
    bs::choose_groups({spec}, box, 0, &l);
    REQUIRE(l.groups.size() == 1);
    for (const auto member : l.groups[0].member) found.push_back(member);
  }
  CHECK(found == std::vector<int>{1, 1, 1, 0, 1});
}

TEST_CASE("what is no group says so") {
  bs::GroupSpec spec;
  for (const char* text : {"", "xmid", "zmin", "ids:", "ids:5", "ids:-1", "ids:3-1", "box:0,0,1", "box:0,0,1,nan", "xmin,,xmax", "ids:1e3"})
    CHECK_FALSE(bs::parse_group(text, 2, 2, 5, &spec).empty());
  CHECK(bs::is_group_name("left_2"));
  CHECK_FALSE(bs::is_group_name("2left"));
  CHECK_FALSE(bs::is_group_name("a b"));
}

TEST_CASE("velocities and accelerations are the derivatives of the motion") {
  std::string error;
  for (const char* text : {"velocity:1,2,3", "rotation:2,0.1,0.2,0.3,1,2,-1", "x=sinusoid:0.3,0.8,0.2,z=velocity:2"}) {
    Drive drive;
    REQUIRE(drive.parse(text, 3, &error));
    differentiate(drive, 3, 0.37);
  }
  Drive flat;
  REQUIRE(flat.parse("rotation:-1.5,0.2,0.1", 2, &error));
  differentiate(flat, 2, 0.37);
  Drive text;
  if (text.parse("x=expression:0.2*sin(3*t)*x0+exp(-t)*y0^2,y=expression:t^3", 3, &error)) {
    CHECK(text.held() == 3);
    differentiate(text, 2, 0.37);
  } else {
    CHECK(error.find("libmatheval") != std::string::npos);
  }
}

TEST_CASE("what is no motion says so") {
  std::string error;
  for (const char* text : {"", "x", "shaken", "velocity:1", "velocity:1,2,3,4", "velocity:1,inf,0", "rotation:1,0,0", "rotation:1,0,0,0,0,0,0",
                           "table:", "x=still", "x=sinusoid:1", "x=free", "w=fixed", "x=fixed,x=free", "x=velocity:a", "fixed:1", "x=table:"}) {
    Drive drive;
    INFO(text);
    CHECK_FALSE(drive.parse(text, 3, &error));
    CHECK_FALSE(error.empty());
  }
}

TEST_CASE("tables are followed from row to row") {
  std::string error;
  Drive drive;
  REQUIRE(drive.parse("y=table:f.csv,x=fixed", 2, &error));
  CHECK(drive.held() == 3);
  CHECK(drive.moving() == 2);
  REQUIRE(drive.tables().size() == 1);
  bs::CsvTable table;
  table.columns = 2;
  table.values = {0, 0, 1, 2, 3, 1};
  REQUIRE(drive.set_table(0, table, &error));
  const double x0[2] = {5, 7};
  double x[2] = {}, v[2] = {}, a[2] = {};
  drive.at(0.5, x0, x, v, a);
  CHECK(x[0] == 5);
  CHECK(x[1] == 8);
  CHECK(v[1] == 2);
  drive.at(1, x0, x, v, a);
  CHECK(x[1] == 9);
  CHECK(v[1] == -0.5);
  drive.at(3, x0, x, v, a);
  CHECK(x[1] == 8);
  drive.at(4, x0, x, v, a);
  CHECK(x[1] == 8);
  CHECK(v[1] == 0);
  CHECK(drive.covers(3));
  CHECK_FALSE(drive.covers(3.1));
}
