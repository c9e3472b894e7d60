// Pieces of text for messages and options: printf into a string, trimming, splitting, numbers, the name nearest to a misspelt one. No PETSc.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

namespace bs {

/// Without blanks at both ends.
std::string trim(const std::string& text);

/// With small letters for capitals.
std::string lower(std::string text);

/// Whether `text` ends in `tail`, or is it.
bool ends_with(const std::string& text, const std::string& tail);

/// The trimmed parts between separators; "" gives one empty part.
std::vector<std::string> split(const std::string& text, char separator);

/// Whether the whole of `text` is one finite number, which is then `value`.
bool read_number(const std::string& text, double* value);

/// Least number of letters inserted, removed or replaced to turn `a` into `b`; case does not matter.
int edit_distance(const std::string& a, const std::string& b);

/// "hooke, strain or tension"
std::string alternatives(const std::vector<std::string>& names);

/// The nearest of `names`, the first of equals; empty if none is within `most` changes.
std::string nearest(const std::string& word, const std::set<std::string>& names, int most);

/// Formats like printf into a string.
std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

/// The fewest digits that read back as the same number: 0.2, not 0.20000000000000001, and 10, not 1e+01.
inline std::string plain_number(double value) {
  constexpr double LARGE = 1e15;
  char buffer[40];
  for (int digits = std::abs(value) >= 1 && std::abs(value) < LARGE ? static_cast<int>(std::log10(std::abs(value))) + 1 : 1; digits <= 17; ++digits) {
    std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
    if (std::strtod(buffer, nullptr) == value) break;
  }
  return buffer;
}

/// "1 particle", "2 particles": the number and `text`, which is a noun whose plural ends in s, or has both numbers in braces: "{mode is|modes are}
/// zero", "step{s} ended".
std::string how_many(std::int64_t count, const std::string& text);

/// "%.12g": of a sum of many steps, without its rounding errors.
inline std::string time_number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.12g", value);
  return buffer;
}

/// "%g", for people.
inline std::string short_number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

/// Length of the UTF-8 sequence of a character that starts at `at`; 0 if there is none.
std::size_t utf8_length(const std::string& text, std::size_t at);

/// `text` fit for one line of a terminal: other than printable ASCII becomes '?', what is past 40 characters "...".
inline std::string printable(const std::string& text) {
  std::string line = text.substr(0, 40);
  for (char& c : line)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > 40 ? line + "..." : line;
}

}  // namespace bs
