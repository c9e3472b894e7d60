#include "input/matrix_text.hpp"
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include "base/text.hpp"

namespace bs {

namespace {

constexpr std::streamsize LONGEST = 1 << 16;  // characters in a line

void skip_blanks(const char** at, const char* end) {
  while (*at < end && (**at == ' ' || **at == '\t' || **at == '\r')) ++*at;
}

/// Reads one number from the front of the text and removes it; a blank or the end of the line must follow it.
template <class Number>
bool read_front(const char** at, const char* end, Number* value) {
  skip_blanks(at, end);
  const char* from = *at;
  if (from + 1 < end && *from == '+' && from[1] != '-') ++from;
  const auto [rest, code] = std::from_chars(from, end, *value);
  if (code != std::errc() || rest == from) return false;
  if (rest < end && *rest != ' ' && *rest != '\t' && *rest != '\r') return false;
  *at = rest;
  return true;
}

std::string number(std::int64_t value) { return std::to_string(value); }

}  // namespace

bool MatrixMarketReader::fail(const std::string& what) {
  if (error_.empty()) error_ = name_ + " line " + number(line_) + ": " + what;
  ended_ = true;
  return false;
}

/// Reads the next line into text_, at_ and end_; false at the end of the file, or where the line is too long.
bool MatrixMarketReader::read_line() {
  text_.resize(static_cast<std::size_t>(LONGEST));
  in_.getline(text_.data(), LONGEST);
  const std::streamsize got = in_.gcount();
  if (got == 0 && !in_) return false;
  ++line_;
  if (in_.fail()) return fail("longer than " + number(LONGEST) + " characters: is this a Matrix Market text file?");
  at_ = text_.data();
  end_ = at_ + (in_.eof() ? got : got - 1);
  return true;
}

/// Reads the next line that is neither empty nor a comment.
bool MatrixMarketReader::next_content() {
  while (read_line()) {
    skip_blanks(&at_, end_);
    if (at_ < end_ && *at_ != '%') return true;
  }
  return false;
}

bool MatrixMarketReader::read_banner() {
  const std::string example = "begin the file with '%%MatrixMarket matrix coordinate real general'";
  if (!read_line()) return fail("empty: " + example);
  std::istringstream words(std::string(at_, end_));
  std::string banner, object, layout, field, symmetry;
  words >> banner >> object >> layout >> field >> symmetry;
  if (lower(banner) != "%%matrixmarket" || lower(object) != "matrix") return fail("no Matrix Market banner: " + example);
  layout = lower(layout);
  field = lower(field);
  symmetry = lower(symmetry);
  if (layout != "coordinate" && layout != "array") return fail("'" + printable(layout) + "': write coordinate or array");
  array_ = layout == "array";
  pattern_ = field == "pattern";
  if (!pattern_ && field != "real" && field != "integer" && field != "double")
    return fail("entries of kind '" + printable(field) + "': write real, integer or pattern; the program computes with real numbers");
  if (pattern_ && array_) return fail("an array has no pattern: write real, or coordinate");
  if (symmetry == "symmetric") symmetry_ = Symmetry::symmetric;
  else if (symmetry == "skew-symmetric") symmetry_ = Symmetry::skew;
  else if (symmetry != "general") return fail("symmetry '" + printable(symmetry) + "': write general, symmetric or skew-symmetric");
  return true;
}

bool MatrixMarketReader::open() {
  if (!read_banner()) return false;
  if (!next_content()) return fail("the line of sizes is missing: write 'rows columns entries', or 'rows columns' of an array");
  const bool sizes = read_front(&at_, end_, &rows_) && read_front(&at_, end_, &columns_) && (array_ || read_front(&at_, end_, &count_));
  skip_blanks(&at_, end_);
  if (!sizes || at_ < end_)
    return fail(array_ ? "sizes are not two numbers: write 'rows columns'" : "sizes are not three numbers: write 'rows columns entries'");
  if (rows_ < 1 || columns_ < 1 || count_ < 0) return fail("sizes must be positive");
  if (symmetry_ != Symmetry::general && rows_ != columns_)
    return fail(number(rows_) + " x " + number(columns_) + " cannot be symmetric: write general");
  if (array_ && rows_ > std::numeric_limits<std::int64_t>::max() / columns_) return fail("the sizes are too large");
  if (symmetry_ == Symmetry::skew) row_ = 1;
  at_ = end_;
  return true;
}

/// Makes next() return the corresponding entry of the other triangle.
void MatrixMarketReader::mirror(const MatrixEntry& entry) {
  if (symmetry_ == Symmetry::general || entry.row == entry.column) return;
  mirror_ = {entry.column, entry.row, symmetry_ == Symmetry::skew ? -entry.value : entry.value};
  mirrored_ = true;
}

bool MatrixMarketReader::check_end() {
  ended_ = true;
  skip_blanks(&at_, end_);
  if (at_ < end_ || next_content()) return fail("more entries than the " + number(done_) + " that the line of sizes announces: mend that number");
  return false;
}

bool MatrixMarketReader::next(MatrixEntry* entry) {
  if (ended_) return false;
  if (mirrored_) {
    mirrored_ = false;
    *entry = mirror_;
    return true;
  }
  return array_ ? next_array(entry) : next_coordinate(entry);
}

bool MatrixMarketReader::next_coordinate(MatrixEntry* entry) {
  if (done_ == count_) return check_end();
  if (!next_content()) return fail("the file ends after " + number(done_) + " of " + number(count_) + " entries: is it complete?");
  std::int64_t i = 0, j = 0;
  double value = 1;
  const bool read = read_front(&at_, end_, &i) && read_front(&at_, end_, &j) && (pattern_ || read_front(&at_, end_, &value));
  skip_blanks(&at_, end_);
  if (!read || at_ < end_) return fail(pattern_ ? "write 'row column'" : "write 'row column value', like '3 1 -0.5'");
  at_ = end_;
  if (i < 1 || i > rows_ || j < 1 || j > columns_)
    return fail("entry (" + number(i) + ", " + number(j) + ") lies outside " + number(rows_) + " x " + number(columns_) +
                ": rows and columns count from 1");
  if (!std::isfinite(value)) return fail("the value is not finite");
  if (symmetry_ != Symmetry::general && i < j) return fail("entry above the diagonal of a symmetric matrix: write the lower triangle only");
  if (symmetry_ == Symmetry::skew && i == j) return fail("a skew-symmetric matrix has no diagonal: leave it out");
  *entry = {i - 1, j - 1, value};
  ++done_;
  mirror(*entry);
  return true;
}

/// Values column by column; of symmetric files the lower triangle, with the diagonal unless skew.
bool MatrixMarketReader::next_array(MatrixEntry* entry) {
  const std::int64_t below = symmetry_ == Symmetry::skew ? 1 : 0;
  if (column_ == columns_ || (below && columns_ == 1)) return check_end();
  skip_blanks(&at_, end_);
  if (at_ == end_ && !next_content()) return fail("the file ends after " + number(done_) + " values: is it complete?");
  double value = 0;
  if (!read_front(&at_, end_, &value)) return fail("not a number: write one value a line");
  if (!std::isfinite(value)) return fail("the value is not finite");
  *entry = {row_, column_, value};
  ++done_;
  if (++row_ == rows_) {
    ++column_;
    row_ = symmetry_ == Symmetry::general ? 0 : column_ + below;
    if (below && column_ == columns_ - 1) column_ = columns_;
  }
  mirror(*entry);
  return true;
}

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
