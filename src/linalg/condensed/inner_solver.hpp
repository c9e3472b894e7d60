// The inner solver of the condensed solve: storage of S, its KSP and preconditioner, their renewal, and what to do where S
// is not positive definite.
#pragma once
#include <petscksp.h>
#include <petscpc.h>
#include <algorithm>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "linalg/block_icc.hpp"
#include "linalg/condensed/absolute.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/condensed/tangent.hpp"

namespace bs {

/// What the symmetric S leaves out of the condensed system (dampers along springs whose ends move across them): a flexible
/// Krylov method on the exact S, preconditioned by the solver of the symmetric one.
class ExactCorrection {
 public:
  /// Collective. w, which `symmetric` has solved for, is improved until |b - S w| <= rtol |b| with the exact S, if it is
  /// not there already. iterations: those of `symmetric` that it took; reason: negative where it did not get there.
  PetscErrorCode apply(Tangent& tangent, KSP symmetric, double rtol, Vec b, Vec w, PetscInt* iterations, KSPConvergedReason* reason);

 private:
  PetscErrorCode create(Tangent& tangent, KSP symmetric, Vec b);
  KSPHandle ksp_;
  MatHandle exact_;
  VecHandle left_;
};

/// When a preconditioner has aged, by the iterations its solves take, and which parts of it the next one keeps. The coarse space changes less from
/// state to state than the factors do: it is made anew, with all that was chosen for an earlier matrix, where new factors alone do not bring the
/// iterations back.
class PreconditionerAge {
 public:
  /// The next one is of another matrix, but of the same kind.
  void discard() noexcept {
    due_ = true;
    kept_ = std::min(kept_, KeptParts::choices);
  }
  /// The next one keeps nothing.
  void forget() noexcept {
    due_ = true;
    kept_ = KeptParts::none;
  }
  bool due() const noexcept { return due_; }
  /// A new one is made; what it keeps.
  KeptParts renew() noexcept {
    last_kept_ = kept_;
    due_ = false;
    kept_ = KeptParts::coarse_space;
    return last_kept_;
  }
  /// A solve took `rate` iterations per digit, with a preconditioner that was made for it (`fresh`) or before. Due is a new one where that is more
  /// than `most` times what it was with all parts new.
  void note(double rate, bool fresh, double most) noexcept {
    if (fresh && last_kept_ != KeptParts::coarse_space) new_rate_ = rate;
    if (rate <= most * new_rate_ + 1) return;
    due_ = true;
    if (fresh) kept_ = KeptParts::none;
  }

 private:
  bool due_ = true;
  KeptParts kept_ = KeptParts::none, last_kept_ = KeptParts::none;  ///< by the next one, and by the present one
  double new_rate_ = 0;
};

/// Relative tolerance of the inner solve under an outer Krylov method.
inline constexpr double LOOSE_TOLERANCE = 1e-2;

class InnerSolver {
 public:
  /// Collective. Reads the options -<outer>condensed_*.
  PetscErrorCode create(Tangent& tangent, const CondensedDemand& demand, const char* outer_prefix);
  void set_demand(const CondensedDemand& demand) { demand_ = demand; }
  bool created() const { return tangent_ != nullptr; }
  PetscErrorCode create_vector(Vec* out) const;
  /// Collective. S, or its definite part, at the tangent's present state; the preconditioner is renewed when it has aged.
  PetscErrorCode assemble(CondensedCounts* counts);
  PetscErrorCode set_up_on_blocks();
  /// Nothing is kept from earlier solves.
  void renew();
  /// Directions by a direct solver may come from iterations with the last factors of a positive definite S, as long as few are enough.
  void reuse_factors(bool yes) { reuse_ = yes; }
  /// Relative tolerance of the next solves; -condensed_ksp_rtol overrides it.
  void set_tolerance(double rtol) { rtol_ = rtol; }
  /// Collective. solved: w is what the demand asks for.
  PetscErrorCode solve(Vec b, Vec w, CondensedCounts* counts, bool* solved);
  /// Collective. Of S as it is at the tangent's present state, factored for this; -1: the solver is not direct, or its factors do not tell.
  PetscErrorCode negative_pivots(PetscInt* count);
  /// Collective. By at most `most` iterations with b, where the solver is not direct: a direction w with w.S w <= 0, as far as the precision of
  /// the stored S goes. found: false where none showed, which proves nothing.
  PetscErrorCode negative_direction(Vec b, PetscInt most, Vec w, bool* found);
  PetscErrorCode view(PetscViewer viewer) const;
  PetscErrorCode describe(std::string* text) const;
  PetscErrorCode add_counts(CondensedCounts* counts) const;
  /// What the last solve failed of; empty where it did not, or where S was not positive definite.
  std::string failure() const;
  /// All that there are, borrowed.
  std::vector<KSP> solvers() const;

