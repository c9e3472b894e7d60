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
