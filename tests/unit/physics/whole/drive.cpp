// The motions of driven groups: derivatives, expressions, tables.
#include "physics/whole/drive.hpp"
#include <catch2/catch.hpp>
#include <cmath>

using bs::Drive;

namespace {

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
  REQUIRE(text.parse("x=expression:0.2*sin(3*t)*x0+exp(-t)*y0^2,y=expression:t^3", 3, &error));
  CHECK(text.held() == 3);
  differentiate(text, 2, 0.37);
  for (const char* one : {"exp(-t*t)", "log(t+2)", "sqrt(1+t)",   "sin(t)*cos(2*t)",  "tan(t)", "asin(t/2)", "acos(t^2)", "atan(3*t)",
                          "sinh(t)",   "cosh(t)",  "tanh(2*t)",   "abs(t-1)",         "erf(t)", "t/(1+t^2)", "(1+t)^-2",  "(1+t)^(2*t)",
                          "2^-t",      "-t^2",     "step(t)*t^2", "(t+x0)*(t-y0)/z0", "t^2^0.5"}) {
    INFO(one);
    Drive drive;
    REQUIRE(drive.parse(std::string("x=expression:") + one, 3, &error));
    differentiate(drive, 3, 0.37);
  }
}

TEST_CASE("expressions are evaluated as they are written") {
  const double x0[3] = {2, 3, 5};
  std::string error;
  const std::pair<const char*, double> all[] = {
      {"2^3^2", 64},       {"-2^2", -4},          {"2^-1", 0.5},      {"2*-3", -6},  {"1-2-3", -4},
      {"12/2/3", 2},       {"1e-3*1.5E+2", 0.15}, {".5+1.", 1.5},     {"t--t", 0.5}, {" ( x0 + y0 ) *\tz0", 25},
      {"step(t-0.25)", 1}, {"step(t-0.26)", 0},   {"abs(-pi)-pi", 0}, {"log(e)", 1}, {"0^0", 1},
      {"(-2)^3", -8}};
  for (const auto& [text, value] : all) {
    INFO(text);
    bs::Expression one;
    double u[3];
    REQUIRE(one.parse(text, true, &error));
    one.at(0.25, x0, u);
    CHECK_THAT(u[0], Catch::Matchers::WithinAbs(value, 1e-15));
  }
  std::string product = "1";
  for (int k = 0; k < 1500; ++k) product += "*(t+1)";  // its derivatives cost no more than itself
  bs::Expression one;
  double u[3];
  REQUIRE(one.parse(product, true, &error));
  one.at(0, x0, u);
  CHECK(u[1] == 1500);
  CHECK(u[2] == 1500.0 * 1499);
}

TEST_CASE("what is no expression is told with its place") {
  const std::pair<std::string, const char*> all[] = {{"1%*t", "character 2: '%' has no meaning"},
                                                     {"[t]", "character 1: '[' has no meaning"},
                                                     {"0.1@*t", "character 4: '@'"},
                                                     {"5\xc2\xb0*t", "character 2: a letter that is not ASCII"},
                                                     {"t\n+1", "character 2: a line break or another control character"},
                                                     {"0.1*t;", "character 6: ';'"},
                                                     {"$t", "character 1: '$'"},
                                                     {"2t", "character 2: an operator is missing before 't'"},
                                                     {"2e", "character 2: an operator is missing before 'e'"},
                                                     {"t t", "character 3: an operator is missing"},
                                                     {"(t", "at its end: an operator or ')' is missing"},
                                                     {"t)", "character 2: an operator is missing before ')'"},
                                                     {"", "at its end: a number, a name or '(' is missing"},
                                                     {"t*", "at its end"},
                                                     {"sin t", "'(' of sin is missing"},
                                                     {"1e999", "the number is beyond"},
                                                     {"1..2", "character 3"},
                                                     {"delta(t)", "delta is unknown"},
                                                     {"q*t", "character 1: q is unknown"},
                                                     {std::string(300, '(') + "t", "brackets or signs within one another"},
                                                     {std::string(300, '-') + "t", "brackets or signs within one another"},
                                                     {std::string(40000, '('), "has 40000 characters: write 10000 at most"}};
  for (const auto& [text, part] : all) {
    bs::Expression one;
    std::string error;
    INFO(text.substr(0, 40));
    CHECK_FALSE(one.parse(text, true, &error));
    INFO(error);
    CHECK(error.find(part) != std::string::npos);
    CHECK(error.size() < 250);
  }
  bs::Expression timed;
  std::string error;
  CHECK_FALSE(timed.parse("0.1*x0", false, &error));
  CHECK(error.find("character 5: x0 is unknown: write an expression in t alone") != std::string::npos);
}

