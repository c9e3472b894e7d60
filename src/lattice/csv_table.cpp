#include "lattice/csv_table.hpp"

#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include "base/text.hpp"

namespace bs {

namespace {

enum class Parsed { number, not_finite, out_of_range, none };

/// The whole of `word` as a number, whatever the locale.
Parsed parse(std::string_view word, double* value) {
  const char *begin = word.data(), *end = begin + word.size();
  if (word.size() > 1 && *begin == '+' && begin[1] != '-') ++begin;  // from_chars takes no plus sign
  const auto [rest, code] = std::from_chars(begin, end, *value);
  if (rest != end || code == std::errc::invalid_argument) return Parsed::none;
  if (code == std::errc::result_out_of_range) return Parsed::out_of_range;
  return std::isfinite(*value) ? Parsed::number : Parsed::not_finite;
}

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Takes the next field off the front of `line` and says whether there was one. Two commas have an empty field between
/// them, so has a comma at the end: `after_comma` tells that one has just been passed.
bool next_field(std::string_view* line, bool* after_comma, std::string_view* field) {
  const auto skip = [line] {
    while (!line->empty() && is_blank(line->front())) line->remove_prefix(1);
  };
  skip();
  if (line->empty() && !*after_comma) return false;
  std::size_t n = 0;
  while (n < line->size() && (*line)[n] != ',' && !is_blank((*line)[n])) ++n;
  *field = line->substr(0, n);
  line->remove_prefix(n);
  skip();
  *after_comma = !line->empty() && line->front() == ',';
  if (*after_comma) line->remove_prefix(1);
  return true;
}

/// Reads line after line into a table; `error` stays empty while all is well.
class Reader {
 public:
  Reader(const std::string& name, int least, int most) : name_(name), least_(least), most_(most) {}

  void read(std::string_view text) {
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
    while (!text.empty() && error.empty()) {
      const std::size_t end = text.find('\n');
      std::string_view row = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      ++line_;
      row = row.substr(0, row.find('#'));
      if (row.find_first_not_of(" \t\r") == std::string_view::npos) continue;
      if (!(first_ && is_header(row))) read_row(row);
      first_ = false;
    }
    if (error.empty() && table.values.empty())
      error = name_ + ": no rows of numbers: write one row a line, " + columns_text() + " numbers each, time first";
  }

  CsvTable table;
  std::string error;

 private:
  static bool is_header(std::string_view row) {
    bool after_comma = false, words = false;
    double ignored = 0;
    for (std::string_view field; next_field(&row, &after_comma, &field);) {
      if (parse(field, &ignored) != Parsed::none) return false;
      words = words || !field.empty();
    }
    return words;
  }

  void read_row(std::string_view row) {
    bool after_comma = false;
    int count = 0;
    for (std::string_view field; next_field(&row, &after_comma, &field); ++count)
      if (count < most_ && !read_field(field, count)) return;
    const bool same = table.columns == 0 || count == table.columns;
    if (count < least_ || count > most_ || !same) {
      const std::string wanted = table.columns > 0 ? std::to_string(table.columns) + ", as in the rows above" : columns_text();
      return fail(std::to_string(count) + (count == 1 ? " number" : " numbers") + " in the row: write " + wanted);
    }
    table.columns = count;
  }

  /// Appends column `column` of the present row.
  bool read_field(std::string_view field, int column) {
    double value = 0;
    const Parsed parsed = parse(field, &value);
    if (parsed == Parsed::number && column == 0 && !table.values.empty()) {
      const double before = table.values[table.values.size() - static_cast<std::size_t>(table.columns)];
      if (value <= before) {
        fail("time " + plain_number(value) + " is not after " + plain_number(before) +
             " of the row above: write rows in increasing order of time, each time once");
        return false;
      }
    }
    if (parsed == Parsed::number) {
      table.values.push_back(value);
      return true;
    }
    const std::string shown = "column " + std::to_string(column + 1) + " '" + printable(std::string(field.substr(0, 60))) + "' ";
    if (parsed == Parsed::not_finite) fail(shown + "is not finite: write a finite number");
    if (parsed == Parsed::out_of_range) fail(shown + "is out of the range of a double: write a number within it");
    if (parsed == Parsed::none)
      fail(field.empty() ? "column " + std::to_string(column + 1) + " is empty: write a number, no comma at the end"
                         : shown + "is not a number: write numbers separated by commas or blanks, like 0.5,1e-3");
    return false;
  }

  void fail(const std::string& what) { error = name_ + " line " + std::to_string(line_) + ": " + what; }

  std::string columns_text() const {
    if (least_ == most_) return std::to_string(least_);
    return std::to_string(least_) + " to " + std::to_string(most_);
  }

  std::string name_;
  int least_, most_;
  bool first_ = true;  ///< no line with content yet
  long long line_ = 0;
};

}  // namespace

bool read_csv_table(const std::string& text, const std::string& name, int columns_min, int columns_max, CsvTable* out, std::string* error) {
  Reader reader(name, columns_min, columns_max);
  reader.read(text);
  *error = reader.error;
  *out = error->empty() ? std::move(reader.table) : CsvTable();
  return error->empty();
}

}  // namespace bs
