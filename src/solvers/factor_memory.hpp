// Factors that were not made for want of memory.
#pragma once
#include <petscksp.h>
#include <string>
#include "base/handle.hpp"

namespace bs {

struct MemoryLack {
  bool yes = false;
  PetscInt infog = 0;  ///< by which MUMPS says so; 0: another package
  std::string prefix;  ///< of the options of these factors
  std::string why() const;
  /// `other`: what needs less memory.
  std::string remedy(const std::string& other = ITERATIVE) const;
  /// Why and remedy in one sentence.
  std::string said(const std::string& other = ITERATIVE) const { return why() + ": " + remedy(other); }
  static constexpr char ITERATIVE[] = "an iterative solver (-condensed_pc_type bicc; -ksp_type gmres -pc_type bjacobi)";
};

/// Collective over `comm`. Of `pc`, or of the solvers that it consists of: blocks, splits, the condensed system's.
PetscErrorCode find_memory_lack(MPI_Comm comm, PC pc, MemoryLack* out);
/// The same of factors without a PC, of which `failed` is true on all ranks.
PetscErrorCode find_memory_lack(Mat factors, MemoryLack* out);

}  // namespace bs
