// Accurate first steps for bdf of order 3 to 6, which PETSc starts by steps of order 1 and 2.
#pragma once
#include <petscts.h>
#include <vector>
#include "base/handle.hpp"

namespace bs {

// Replay of known steps in a TS, to restore its history of earlier steps.

class Replay {
 public:
  /// Collective. Keeps the state of `ts` and puts a solver in place of its own that takes answers from a list.
  PetscErrorCode begin(TS ts);
  /// The state `ts` had.
  Vec present() const { return present_; }
  /// Collective. The step of length h from (time, y) to `end`; `half`: what its starting procedure finds first, or null.
  PetscErrorCode step(double time, double h, Vec y, Vec half, Vec end);
  /// Collective. Everything as it was, but for the memory.
  PetscErrorCode end(double time, double h);

 private:
  static PetscErrorCode answer(SNES snes, Vec x);
  PetscErrorCode repeat_step(double time, double h, Vec y);
  TS ts_ = nullptr;
  SNESHandle own_, knowing_;
  VecHandle present_, residual_;
  std::vector<Vec> answers_;  ///< in the order they are asked for
  std::size_t asked_ = 0;
  PetscInt steps_ = 0;
};

/// For the first k - 2 steps of order k a solver that finds y(t_n + h) to order k - 1 stands in the place of Newton's: the
/// type takes its answer for the solution of its own equation, and later for a past state. The answer is extrapolated from
/// T_j, y(t_n + h) by j steps of backward Euler of h/j, each solved by the solver of `ts`:
///   y(t_n + h) = sum over j = 1 ... p of c_j T_j,   c_j = product over i != j of j/(j - i),   p = k - 1
/// whose error is of h^(p+1): the powers of h/j in between cancel. Linear algebraic equations hold in it as in every T_j.
/// From step k - 1 on the type has the k past states that its order needs, the one at half of its first step among them.
class Starter {
 public:
  /// Collective. Once the solvers of `ts` are set up.
  PetscErrorCode begin(TS ts, PetscInt order);
  /// Collective. The solver of `ts` is its own again.
  PetscErrorCode end();
  bool active() const { return ts_ != nullptr; }
  /// The time the next solve is for.
  void aim(double time) { goal_ = time; }

 private:
  static PetscErrorCode solve(SNES snes, Vec x);
  static PetscErrorCode residual(SNES snes, Vec x, Vec F, void* self);
  static PetscErrorCode jacobian(SNES snes, Vec x, Mat A, Mat P, void* self);
  PetscErrorCode extrapolate(Vec x, bool* good);
  PetscErrorCode solve_parts(Vec x, int count, bool* good);
  PetscErrorCode solve_part(Vec x, bool* good);
  PetscErrorCode slope(Vec x);

  TS ts_ = nullptr;
  SNESHandle own_, starting_;
  int columns_ = 0;                        ///< p
  double goal_ = 0, time_ = 0, part_ = 0;  ///< end of the step; of a part of it; its length
  VecHandle before_, rate_, sum_;          ///< start of a part; (x - start)/length; sum of c_j T_j
  PetscInt newton_ = 0, krylov_ = 0;
};

}  // namespace bs
