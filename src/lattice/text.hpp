// Small pieces of text for messages and options.
#pragma once
#include <cstdio>
#include <string>

namespace bs {

/// "%.17g": reads back as the same number.
inline std::string exact_number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.17g", value);
  return buffer;
}

/// "%g", for people.
inline std::string short_number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

/// `text` fit for one line of a terminal: other than printable ASCII becomes '?', what is past 40 characters "...".
inline std::string printable(const std::string& text) {
  std::string line = text.substr(0, 40);
  for (char& c : line)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > 40 ? line + "..." : line;
}

}  // namespace bs
