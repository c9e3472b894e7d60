// Random numbers by counter: a pure function of the seed and of what is numbered, so that nothing depends on ranks.
#pragma once
#include <cstdint>

namespace bs {

/// The output function of the splitmix64 generator (Steele, Lea, Flood 2014).
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

}  // namespace bs
