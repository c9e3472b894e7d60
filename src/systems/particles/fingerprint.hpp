// The numbers of the tables that a lattice's fingerprint is summed over.
#pragma once
#include <cstdint>
#include <string>

namespace bs {

/// A table's number by its name, so that the order of columns does not matter.
inline std::uint64_t table_of(const std::string& name) {
  std::uint64_t table = 0;
  for (const char c : name) table = 131 * table + static_cast<unsigned char>(c);
  return table;
}

/// Of numbers of springs and of masses.
inline std::uint64_t numbers_table(const std::string& name) {
  return name == "mass" ? 2 : name == "stiffness" ? 6 : name == "rest_length" ? 7 : name == "damping" ? 8 : 1000 + table_of(name);
}

}  // namespace bs
