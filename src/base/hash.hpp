// Random numbers by counter: a pure function of the seed and of what is numbered, so that nothing depends on ranks. A sum over rows that tells two
// sets of numbered rows apart, whatever rank holds which: for a lattice's fingerprint and for the checksums of a checkpoint.
#pragma once
#include <cstdint>
#include <cstring>
#include <vector>

namespace bs {

/// The output function of the splitmix64 generator (Steele, Lea, Flood 2014): every bit of the input moves every bit of the output.
inline std::uint64_t splitmix64(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

/// What the numbers are drawn for: streams are independent of each other.
enum class Stream : std::uint64_t { perturbation = 1, stiff_springs = 2, breaking = 3, removal = 4, start = 5 };

/// Uniform in [0, 1): h(h(h(h(seed) + stream) + a) + b) / 2^64 with h = splitmix64, to 53 bits.
inline double hash_uniform(std::int64_t seed, Stream stream, std::int64_t a, std::int64_t b) {
  std::uint64_t z = splitmix64(static_cast<std::uint64_t>(seed)) + static_cast<std::uint64_t>(stream);
  z = splitmix64(z) + static_cast<std::uint64_t>(a);
  z = splitmix64(z) + static_cast<std::uint64_t>(b);
  return static_cast<double>(splitmix64(z) >> 11) * 0x1p-53;
}

/// Sum over all rows, modulo 2^64, of a hash of (table, row, bits of the row's numbers). Add the sums of all ranks.
/// It does not protect against forgery.
class RowSum {
 public:
  /// Rows [first, first + rows) of table `table`, `columns` numbers each.
  template <class T>
  void add(std::uint64_t table, std::int64_t first, std::int64_t rows, int columns, const T* data) {
    for (std::int64_t i = 0; i < rows; ++i) {
      std::uint64_t hash = splitmix64(splitmix64(table + 1) ^ static_cast<std::uint64_t>(first + i));
      for (int c = 0; c < columns; ++c) hash = splitmix64(hash ^ bits(data[i * columns + c]));
      sum_ += hash;
    }
  }
  template <class T>
  void add(std::uint64_t table, std::int64_t first, int columns, const std::vector<T>& data) {
    add(table, first, static_cast<std::int64_t>(data.size()) / columns, columns, data.data());
  }
  std::uint64_t value() const { return sum_; }

 private:
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
