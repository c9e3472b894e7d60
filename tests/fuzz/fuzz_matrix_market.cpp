// Matrices and vectors as text.
#include <sstream>
#include "common.hpp"
#include "input/matrix_text.hpp"

namespace {

void read_matrix(const std::string& text) {
  std::istringstream in(text);
  bs::MatrixMarketReader reader(in, "f.mtx");
  if (reader.open()) {
    bs::MatrixEntry entry;
    std::size_t count = 0;
    while (reader.next(&entry)) {
      require(entry.row >= 0 && entry.row < reader.rows() && entry.column >= 0 && entry.column < reader.columns(), "entries lie in the matrix");
      require(std::isfinite(entry.value), "numbers are finite");
      require(++count <= 2 * text.size(), "no more entries than the text can hold");
    }
    require(!reader.next(&entry), "the end stays the end");
  } else {
    require(!reader.error().empty(), "a failure has a message");
  }
  if (!reader.error().empty()) require_message(reader.error(), "f.mtx line ");
}

void read_vector(const std::string& text) {
  std::vector<double> values;
  std::vector<std::string> names;
  const std::string error = bs::read_vector_csv(text, "f.csv", &values, &names);
  if (!error.empty()) return require_message(error, "f.csv");
  require(!values.empty() && (names.empty() || names.size() == values.size()), "one name a value, or none");
  require_finite(values);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of(data, size);
  read_matrix(text);
  read_vector(text);
  return 0;
}
