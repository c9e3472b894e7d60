// Numbers and counts in texts for people.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace bs {

/// The shortest text that reads back as the same number: 0.2, not 0.20000000000000001.
inline std::string plain_number(double value) {
  char buffer[40];
  for (int digits = 1; digits <= 17; ++digits) {
    std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
    if (std::strtod(buffer, nullptr) == value) break;
  }
  return buffer;
}

/// "1 particle", "2 particles"; `one`: the singular of a noun whose plural ends in s.
inline std::string how_many(std::int64_t count, const std::string& one) { return std::to_string(count) + " " + one + (count == 1 ? "" : "s"); }

}  // namespace bs
