#include "base/text.hpp"
#include <catch2/catch.hpp>

TEST_CASE("the parts of a text are those between separators, without the blanks around them") {
  using Parts = std::vector<std::string>;
  CHECK(bs::split("", ',') == Parts{""});
  CHECK(bs::split(" a b ,c,\t", ',') == Parts{"a b", "c", ""});
  CHECK(bs::split(",1", ',') == Parts{"", "1"});
}

TEST_CASE("a text is a number where the whole of it is one that is finite") {
  for (const auto& [text, expected] : {std::pair{"0", 0.0}, {"-1.5", -1.5}, {"+2e3", 2000.0}, {".25", 0.25}, {"3.", 3.0}}) {
    double value = -7;
    INFO(text);
    CHECK(bs::read_number(text, &value));
    CHECK(value == expected);
  }
  for (const char* text : {"", " ", "-", "1 2", "1,2", "1.0.0", "2m", "x", "nan", "inf", "-inf", "1e999"}) {
    double value = 0;
    INFO(text);
    CHECK_FALSE(bs::read_number(text, &value));
  }
}

TEST_CASE("numbers are written with the fewest digits that read back as the same") {
  for (const auto& [value, text] : std::vector<std::pair<double, const char*>>{{0.2, "0.2"},
                                                                               {10, "10"},
                                                                               {-1200, "-1200"},
                                                                               {1e-6, "1e-06"},
                                                                               {0.1 + 0.2, "0.30000000000000004"},
                                                                               {1e15, "1e+15"},
                                                                               {0, "0"},
                                                                               {999, "999"},
                                                                               {1000, "1000"},
                                                                               {123456.75, "123456.75"}})
    CHECK(bs::plain_number(value) == text);
  for (const double value : {1.0 / 3, 1e300, 5e-324, -2.5e-7, 99999999999999.9})
    CHECK(std::strtod(bs::plain_number(value).c_str(), nullptr) == value);
  CHECK(bs::time_number(9.700000000000003) == "9.7");
  CHECK(bs::time_number(0.0017800000000000001) == "0.00178");
}
