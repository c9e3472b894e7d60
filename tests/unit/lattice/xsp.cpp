// XSpringies scenes: every record, every fault, and the scenes people made where they are at hand.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "lattice/xsp.hpp"

using namespace bs;

namespace {

bool read_file(const std::string& path, std::string* text) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return false;
  std::ostringstream all;
  all << in.rdbuf();
  *text = all.str();
  return true;
}

Lattice parse(const std::string& text) {
  Lattice out;
  std::string error;
  const bool good = parse_xsp(text, "scene.xsp", XSP_WIDTH, XSP_HEIGHT, &out, &error);
  INFO(error);
  REQUIRE(good);
  return out;
}

std::map<std::string, std::string> options_of(const Lattice& l) { return {l.implied_options.begin(), l.implied_options.end()}; }

/// Numbers of a list "1,2,3".
std::vector<double> numbers(const std::string& list) {
  std::vector<double> all;
  std::istringstream in(list);
  for (std::string one; std::getline(in, one, ',');) all.push_back(std::strtod(one.c_str(), nullptr));
  return all;
}

const char* const scene =
    "#1.0 *** a scene with every record\r\n"
    "cmas 1.0\r\nelas 0.8\nkspr 10\nkdmp 5\nfixm 0\nshws 1\ngsnp 20.0 0\n"
    "cent 7\n"
    "frce 0 1 9.5 30\nfrce 1 1 5.0 2.0\nfrce 2 1 100 0.5\nfrce 3 1 10000 1\nfrce 4 1 0 0\n"
    "visc 0.25\nstck 3\nstep 0.02\nprec 1\nadpt 0\nwall 1 0 0 1\n"
    "# a remark\n"
    "spng 1 3 7 200 5 12.5\n"  // springs may come first
    "mass 3 10.5 20 1 -2 -4 1.0\n"
    "\t mass 7 100 +200 3 4 2.5 0.5\n"
    "\n"
    "mass 12 1e2 3E1 0 0 0 1\n"
    "spng 2 12 3 20 0 0\n"
    "spng 3 7 99 1 1 1\n"
    "spng 4 7 98 1 1 1\n"
    "spng 5 7 7 1 1 1\n"
    "what 1 2\nhuh\nwhat\n"
    "spng 6 3 7 1 0 3";  // no newline at the end

}  // namespace

TEST_CASE("a scene with every record", "[xsp]") {
  const Lattice l = parse(scene);
  CHECK(l.dim == 2);
  CHECK(l.source == "scene.xsp");
  CHECK(l.particles.first == 0);
  CHECK(l.particles.count == 3);
  CHECK(l.particles.total == 3);
  CHECK(l.id == std::vector<std::int64_t>{3, 7, 12});
  CHECK(l.position == std::vector<double>{10.5, 20, 100, 200, 100, 30});
  CHECK(l.velocity == std::vector<double>{0, 0, 3, 4, 0, 0});
  CHECK(l.mass == std::vector<double>{4, 2.5, 1});
  CHECK(l.fixed == std::vector<std::uint8_t>{1, 0, 0});
  // trunc(2 ln(4 m + 1)): 2 ln 17 = 5.67, 2 ln 11 = 4.80, 2 ln 5 = 3.22
  REQUIRE(find_column(l.particle_columns, "radius"));
  CHECK(find_column(l.particle_columns, "radius")->value == std::vector<double>{5, 4, 3});
  CHECK(l.springs.count == 3);
  CHECK(l.springs.total == 3);
  CHECK(l.pairs == std::vector<std::int64_t>{0, 1, 2, 0, 0, 1});
  CHECK(l.stiffness == std::vector<double>{200, 20, 1});
  CHECK(l.damping == std::vector<double>{5, 0, 0});
  CHECK(l.rest_length == std::vector<double>{12.5, 0, 3});
  CHECK(l.spring_law == SpringLaw::hooke);
  CHECK(l.damping_law == DampingLaw::axial);
  CHECK(l.spring_law_given);
  CHECK(l.damping_law_given);
  CHECK(l.rest_at_zero_length);
}

