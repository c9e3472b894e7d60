// Linear models: one matrix a step length, each with its own factorisation, so that a run with a constant step factors
// once, and a step shortened to hit an output time costs one more, not a third one on the way back.
#pragma once
#include "time/ts_setup.hpp"

namespace bs {

class LinearReuse {
 public:
  /// Collective. After the solvers are set up. Ends the run with exit code 2 if the model requires initial steps of backward Euler and the type is
  /// not of the theta family. Nothing is done for models that are not linear.
  PetscErrorCode attach(TS ts, TSContext& context);
  /// Collective. Before a step of length h [s], after `since` steps with memory: its theta, matrix and preconditioner.
  PetscErrorCode before_step(TS ts, std::int64_t since, double h);
  void save(Facts* facts) const;
  /// Collective. The matrices that the run had, which are those of the first lengths it met: others differ from these by rounding.
  PetscErrorCode restore(TS ts, const Facts& facts);

 private:
  struct Slot {
    Mat matrix = nullptr;  ///< borrowed
    PCHandle pc;
    double sigma = 0;  ///< of the matrix; 0: there was none
  };
  PetscErrorCode use(TS ts, int slot);
  PetscErrorCode create_second(TS ts);

  TSContext* context_ = nullptr;
  bool active_ = false;
  double theta_ = 1, nominal_ = 0, now_ = 1;
  std::int64_t startup_ = 0;
  Slot slots_[2];
  MatHandle second_;
  int used_ = 0;
};

/// sigma of the first step of length h: 1/(theta h) of the theta family, 1/h of others.
PetscErrorCode shift_of_step(TS ts, double h, double* sigma);

// Linear models: a check that a linear solve has solved its system. Newton's iterations end by the residual; where one linear
// solve is the whole step, only its own residual can show it.

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
  PetscErrorCode judge(KSP ksp, Vec b, Vec x);

  const TSContext* context_ = nullptr;
  TS ts_ = nullptr;
  VecHandle work_;
  bool failed_ = false;
  double residual_ = 0;
};

}  // namespace bs
