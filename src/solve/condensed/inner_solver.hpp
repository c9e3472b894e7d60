// The linear solver of S w = b: defaults by size, storage that follows the preconditioner, lagging, and what to do where S
// is not positive definite.
#pragma once
#include <petscksp.h>
#include <string>
#include "base/handle.hpp"
#include "model/tangent.hpp"

namespace bs {

using KSPHandle = Handle<KSP, KSPDestroy>;
struct CondensedCounts;

/// Relative tolerance of the inner solve under an outer Krylov method.
inline constexpr double LOOSE_TOLERANCE = 1e-2;

/// Unknowns of S up to which it is solved by a sparse direct method.
inline constexpr PetscInt DIRECT_UNKNOWNS = 6000;

class InnerSolver {
 public:
  /// Collective. Reads the options -<outer>condensed_*.
  PetscErrorCode create(Tangent& tangent, const char* outer_prefix);
  bool created() const { return tangent_ != nullptr; }
  PetscErrorCode create_vector(Vec* out) const;
  /// Collective. S at the tangent's present state; the preconditioner is renewed when it has aged.
  PetscErrorCode assemble();
  PetscErrorCode set_up_on_blocks();
  void renew() { stale_ = true; }
  /// Relative tolerance of the next solves; -condensed_ksp_rtol overrides it.
  void set_tolerance(double rtol) { rtol_ = rtol; }
  /// Collective. solved: to the tolerance. Where S is indefinite the fallback solves, and is counted.
  PetscErrorCode solve(Vec b, Vec w, CondensedCounts* counts, bool* solved);
  PetscErrorCode view(PetscViewer viewer) const;
  PetscErrorCode describe(std::string* text) const;
  PetscErrorCode add_shifts(CondensedCounts* counts) const;
  /// Not collective. Whether a factorisation of S failed for want of memory.
  PetscErrorCode out_of_memory(bool* yes) const;

 private:
  PetscErrorCode set_defaults();
  PetscErrorCode choose_storage();
  PetscErrorCode solve_indefinite(Vec b, Vec w, CondensedCounts* counts, bool* solved);
  PetscErrorCode run(KSP ksp, Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  Tangent* tangent_ = nullptr;
  KSPHandle ksp_, fallback_;
  MatHandle S_, positive_;
  std::string prefix_;
  CondensedStorage storage_ = CondensedStorage::springs;
  int own_storage_ = -1;          ///< the user's choice
  bool own_rtol_ = false, direct_ = false;
  double rtol_ = 1e-5;
  // the preconditioner's age: iterations per digit when it was new and at the last solve
  bool stale_ = true, fresh_ = false;
  double sigma_ = 0, rate_new_ = 0, refresh_ = 1.3;
};

}  // namespace bs
