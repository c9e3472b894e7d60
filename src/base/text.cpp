#include "base/text.hpp"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numeric>

namespace bs {

std::string trim(const std::string& text) {
  const char* blank = " \t\r\n";
  const auto first = text.find_first_not_of(blank);
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool ends_with(const std::string& text, const std::string& tail) {
  return text.size() >= tail.size() && text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  for (;;) {
    const auto to = text.find(separator, from);
    parts.push_back(trim(text.substr(from, to == std::string::npos ? to : to - from)));
    if (to == std::string::npos) return parts;
    from = to + 1;
  }
}

bool read_number(const std::string& text, double* value) {
  char* end = nullptr;
  *value = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == 0 && std::isfinite(*value);
}

int edit_distance(const std::string& a, const std::string& b) {
  // row[j]: distance between the letters of `a` read so far and the first j letters of `b`.
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i) + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const bool same = std::tolower(static_cast<unsigned char>(a[i])) == std::tolower(static_cast<unsigned char>(b[j]));
      const int replaced = diagonal + (same ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string alternatives(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) text += (k == 0 ? "" : k + 1 == names.size() ? " or " : ", ") + names[k];
  return text;
}

std::string nearest(const std::string& word, const std::set<std::string>& names, int most) {
  std::string best;
  int least = most + 1;
  for (const std::string& name : names) {
    const int distance = edit_distance(word, name);
    if (distance < least) {
      least = distance;
      best = name;
    }
  }
  return best;
}

std::string format(const char* pattern, ...) {
  va_list list, again;
  va_start(list, pattern);
  va_copy(again, list);
  const int length = std::vsnprintf(nullptr, 0, pattern, list);
  va_end(list);
  std::string text(length > 0 ? static_cast<std::size_t>(length) : 0, '\0');
  if (length > 0) std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(again);
  return text;
}

std::string how_many(std::int64_t count, const std::string& text) {
  std::string out = std::to_string(count) + " ", rest = text.find('{') == std::string::npos ? text + "{s}" : text;
  for (std::size_t open, close; (open = rest.find('{')) != std::string::npos && (close = rest.find('}', open)) != std::string::npos;) {
    const std::string both = rest.substr(open + 1, close - open - 1);
    const std::size_t bar = both.find('|');
    const std::string one = bar == std::string::npos ? "" : both.substr(0, bar), many = bar == std::string::npos ? both : both.substr(bar + 1);
    out += rest.substr(0, open) + (count == 1 ? one : many);
    rest.erase(0, close + 1);
  }
  return out + rest;
}

std::size_t utf8_length(const std::string& text, std::size_t at) {
  constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};  // below: the character has a shorter form
  const auto lead = static_cast<unsigned char>(text[at]);
  const std::size_t length = lead < 0x80 ? 1 : lead >> 5 == 6 ? 2 : lead >> 4 == 14 ? 3 : lead >> 3 == 30 ? 4 : 0;
  if (length == 0 || at + length > text.size()) return 0;
  std::uint32_t code = length == 1 ? lead : lead & (0x7fu >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const auto next = static_cast<unsigned char>(text[at + i]);
    if (next >> 6 != 2) return 0;
    code = code << 6 | (next & 0x3fu);
  }
  const bool half = code >= 0xd800 && code < 0xe000;  // of a pair of UTF-16
  return code < least[length] || half || code > 0x10ffff ? 0 : length;
}

}  // namespace bs