TEST_CASE("forces of a scene become options", "[xsp]") {
  const Lattice l = parse(scene);
  auto o = options_of(l);
  CHECK(o.size() == l.implied_options.size());
  const std::vector<double> g = numbers(o["-bs_gravity"]);
  REQUIRE(g.size() == 2);
  CHECK(g[0] == Approx(9.5 * 0.5).epsilon(1e-15));  // sin 30 degrees
  CHECK(g[1] == Approx(-9.5 * std::sqrt(0.75)).epsilon(1e-15));
  o.erase("-bs_gravity");
  const std::map<std::string, std::string> rest = {
      {"-bs_viscosity", "0.25"},           {"-bs_xsp_center_of_mass", "5"},        {"-bs_xsp_center_of_mass_damping", "2"},
      {"-bs_xsp_attraction", "100"},       {"-bs_xsp_attraction_exponent", "0.5"}, {"-bs_xsp_center_particle", "1"},
      {"-bs_xsp_walls", "10000"},          {"-bs_xsp_walls_exponent", "1"},        {"-bs_xsp_walls_sides", "1,0,0,1"},
      {"-bs_xsp_walls_box", "0,642,0,550"}};
  CHECK(numbers(o["-ts_dt"]) == std::vector<double>{0.02});
  o.erase("-ts_dt");
  CHECK(o == rest);
}

TEST_CASE("only forces that are on are implied", "[xsp]") {
  const std::string mass = "#1.0\nmass 1 1 1 0 0 1 1\n";
  CHECK(parse(mass).implied_options.empty());
  CHECK(parse(mass + "cent 1\nfrce 0 0 10 0\nfrce 1 0 5 2\nfrce 2 0 10 0\nfrce 3 -1 1 1\nvisc 0\nwall 1 1 1 1\n").implied_options.empty());
  CHECK(parse(mass + "frce 3 1 1 1\nwall 0 0 0 0\n").implied_options.empty());  // no wall to repel from
  // down is exactly down
  CHECK(options_of(parse(mass + "frce 0 1 10 0\n"))["-bs_gravity"] == "0,-10");
  CHECK(numbers(options_of(parse(mass + "frce 0 1 10 90\n"))["-bs_gravity"])[0] == 10);
  // the centre: the window's middle unless a mass is named
  CHECK(options_of(parse(mass + "frce 1 1 1 1\ncent -1\n"))["-bs_xsp_attraction_center"] == "321,275");
  CHECK(options_of(parse(mass + "frce 2 1 1 1\n"))["-bs_xsp_attraction_center"] == "321,275");
  const Lattice lost = parse(mass + "frce 2 1 1 1\ncent 5\n");
  CHECK(options_of(lost)["-bs_xsp_attraction_center"] == "321,275");
  REQUIRE(lost.warnings.size() == 1);
  CHECK_THAT(lost.warnings[0], Catch::Contains("cent 5 names no mass"));
  // the last record of a force counts
  CHECK(parse(mass + "frce 0 1 10 0\nfrce 0 0 10 0\n").implied_options.empty());
  // any number comes back as it was
  const double visc = 0.1 + 0.2;
  std::ostringstream exact;
  exact.precision(17);
  exact << "visc " << visc << "\n";
  CHECK(numbers(options_of(parse(mass + exact.str()))["-bs_viscosity"]) == std::vector<double>{visc});
}

TEST_CASE("what is passed over in a scene is said, each once", "[xsp]") {
  const Lattice l = parse(scene);
  REQUIRE(l.warnings.size() == 4);
  CHECK(l.warnings[0] == "scene.xsp:28: spring 3 ends at mass 99, which does not exist: dropped, and 1 more like it");
  CHECK(l.warnings[1] == "scene.xsp:30: spring 5 joins mass 7 to itself: dropped");
  CHECK(l.warnings[2] == "scene.xsp: ignored, as not modelled: bounces (walls: top, bottom), stickiness (stck 3), collisions (frce 4)");
  CHECK(l.warnings[3] == "scene.xsp:31: unknown records skipped: what huh");
  CHECK(parse("#1.0\nmass 1 1 1 0 0 1 1\nwall 0 0 0 0\nstck 0\nfrce 4 0 0 0").warnings.empty());
}

