// Motions from their texts and tables.
#include "physics/whole/drive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/text.hpp"

namespace bs {

namespace {

const char* const FORMS =
    "write fixed, velocity:VX,VY,VZ, rotation:W,CX,CY (in space rotation:W,CX,CY,CZ,AX,AY,AZ), table:FILE, or components such as "
    "x=velocity:0.1,y=free";
const char* const COMPONENTS = "write free, fixed, velocity:V, sinusoid:A,F,PHASE, table:FILE or expression:TEXT";

/// Numbers between commas; false if one of them is none.
bool read_numbers(const std::string& text, std::vector<double>* out) {
  for (const std::string& word : split(text, ',')) {
    out->emplace_back();
    if (!read_number(word, &out->back())) return false;
  }
  return true;
}

/// Splits "KIND:REST".
std::string kind_of(const std::string& text, std::string* rest) {
  const std::size_t colon = text.find(':');
  *rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  return text.substr(0, colon);
}

/// Where the next component begins: ",x=", ",y=" or ",z=" at `from` or after it.
std::size_t next_component(const std::string& text, std::size_t from) {
  for (std::size_t k = from; k + 2 < text.size(); ++k)
    if (text[k] == ',' && text[k + 1] >= 'x' && text[k + 1] <= 'z' && text[k + 2] == '=' && (k + 3 >= text.size() || text[k + 3] != '=')) return k;
  return text.size();
}

}  // namespace

bool Drive::parse(const std::string& text, int dim, std::string* error, bool placed) {
  text_ = text;
  dim_ = dim;
  placed_ = placed;
  std::string rest;
  if (text.size() < 2 || text[1] != '=') {
    const std::string kind = kind_of(text, &rest);
    std::vector<double> numbers;
    if (kind == "table" && !rest.empty()) {
      tables_.emplace_back(rest, dim);
      table_of_.push_back(-1);
      for (int c = 0; c < dim; ++c) component_[c].kind = Kind::table;
    } else if (!rest.empty() && !read_numbers(rest, &numbers)) {
      *error = "'" + shown_text(rest) + "' are not finite numbers: " + FORMS;
      return false;
    } else if (!parse_whole(kind, numbers, error)) {
      return false;
    }
    note_held();
    return true;
  }
  bool seen[3] = {false, false, false};
  for (std::size_t at = 0; at < text.size();) {
    const int c = text[at] - 'x';
    if (c < 0 || c >= dim || text[at + 1] != '=' || seen[c]) {
      *error = seen[std::clamp(c, 0, 2)] ? std::string("component ") + text[at] + " is given twice: write each once"
                                         : "the lattice has no component " + std::string(1, text[at]) + ": " + FORMS;
      return false;
    }
    seen[c] = true;
    const std::size_t end = next_component(text, at + 2);
    const std::size_t before = tables_.size();
    if (!parse_component(text.substr(at + 2, end - at - 2), &component_[c], error)) return false;
    if (tables_.size() > before) table_of_.push_back(c);
    at = end + 1;
  }
  note_held();
  if (held_ != 0) return true;
  *error = std::string("no component is held: leave the option out, or ") + COMPONENTS;
  return false;
}

void Drive::note_held() {
  for (int c = 0; c < dim_; ++c) {
    const Kind kind = component_[c].kind;
    if (rotation_ || kind != Kind::free) held_ |= static_cast<std::uint8_t>(1 << c);
    if (rotation_ || (kind != Kind::free && kind != Kind::fixed)) moving_ |= static_cast<std::uint8_t>(1 << c);
    if (kind == Kind::given) given_ |= static_cast<std::uint8_t>(1 << c);
  }
}

bool Drive::parse_whole(const std::string& kind, const std::vector<double>& numbers, std::string* error) {
  if (kind == "rotation") return parse_rotation(numbers, error);
  if ((kind == "fixed" || kind == "given") && numbers.empty()) {
    for (int c = 0; c < dim_; ++c) component_[c].kind = kind == "fixed" ? Kind::fixed : Kind::given;
    return true;
  }
  if (kind == "velocity") {
    if (static_cast<int>(numbers.size()) != dim_) {
      *error = "velocity: needs " + how_many(dim_, "number") + " [m/s], one for each component: " + FORMS;
      return false;
    }
    for (int c = 0; c < dim_; ++c) {
      component_[c].kind = Kind::velocity;
      component_[c].rate = numbers[static_cast<std::size_t>(c)];
    }
    return true;
  }
  *error = "'" + shown_text(text_) + "' is no motion: " + FORMS;
  return false;
}

bool Drive::parse_rotation(const std::vector<double>& n, std::string* error) {
  if (dim_ < 2 || n.size() != (dim_ == 2 ? 3u : 7u)) {
    *error = dim_ == 1   ? "rotation: one dimension has no rotations: write velocity:V"
             : dim_ == 2 ? "rotation: write the angular velocity and a point, rotation:W,CX,CY [rad/s, m]"
                         : "rotation: write the angular velocity, a point and an axis, rotation:W,CX,CY,CZ,AX,AY,AZ [rad/s, m]";
    return false;
  }
  rotation_ = true;
  omega_ = n[0];
  for (std::size_t c = 0; c < static_cast<std::size_t>(dim_); ++c) center_[c] = n[1 + c];
  if (dim_ == 2) return true;
  const double length = std::hypot(n[4], n[5], n[6]);
  if (!(length > 0)) {
    *error = "rotation: the axis has no direction: write three numbers that are not all 0";
    return false;
  }
  for (std::size_t c = 0; c < 3; ++c) axis_[c] = n[4 + c] / length;
  return true;
}

bool Drive::parse_component(const std::string& text, Component* out, std::string* error) {
  std::string rest;
  std::vector<double> n;
  const std::string kind = kind_of(text, &rest);
  if (kind == "expression") {
    out->kind = Kind::expression;
    return out->expression.parse(rest, placed_, error);
  }
  if (kind == "table" && !rest.empty()) {
    out->kind = Kind::table;
    tables_.emplace_back(rest, 1);
    return true;
  }
  const bool numbers = rest.empty() || read_numbers(rest, &n);
  if (kind == "free" && n.empty()) out->kind = Kind::free;
  else if (kind == "fixed" && n.empty()) out->kind = Kind::fixed;
  else if (kind == "given" && n.empty()) out->kind = Kind::given;
  else if (kind == "velocity" && n.size() == 1) out->kind = Kind::velocity;
  else if (kind == "sinusoid" && (n.size() == 2 || n.size() == 3)) out->kind = Kind::sinusoid;
  else {
    *error = "'" + shown_text(text) + "' is no motion of a component: " + COMPONENTS;
    return false;
  }
  if (!numbers) {
    *error = "'" + shown_text(rest) + "' are not finite numbers: " + COMPONENTS;
    return false;
  }
  if (out->kind == Kind::velocity) out->rate = n[0];
  if (out->kind == Kind::sinusoid) {
    out->amplitude = n[0];
    out->frequency = n[1];
    out->phase = n.size() > 2 ? n[2] : 0;
  }
  return true;
}

bool Drive::set_table(std::size_t k, const CsvTable& table, std::string* error) {
  const std::size_t rows = table.rows(), columns = static_cast<std::size_t>(table.columns);
  if (rows < 2) {
    *error = tables_[k].first + ": what is given over time needs two rows or more: add rows, or give a constant";
    return false;
  }
  for (std::size_t c = 0; c < static_cast<std::size_t>(tables_[k].second); ++c) {
    Component& one = component_[table_of_[k] < 0 ? c : static_cast<std::size_t>(table_of_[k])];
    for (std::size_t row = 0; row < rows; ++row) {
      one.time.push_back(table.values[row * columns]);
      one.shift.push_back(1 + c < columns ? table.values[row * columns + 1 + c] : 0.0);
      if (row > 0 && !std::isfinite((one.shift[row] - one.shift[row - 1]) / (one.time[row] - one.time[row - 1]))) {
        *error =
            tables_[k].first + ": the rate of change between two rows is not finite: give rows further apart in time, or values nearer to each other";
        return false;
      }
    }
  }
  return true;
}

}  // namespace bs
