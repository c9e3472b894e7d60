#include "input/vector_csv.hpp"
#include <charconv>
#include <cmath>
#include <sstream>
#include "base/words.hpp"
#include "lattice/text.hpp"

namespace bs {

std::string read_vector_csv(const std::string& text, const std::string& name, std::vector<double>* values, std::vector<std::string>* names) {
  std::istringstream in(text);
  std::string row;
  long long line = 0;
  bool first = true;
  while (std::getline(in, row)) {
    ++line;
    row = trim(row.substr(0, row.find('#')));
    if (row.empty()) continue;
    const std::vector<std::string> fields = split(row, ',');
    const std::string& word = fields.back();
    double value = 0;
    const auto [rest, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    const bool number = code == std::errc() && rest == word.data() + word.size() && std::isfinite(value);
    if (number && fields.size() <= 2) {
      values->push_back(value);
      if (fields.size() == 2) names->push_back(fields[0]);
    } else if (!first || number) {
      return name + " line " + std::to_string(line) + ": '" + printable(row) + "': write one finite number a line, or name,value";
    }
    first = false;
  }
  if (values->empty()) return name + ": no numbers: write one a line, or name,value";
  if (!names->empty() && names->size() != values->size()) return name + ": some lines have names, some have none: give all or none";
  return {};
}

}  // namespace bs
