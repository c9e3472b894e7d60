// What every reader of text must keep to, whatever the bytes.
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

inline void require(bool kept, const char* what) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// A message is one line of printable text that begins with the name of its source.
inline void require_message(const std::string& error, const std::string& begin) {
  require(!error.empty(), "a failure has a message");
  require(error.compare(0, begin.size(), begin) == 0, "the message begins with the source");
  require(error.size() < 600, "the message is short");
  for (const char c : error) require(c >= ' ' && c <= '~', "the message is one line of printable text");
}

inline void require_finite(const std::vector<double>& values) {
  for (const double value : values) require(std::isfinite(value), "numbers are finite");
}

inline std::string text_of(const std::uint8_t* data, std::size_t size) { return std::string(reinterpret_cast<const char*>(data), size); }