TEST_CASE("faults of a scene name the line and the remedy", "[xsp]") {
  struct Row {
    std::string text, said;
  };
  const std::string head = "#1.0\nmass 1 1 1 0 0 1 1\n";
  const std::vector<Row> rows = {
      {"", "scene.xsp:1: the file is empty"},
      {"mass 1 1 1 0 0 1 1\n", "scene.xsp:1: the file begins with 'mass 1 1 1 0 0 1 1': an XSpringies scene begins with #1.0"},
      {"\x89HDF\r\n", "scene.xsp:1: the file begins with '?HDF?'"},
      {"#1.0\ncent -1\n", "scene.xsp:2: the scene has no mass"},
      {head + "mass 2 1 1 0 0 1\n", "scene.xsp:3: mass has 6 of its 7 numbers: write 'mass id x y vx vy mass elasticity'"},
      {head + "mass", "scene.xsp:3: mass has 0 of its 7"},
      {head + "mass 1 2 2 0 0 1 1\n", "scene.xsp:3: mass 1 was given on line 2 already: write another id"},
      {head + "mass 1.5 2 2 0 0 1 1\n", "scene.xsp:3: mass: id is '1.5': write a whole number"},
      {head + "mass -4 2 2 0 0 1 1\n", "scene.xsp:3: mass: id is -4: write a whole number >= 0"},
      {head + "mass 99999999999999999999 2 2 0 0 1 1\n", "scene.xsp:3: mass: id is '99999999999999999999'"},
      {head + "mass 2 nan 2 0 0 1 1\n", "scene.xsp:3: mass: x is 'nan': write a finite number"},
      {head + "mass 2 2 inf 0 0 1 1\n", "scene.xsp:3: mass: y is 'inf'"},
      {head + "mass 2 2 2 1e999 0 1 1\n", "scene.xsp:3: mass: vx is '1e999'"},
      {head + "mass 2 2 2 0 0x10 1 1\n", "scene.xsp:3: mass: vy is '0x10'"},
      {head + "mass 2 2 2 0 0 heavy 1\n", "scene.xsp:3: mass: mass is 'heavy'"},
      {head + "\nspng 1 1 1 200 5\n", "scene.xsp:4: spng has 5 of its 6 numbers: write 'spng id a b ks kd rest'"},
      {head + "spng 1 1 2 -200 5 1\n", "scene.xsp:3: spng: stiffness is -200: write a number >= 0"},
      {head + "spng 1 1 2 200 -5 1\n", "scene.xsp:3: spng: damping is -5: write a number >= 0"},
      {head + "spng 1 1 2 200 5 -1\n", "scene.xsp:3: spng: rest length is -1: write a number >= 0"},
      {head + "spng 1 a 2 200 5 1\n", "scene.xsp:3: spng: first mass is 'a'"},
      {head + "spng 1 1 2; 200 5 1\n", "scene.xsp:3: spng: second mass is '2;'"},
      {head + "frce 0\n", "scene.xsp:3: frce has 1 of its 2 numbers"},
      {head + "frce 0 1 ten 0\n", "scene.xsp:3: frce: value is 'ten'"},
      {head + "cent mid\n", "scene.xsp:3: cent: id is 'mid'"},
      {head + "visc -1\n", "scene.xsp:3: visc: coefficient is -1: write a number >= 0"},
      {head + "stck x\n", "scene.xsp:3: stck: stickiness is 'x'"},
      {head + "step 0\n", "scene.xsp:3: step: h is 0: write a time step > 0"},
      {head + "wall 1 1 1\n", "scene.xsp:3: wall has 3 of its 4 numbers: write 'wall top left right bottom'"},
      {head + "visc 1\nvisc -1\nvisc -2\n", "scene.xsp:4: visc"}};
  for (const Row& row : rows) {
    Lattice out;
    std::string error;
    CAPTURE(row.text);
    CHECK_FALSE(parse_xsp(row.text, "scene.xsp", XSP_WIDTH, XSP_HEIGHT, &out, &error));
    CHECK_THAT(error, Catch::StartsWith(row.said));
    CHECK(error.find('\n') == std::string::npos);
  }
  Lattice out;
  std::string error;
  CHECK_FALSE(parse_xsp(head, "scene.xsp", 0, 550, &out, &error));
  CHECK_FALSE(parse_xsp(head, "scene.xsp", 642, std::nan(""), &out, &error));
}

TEST_CASE("damaged scenes are read or refused, never worse", "[xsp]") {
  std::mt19937 random(20240501);
  const std::string whole = scene, pieces = std::string("\0\n\r \t-+.e9#\0", 12) + "\xff\x80mxsn";
  int good = 0, bad = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    std::string text = whole;
    for (unsigned hit = 0; hit <= random() % 4; ++hit) {
      const std::size_t at = random() % text.size();
      if (random() % 4 == 0) text.resize(at + 1);
      else if (random() % 2) text[at] = pieces[random() % pieces.size()];
      else text.insert(at, random() % 3, static_cast<char>(random() % 256));
    }
    Lattice l;
    std::string error;
    if (parse_xsp(text, "scene.xsp", XSP_WIDTH, XSP_HEIGHT, &l, &error)) {
      ++good;
      REQUIRE(error.empty());
      const std::size_t n = static_cast<std::size_t>(l.particles.count), m = static_cast<std::size_t>(l.springs.count);
      REQUIRE(n > 0);
      REQUIRE(l.position.size() == 2 * n);
      REQUIRE(l.velocity.size() == 2 * n);
      REQUIRE(l.pairs.size() == 2 * m);
      REQUIRE(l.rest_length.size() == m);
      for (const std::int64_t end : l.pairs) REQUIRE((end >= 0 && end < l.particles.count));
      for (const double x : l.position) REQUIRE(std::isfinite(x));
      for (const double mass : l.mass) REQUIRE((mass > 0 && std::isfinite(mass)));
    } else {
      ++bad;
      REQUIRE_THAT(error, Catch::StartsWith("scene.xsp:"));
      for (const char c : error) REQUIRE((c >= ' ' && c <= '~'));
    }
  }
  CHECK(good > 100);
  CHECK(bad > 100);
}

