#include <algorithm>
#include <cmath>
#include <cstring>
#include "input/matrix_load.hpp"

namespace bs {
namespace {

std::string number(std::int64_t value) { return std::to_string(value); }

/// `count` big-endian integers; false if the file ends before.
bool read_integers(std::ifstream& in, int bytes, std::size_t count, std::vector<std::int64_t>* values) {
  std::string raw(count * static_cast<std::size_t>(bytes), '\0');
  in.read(raw.data(), static_cast<std::streamsize>(raw.size()));
  if (in.gcount() != static_cast<std::streamsize>(raw.size())) return false;
  values->resize(count);
  const auto* at = reinterpret_cast<const unsigned char*>(raw.data());
  for (std::int64_t& value : *values) {
    std::uint64_t bits = at[0] & 0x80u ? ~std::uint64_t{0} : 0;  // of a negative number
    for (int k = 0; k < bytes; ++k) bits = bits << 8 | *at++;
    value = static_cast<std::int64_t>(bits);
  }
  return true;
}

bool read_doubles(std::ifstream& in, std::size_t count, std::vector<double>* values) {
  std::vector<std::int64_t> bits;
  if (!read_integers(in, 8, count, &bits)) return false;
  values->resize(count);
  if (count > 0) std::memcpy(values->data(), bits.data(), count * sizeof(double));
  return true;
}

std::int64_t size_of(std::ifstream& in) {
  in.seekg(0, std::ios::end);
  const std::int64_t bytes = static_cast<std::int64_t>(in.tellg());
  in.seekg(0);
  return bytes;
}

/// What is wrong where a file of `bytes` should have `wanted`.
std::string wrong_size(std::int64_t bytes, double wanted) {
  return "has " + number(bytes) + " bytes, its head asks for " +
         (wanted < 9e15 ? number(static_cast<std::int64_t>(wanted)) : "more than there can be") +
         ": it is damaged, not complete, of complex numbers, or holds more than one object";
}

}  // namespace

std::int64_t petsc_class_id(const std::string& path, int* index_bytes) {
  std::vector<std::int64_t> id;
  for (const int bytes : {4, 8}) {
    std::ifstream in(path, std::ios::binary);
    *index_bytes = bytes;
    if (!read_integers(in, bytes, 1, &id)) return 0;
    if (id[0] != 0) break;
  }
  return id[0];
}

bool PetscMatrixReader::fail(const std::string& what) {
  if (error_.empty()) error_ = name_ + ": " + what + "; write it again, in PETSc by MatView";
  return false;
}

bool PetscMatrixReader::open() {
  std::vector<std::int64_t> head;
  indices_.open(name_, std::ios::binary);
  const std::int64_t bytes = size_of(indices_);
  if (!read_integers(indices_, index_bytes_, 4, &head)) return fail("ends within its head");
  rows_ = head[1];
  columns_ = head[2];
  count_ = head[3];
  if (count_ == -1) return fail("holds a dense matrix: save a sparse one (MATAIJ)");
  if (rows_ < 1 || columns_ < 1 || count_ < 0)
    return fail("sizes " + number(rows_) + " x " + number(columns_) + " with " + number(count_) + " entries: they must be positive");
  // in floating point: the numbers may be any
  const double wanted = index_bytes_ * (4.0 + static_cast<double>(rows_) + static_cast<double>(count_)) + 8.0 * static_cast<double>(count_);
  if (static_cast<double>(bytes) != wanted) return fail(wrong_size(bytes, wanted));
  if (!read_integers(indices_, index_bytes_, static_cast<std::size_t>(rows_), &lengths_)) return fail("ends within the lengths of its rows");
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < lengths_.size(); ++i) {
    if (lengths_[i] < 0 || lengths_[i] > columns_)
      return fail("row " + number(static_cast<std::int64_t>(i) + 1) + " has " + number(lengths_[i]) + " entries in " + number(columns_) + " columns");
    sum += lengths_[i];
    if (sum > count_) break;
  }
  if (sum != count_) return fail("the lengths of its rows do not add up to its " + number(count_) + " entries");
  numbers_.open(name_, std::ios::binary);
  numbers_.seekg(index_bytes_ * (4 + rows_ + count_));
  return true;
}

/// The next row that has entries: its columns and values, checked.
bool PetscMatrixReader::read_row() {
  do {
    if (++row_ >= rows_) return false;
  } while (lengths_[static_cast<std::size_t>(row_)] == 0);
  const std::size_t length = static_cast<std::size_t>(lengths_[static_cast<std::size_t>(row_)]);
  const std::string where = "row " + number(row_ + 1) + ": ";
  if (!read_integers(indices_, index_bytes_, length, &row_columns_) || !read_doubles(numbers_, length, &row_values_))
    return fail(where + "the file ends before it does");
  for (std::size_t k = 0; k < length; ++k) {
    if (row_columns_[k] < 0 || row_columns_[k] >= columns_)
      return fail(where + "column " + number(row_columns_[k]) + " (from 0) lies outside " + number(rows_) + " x " + number(columns_));
    if (!std::isfinite(row_values_[k])) return fail(where + "the value in column " + number(row_columns_[k]) + " (from 0) is not finite");
  }
  std::vector<std::int64_t> sorted = row_columns_;
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) return fail(where + "column " + number(*twice) + " (from 0) stands there twice");
  at_ = 0;
  return true;
}

bool PetscMatrixReader::next(MatrixEntry* entry) {
  if (!error_.empty() || row_ >= rows_) return false;
  if ((row_ < 0 || at_ == row_columns_.size()) && !read_row()) return false;
  *entry = {row_, row_columns_[at_], row_values_[at_]};
  ++at_;
  return true;
}

std::string read_petsc_vector(const std::string& path, int index_bytes, std::vector<double>* values) {
  const std::string anew = "; write it again, in PETSc by VecView";
  std::ifstream in(path, std::ios::binary);
  std::vector<std::int64_t> head;
  const std::int64_t bytes = size_of(in);
  if (!read_integers(in, index_bytes, 2, &head)) return path + ": ends within its head" + anew;
  const double wanted = 2.0 * index_bytes + 8.0 * static_cast<double>(head[1]);
  if (head[1] < 0 || static_cast<double>(bytes) != wanted) return path + ": " + wrong_size(bytes, std::max(wanted, 0.0)) + anew;
  if (!read_doubles(in, static_cast<std::size_t>(head[1]), values)) return path + ": the file ends before its values do" + anew;
  for (std::size_t k = 0; k < values->size(); ++k)
    if (!std::isfinite((*values)[k])) return path + ": value " + number(static_cast<std::int64_t>(k) + 1) + " is not finite" + anew;
  return {};
}

}  // namespace bs
