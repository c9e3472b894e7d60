// Factors that were not made for want of memory, or of the work space that was reckoned with.
#pragma once
#include <petscksp.h>
#include <string>
#include "base/handle.hpp"

namespace bs {

/// The analysis, the factorisation or the solve ended for want of memory or of work space.
inline bool mumps_lacks_memory(long infog) {
  for (const long code : {-5, -7, -8, -9, -11, -12, -13, -14, -15, -17, -19, -20})
    if (infog == code) return true;
  return false;
}

/// "-9": raise what; `prefix` of the options of these factors.
inline std::string mumps_memory_remedy(long infog, const std::string& prefix) {
  if (infog == -19) return "give a larger -" + prefix + "mat_mumps_icntl_23 (MB a rank), or leave it out";
  if (infog == -5 || infog == -7 || infog == -13) return "raise the memory limit";
  return "give a larger -" + prefix + "mat_mumps_icntl_14 (percent)";
}

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

constexpr PetscInt MUMPS_WORK_SPACE = 14;  ///< of its ICNTL: percent beyond its estimate
/// Collective. Where MUMPS found that too small for `factors` (pivots that are put off need more): with what to make others in their place; else 0,
/// and where an option says how much it may be (-mat_mumps_icntl_14).
PetscErrorCode wider_work_space(Mat factors, PetscInt* percent);
/// Collective. KSPSetUp(), anew for as long as that helps.
PetscErrorCode set_up_solver(KSP ksp);

/// Collective over `comm`. Of `pc`, or of the solvers that it consists of: blocks, splits, the condensed system's.
PetscErrorCode find_memory_lack(MPI_Comm comm, PC pc, MemoryLack* out);
/// The same of factors without a PC, of which `failed` is true on all ranks.
PetscErrorCode find_memory_lack(Mat factors, MemoryLack* out);

}  // namespace bs
