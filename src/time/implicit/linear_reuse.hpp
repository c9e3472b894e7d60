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
  /// Collective. Before step `step` (0: the first) of length h [s]: its theta, matrix and preconditioner.
  PetscErrorCode before_step(TS ts, PetscInt step, double h);
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

}  // namespace bs
