// What a run met on its way and went on with.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>
#include "base/facts.hpp"

namespace bs {

/// One list for a run, whatever its task: a warning is printed once, counted in the last line, named in the report, and stays with a run that is
/// continued from a checkpoint.
class Warnings {
 public:
  explicit Warnings(MPI_Comm comm) : comm_(comm) {}
  /// Collective. `key` names it in the report; a second one of that name is left out.
  PetscErrorCode add(const std::string& key, const std::string& text);
  bool has(const std::string& key) const;
  const std::vector<std::string>& keys() const { return keys_; }
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  MPI_Comm comm_;
  std::vector<std::string> keys_;
};

}  // namespace bs
