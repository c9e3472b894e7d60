#include "base/rounding.hpp"
#include <catch2/catch.hpp>
#include <cstdlib>
#include <random>
#include "base/text.hpp"

using namespace bs;

TEST_CASE("sums of steps are the decimals that they mean", "[rounding]") {
  CHECK(decimal_time(0.1 + 0.2) == 0.3);
  CHECK(decimal_time(0.7 + 0.1) == 0.8);
  CHECK(decimal_time(-(0.1 + 0.2)) == -0.3);
  CHECK(decimal_time(0) == 0);
  CHECK(decimal_time(1.0 / 3) == 1.0 / 3);
  CHECK(decimal_time(1e300) == 1e300);
  CHECK(std::isinf(decimal_time(INFINITY)));
}

TEST_CASE("decimals of any size are found, and nothing moves by more than two roundings", "[rounding]") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> digits(0.1, 1);
  for (int k = 0; k < 20000; ++k) {
    const int power = k % 30 - 20;
    const double x = digits(random) * std::pow(10.0, power), decimal = std::strtod(format("%.11e", x).c_str(), nullptr);
    CAPTURE(x, decimal);
    const double above = std::nextafter(decimal, INFINITY), twice = std::nextafter(above, INFINITY);
    REQUIRE(decimal_time(decimal) == decimal);
    REQUIRE(decimal_time(above) == decimal);
    REQUIRE(decimal_time(twice) == decimal);
    REQUIRE(std::abs(decimal_time(x) - x) <= 4.5e-16 * x);
  }
}