TEST_CASE("the net of our own", "[xsp]") {
  std::string text;
  REQUIRE(read_file(BS_SOURCE_DIR "/meshes/net.xsp", &text));
  const Lattice l = parse(text);
  CHECK(l.particles.count == 12 * 8);
  CHECK(l.springs.count == 11 * 8 + 12 * 7);
  CHECK(l.warnings.empty());
  std::vector<std::int64_t> fixed;
  for (std::size_t p = 0; p < l.fixed.size(); ++p)
    if (l.fixed[p]) fixed.push_back(static_cast<std::int64_t>(p));
  CHECK(fixed == std::vector<std::int64_t>{0, 11});
  for (std::size_t s = 0; s < l.rest_length.size(); ++s) {
    const std::size_t i = static_cast<std::size_t>(2 * l.pairs[2 * s]), j = static_cast<std::size_t>(2 * l.pairs[2 * s + 1]);
    REQUIRE(std::hypot(l.position[i] - l.position[j], l.position[i + 1] - l.position[j + 1]) == Approx(l.rest_length[s]));
  }
  auto o = options_of(l);
  CHECK(o["-bs_gravity"] == "0,-10");
  CHECK(numbers(o["-bs_viscosity"]) == std::vector<double>{0.1});
}

TEST_CASE("scenes that people made", "[xsp]") {
  const std::string shared = BS_SOURCE_DIR "/../shared";
  std::string index;
  if (!read_file(shared + "/oracles/xsp/index.csv", &index)) {
    WARN("skipped: ../shared/oracles/xsp is not there");
    return;
  }
  std::istringstream rows(index);
  std::string row;
  std::getline(rows, row);  // scene,particles,springs,...
  int scenes = 0;
  while (std::getline(rows, row)) {
    std::istringstream cells(row);
    std::string name, particles, springs;
    std::getline(cells, name, ',');
    std::getline(cells, particles, ',');
    std::getline(cells, springs, ',');
    std::string text;
    if (!read_file(shared + "/data/xsp/" + name + ".xsp", &text)) {
      WARN("skipped: ../shared/data/xsp is not there");
      return;
    }
    CAPTURE(name);
    const Lattice l = parse(text);
    CHECK(l.particles.count == std::stoll(particles));
    CHECK(l.springs.count == std::stoll(springs));
    // what the records say, counted line by line
    std::istringstream lines(text);
    std::int64_t masses = 0, fixed = 0;
    double mass = 0, stiffness = 0, rest = 0;
    std::set<std::int64_t> ids;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream in(line);
      std::string word;
      double n[7] = {};
      in >> word;
      for (double& x : n) in >> x;
      if (word == "mass") {
        ++masses;
        ids.insert(static_cast<std::int64_t>(n[0]));
        fixed += n[5] < 0;
        mass += std::abs(n[5]);
      } else if (word == "spng") {
        stiffness += n[3];
        rest += n[5];
      }
    }
    CHECK(l.particles.count == masses);
    CHECK(std::set<std::int64_t>(l.id.begin(), l.id.end()) == ids);
    std::int64_t fixed_read = 0;
    double mass_read = 0, stiffness_read = 0, rest_read = 0;
    for (std::size_t p = 0; p < l.mass.size(); ++p) fixed_read += l.fixed[p], mass_read += l.mass[p];
    for (std::size_t s = 0; s < l.stiffness.size(); ++s) stiffness_read += l.stiffness[s], rest_read += l.rest_length[s];
    CHECK(fixed_read == fixed);
    CHECK(mass_read == Approx(mass).epsilon(1e-13));
    CHECK(stiffness_read == Approx(stiffness).epsilon(1e-13));
    CHECK(rest_read == Approx(rest).epsilon(1e-13));
    CHECK(l.warnings.size() <= 1);  // no dropped springs, no unknown records in any of them
    ++scenes;
  }
  CHECK(scenes == 46);
}