 private:
  void renew_factors() {
    age_.discard();
    rebuild_ = true;
  }
  PetscErrorCode set_defaults();
  PetscErrorCode set_direct(PC pc, PCType type, PetscMPIInt ranks);
  PetscErrorCode choose_solver();
  PetscErrorCode create_solver();
  PetscErrorCode change_solver(bool direct);
  PetscErrorCode compare_with_factors(PetscInt iterations);
  PetscErrorCode ask_for_inertia();
  PetscErrorCode linearise(bool definite);
  PetscErrorCode keep_parts(PC pc, KeptParts parts) const;
  PetscErrorCode build_hierarchy();
  PetscErrorCode lift_diagonal();
  PetscErrorCode count_negative_pivots(PetscInt* count, bool* has);
  PetscErrorCode look_at_pivots(CondensedCounts* counts);
  PetscErrorCode solve_by_kept(Vec b, Vec w, CondensedCounts* counts, bool* solved);
  PetscErrorCode go_on(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  PetscErrorCode conclude(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason reason, bool* solved);
  PetscErrorCode solve_definite(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  PetscErrorCode solve_indefinite(Vec b, Vec w, CondensedCounts* counts, bool* solved);
  PetscErrorCode run(KSP ksp, Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  PetscErrorCode leads_downhill(Vec b, Vec w, bool* yes) const;
  PetscErrorCode take_definite(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  PetscErrorCode start_absolute(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  PetscErrorCode solve_absolute(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason);
  PetscErrorCode assemble_matrices(bool definite, Mat* multiplied);
  bool by_absolute() const { return demand_.direction && demand_.curvature == Curvature::automatic; }
  Tangent* tangent_ = nullptr;
  CondensedDemand demand_;
  KSPHandle ksp_, fallback_;
  MatHandle S_, exact_, positive_;
  AbsoluteSolve absolute_;
  ExactCorrection correction_;
  std::string prefix_;
  CondensedStorage storage_ = CondensedStorage::springs;
  int own_storage_ = -1;  ///< the user's choice
  bool own_rtol_ = false, direct_ = false;
  bool open_ = false;            ///< the user left the choice of all of it open
  bool factors_wanted_ = false;  ///< since iterations took more work; the next set-up makes them
  bool measured_ = false;        ///< it is direct for that reason
  std::string why_;              ///< it is direct, or is not
  double flops_ = -1;            ///< predicted of a factorisation; negative: not asked for
  double work_ = 0;              ///< operations of this rank in the last solve
  PetscInt factored_ = 0;        ///< times it became so
  PetscInt shifts_before_ = 0;   ///< of solvers that are no more
  double rtol_ = 1e-5;
  bool definite_ = false;                                ///< S_ is the definite part
  bool indefinite_ = false;                              ///< the last S was not positive definite
  bool lifted_ = false;                                  ///< the next S has its diagonal raised above rounding errors
  bool absolute_in_force_ = false;                       ///< directions come from absolute_, preconditioned by the definite part
  bool reuse_ = false, kept_ = false;                    ///< factors may be kept; exact_ holds S, and the factors are those of an earlier one
  bool positive_factors_ = false;                        ///< S_ is factored, by positive pivots
  KSPConvergedReason failed_ = KSP_CONVERGED_ITERATING;  ///< of the last solve; positive or 0: none
  PreconditionerAge age_;
  bool fresh_ = false;                   ///< the preconditioner is new, no solve has used it yet
  bool rebuild_ = true, built_ = false;  ///< levels of a multigrid method, too, which otherwise keeps its interpolation
  double sigma_ = 0, refresh_ = 1.3;
};

/// Collective. Conjugate gradients on S w = b, preconditioned by P: the first of their directions w with w.S w <= 0, within `most` iterations.
/// found: false where there was none, or P is not positive definite.
PetscErrorCode find_negative_curvature(Mat S, PC P, Vec b, PetscInt most, Vec w, bool* found);

}  // namespace bs