TEST_CASE("jumps of expressions are found, bends are not") {
  const double x0[2] = {2, 3};
  std::string error;
  const auto jump = [&](const char* text, double from, double to) {
    Drive drive;
    INFO(text);
    REQUIRE(drive.parse(std::string("x=expression:") + text, 2, &error));
    return drive.jump(from, to, x0);
  };
  for (const char* text : {"step(t-0.3)", "t+1e-6*step(t-0.3)", "(t-0.3)/abs(t-0.3)", "1/(t-0.3)", "log(abs(t-0.3))", "atan(1/(t-0.3))"})
    CHECK_THAT(jump(text, 0, 1), Catch::Matchers::WithinAbs(0.3, 1e-9));
  CHECK_THAT(jump("step(t-0.15*x0)", 0, 1), Catch::Matchers::WithinAbs(0.3, 1e-9));
  for (const char* text :
       {"abs(t-0.3)", "(t-0.3)*step(t-0.3)", "sqrt(abs(t-0.3))", "1/(t+1)", "tan(t)", "log(t+1)", "t^3", "sin(40*t)/(1+t)", "erf(100*(t-0.3))/(2+t)"})
    CHECK(std::isnan(jump(text, 0, 1)));
  CHECK_THAT(jump("t*step(0.3-t)+0.3*step(t-0.3)", 0, 0.3), Catch::Matchers::WithinAbs(0.3, 1e-9));  // at t = 0.3 alone it is 0.6
  CHECK(std::isnan(jump("step(t-0.3)", 0.3, 1)));
  CHECK(std::isnan(jump("step(t-0.3)", 0, 0.29)));
}

TEST_CASE("knots of expressions are where arguments of step and abs change their signs") {
  const auto knot = [](const std::string& text, double from, double to) {
    std::string error;
    bs::Expression u;
    REQUIRE(u.parse(text, true, &error));
    return u.next_knot(from, to);
  };
  CHECK(knot("3*step(t-0.3)", 0, 1).time == 0.3);
  CHECK(knot("3*step(t-0.3)", 0, 1).jumps);
  CHECK(knot("step(0.3-t)", 0.1, 1).time == 0.3);
  CHECK_FALSE(knot("(t-0.3)*step(t-0.3)", 0, 1).jumps);
  CHECK_FALSE(knot("abs(t-0.3)", 0, 1).jumps);
  CHECK(knot("step(t-0.3)*step(0.3001-t)", 0, 1000).time == 0.3);
  CHECK(knot("step(t-0.3)*step(0.3001-t)", 0.3, 1000).time == 0.3001);
  CHECK(knot("step(sin(2*pi*t))", 0.2, 0.9).time == Approx(0.5).epsilon(1e-15));
  for (const char* none : {"sin(t)", "step(t-0.3)", "step(x0-t)", "step(2)"}) CHECK(std::isinf(knot(none, 0.3, 1).time));
}

TEST_CASE("at a knot an expression has the value of the side that is asked for") {
  using bs::Side;
  std::string error;
  const double x0[3] = {0, 0, 0};
  const auto value = [&](const std::string& text, double t, Side side) {
    bs::Expression u;
    double out[3];
    REQUIRE(u.parse(text, true, &error));
    u.at(t, x0, out, side);
    return std::vector<double>(out, out + 2);
  };
  using V = std::vector<double>;
  for (const double t : {0.3, 0.3 * (1 + 1e-15)}) {
    CHECK(value("4*step(t-0.3)", t, Side::left)[0] == 0);
    CHECK(value("4*step(t-0.3)", t, Side::right)[0] == 4);
    CHECK(value("4*step(0.3-t)", t, Side::left)[0] == 4);
    CHECK(value("4*step(0.3-t)", t, Side::right)[0] == 0);
    CHECK(value("abs(t-0.3)", t, Side::left)[1] == -1);
    CHECK(value("abs(t-0.3)", t, Side::right)[1] == 1);
  }
  CHECK(value("4*step(0.3-t)", 0.3, Side::given)[0] == 4);
  CHECK(value("step(sqrt(t))", 0, Side::given) == V{1, 0});  // whose argument rises without bound
  CHECK(value("4*step(t-0.3)", 0.3, Side::mean) == V{2, 0});
  CHECK(value("abs(t-0.3)", 0.3, Side::mean) == V{0, 0});
  CHECK(value("4*step(t-0.2)", 0.3, Side::left)[0] == 4);
}

TEST_CASE("what is no motion says so") {
  std::string error;
  for (const char* text :
       {"", "x", "shaken", "velocity:1", "velocity:1,2,3,4", "velocity:1,inf,0", "rotation:1,0,0", "rotation:1,0,0,0,0,0,0", "velocity:1,,3",
        "velocity:1 2,0,0", "table:", "x=still", "x=sinusoid:1", "x=free", "w=fixed", "x=fixed,x=free", "x=velocity:a", "fixed:1", "x=table:"}) {
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
  CHECK(drive.next_knot(0, 10).time == 1);
  CHECK(drive.next_knot(1, 10).time == 3);
  CHECK(std::isinf(drive.next_knot(3, 10).time));
  drive.set_sides({INFINITY, 1, NAN});
  drive.at(1, x0, x, v, a);
  CHECK(v[1] == 2);
  drive.set_sides({0, NAN, NAN});  // the mean of the slopes 2 and -0.5
  drive.at(1, x0, x, v, a);
  CHECK(x[1] == 9);
  CHECK(v[1] == 0.75);
  drive.at(2, x0, x, v, a);
  CHECK(v[1] == -0.5);
  CHECK(drive.misses(3).empty());
  CHECK(drive.misses(3.1) == "does not reach the end of the run");
  CHECK(drive.misses(-0.1) == "begins after the end of the run");
}
