// A sum over rows that tells two sets of numbered rows apart, whatever rank holds which: for a lattice's fingerprint and
// for the checksums of a checkpoint.
#pragma once
#include <cstdint>
#include <cstring>
#include <vector>

namespace bs {

/// Sum over all rows, modulo 2^64, of a hash of (table, row, bits of the row's numbers). Add the sums of all ranks.
/// It does not protect against forgery.
class RowSum {
 public:
  /// Rows [first, first + rows) of table `table`, `columns` numbers each.
  template <class T>
  void add(std::uint64_t table, std::int64_t first, std::int64_t rows, int columns, const T* data) {
    for (std::int64_t i = 0; i < rows; ++i) {
      std::uint64_t hash = mix(mix(table + 1) ^ static_cast<std::uint64_t>(first + i));
      for (int c = 0; c < columns; ++c) hash = mix(hash ^ bits(data[i * columns + c]));
      sum_ += hash;
    }
  }
  template <class T>
  void add(std::uint64_t table, std::int64_t first, int columns, const std::vector<T>& data) {
    add(table, first, static_cast<std::int64_t>(data.size()) / columns, columns, data.data());
  }
  std::uint64_t value() const { return sum_; }

 private:
  // finaliser of splitmix64: every bit of the input moves every bit of the output
  static std::uint64_t mix(std::uint64_t z) {
    z += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  template <class T>
  static std::uint64_t bits(T value) {
    static_assert(sizeof(T) <= 8, "numbers of up to 64 bits");
    std::uint64_t word = 0;
    std::memcpy(&word, &value, sizeof value);
    return word;
  }
  std::uint64_t sum_ = 0;
};

}  // namespace bs
