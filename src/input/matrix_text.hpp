// Matrices and vectors as text: Matrix Market, read line by line, of which nothing but the line at hand is held; vectors, one number a line.
// No PETSc.
#pragma once
#include <cstdint>
#include <istream>
#include <string>
#include <vector>

namespace bs {

/// One nonzero, 0-based.
struct MatrixEntry {
  std::int64_t row = 0, column = 0;
  double value = 0;
};

/// Coordinate and array files; real, integer or pattern (ones); general, symmetric or skew-symmetric. Comments (%) and
/// empty lines are passed over. Of symmetric files the other triangle is delivered too.
class MatrixMarketReader {
 public:
  /// `name` of the file, for messages.
  MatrixMarketReader(std::istream& in, std::string name) : in_(in), name_(std::move(name)) {}
  /// Reads up to and with the line of sizes. False: see error().
  bool open();
  std::int64_t rows() const { return rows_; }
  std::int64_t columns() const { return columns_; }
  /// The next entry; false at the end and after an error. Array files deliver zeros too; entries may repeat (they add up).
  bool next(MatrixEntry* entry);
  /// One line with file, line and remedy; empty if all is well.
  const std::string& error() const { return error_; }
  std::int64_t line() const { return line_; }

 private:
  enum class Symmetry { general, symmetric, skew };
  bool read_banner();
  bool read_line();
  bool next_content();
  bool next_coordinate(MatrixEntry* entry);
  bool next_array(MatrixEntry* entry);
  bool check_end();
  void mirror(const MatrixEntry& entry);
  bool fail(const std::string& what);

  std::istream& in_;
  std::string name_, text_, error_;
  const char *at_ = nullptr, *end_ = nullptr;  ///< what is left of the line
  std::int64_t rows_ = 0, columns_ = 0, count_ = 0, done_ = 0, line_ = 0, row_ = 0, column_ = 0;
  bool array_ = false, pattern_ = false, mirrored_ = false, ended_ = false;
  Symmetry symmetry_ = Symmetry::general;
  MatrixEntry mirror_;
};

/// Reads the CSV form of a vector: a number a line, or `name,value`; a first line without a number is a header. `name` is
/// the file's, for messages. Returns one line of error, empty if all is well; values are finite, and there are as many
/// names as values, or none.
std::string read_vector_csv(const std::string& text, const std::string& name, std::vector<double>* values, std::vector<std::string>* names);

}  // namespace bs
