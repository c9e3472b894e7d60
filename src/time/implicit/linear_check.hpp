// Linear models: a check that a linear solve has solved its system. Newton's iterations end by the residual; where one linear
// solve is the whole step, only its own residual can show it.
#pragma once
#include "time/ts_setup.hpp"

namespace bs {

/// After every linear solve that reports convergence, with one product:  |b - A x| <= tol |b|, or rounding errors. tol is 1e-6, or
/// 100 times the tolerance of an iterative solver where that is more, at most 0.1.
class LinearCheck {
 public:
  /// Collective. For linear models, and where one linear solve is a stage (rosw) by another solver than the condensed one. `context` must outlive the
  /// solver.
  PetscErrorCode attach(TS ts, const TSContext& context);
  /// Whether the last solve left too large a residual.
  bool failed() const { return failed_; }
  /// |b - A x|/|b| of the last solve that failed.
  double residual() const { return residual_; }

 private:
  static PetscErrorCode after_solve(KSP ksp, Vec b, Vec x, void* self);
  PetscErrorCode judge(KSP ksp, Vec b, Vec x);

  const TSContext* context_ = nullptr;
  TS ts_ = nullptr;
  VecHandle work_;
  bool failed_ = false;
  double residual_ = 0;
};

}  // namespace bs
