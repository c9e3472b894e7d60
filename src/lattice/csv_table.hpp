// Tables of numbers over time, as text: one row a line.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace bs {

/// Finite numbers, row by row; the first column, the time, increases strictly. At least one row.
struct CsvTable {
  int columns = 0;
  std::vector<double> values;  ///< (rows, columns)
  std::size_t rows() const { return columns > 0 ? values.size() / static_cast<std::size_t>(columns) : 0; }
};

/// Reads the table in `text`. Numbers are separated by commas or blanks; '#' begins a comment; empty lines are passed
/// over; the first line may be a header (none of its fields is a number); lines may end in CR LF; a byte order mark is
/// passed over. All rows have the same number of columns, from columns_min to columns_max.
/// Returns false and one line in `error`, with `name` (of the file), the line and the remedy, if the text is otherwise;
/// `out` is then empty.
bool read_csv_table(const std::string& text, const std::string& name, int columns_min, int columns_max, CsvTable* out, std::string* error);

}  // namespace bs
