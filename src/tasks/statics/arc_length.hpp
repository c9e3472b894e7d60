// Equilibrium paths through limit points: the load factor is an unknown, the length of the step along the path is given.
#pragma once
#include <petscts.h>
#include "base/handle.hpp"
#include "linalg/condensed/condensed.hpp"
#include "systems/equilibrium.hpp"
#include "tasks/statics/pseudo_time.hpp"
#include "time/ts_setup.hpp"

namespace bs {

struct ArcPath {
  double step = 1;     ///< what the first step changes s by, about
  double end = 1;      ///< s at which the path ends
  bool lower = false;  ///< it begins by lowering s
};

/// A step of the path of (x, s) with f(s, x) = 0, by Keller's pseudo arc length: with the tangent (t_x, t_s) at the last equilibrium,
///   <t_x, x - x_n>/X^2 + t_s (s - s_n) = ds
/// The bordered system is solved by two solves with the same S, for the force and for q = df/ds:
///   x <- x - z_f + z_q c,  s <- s + c
/// X makes both parts of the first tangent equal; ds is sqrt(2) times the TS's step, so that the first step changes s by that much.
/// Where the predictor passes the end of the path, the step is one to that load factor.
class ArcLength {
 public:
  /// Collective. Once the options of `ts` are read; the arguments must outlive the solver. `start`, attached already, finds the equilibrium that the
  /// path begins with.
  PetscErrorCode attach(TS ts, TSContext& context, Equilibrium& model, PseudoTime& start, const ArcPath& path);
  /// Collective. One step of the path, in the place of SNES's solve.
  PetscErrorCode solve(SNES snes);
  /// Of the last solve.
  double factor() const { return now_; }
  /// Where it started.
  double start_factor() const { return start_factor_; }
  bool at_end() const { return arrived_; }

 private:
  PetscErrorCode solve_at_load(SNES snes);
  PetscErrorCode raise_load(SNES snes, Vec X);
  PetscErrorCode begin(SNES snes, Vec X);
  PetscErrorCode linear_solves(SNES snes, Vec X, Vec F, bool* solved);
  PetscErrorCode predict(SNES snes, Vec X, bool* solved);
  PetscErrorCode correct(SNES snes, Vec X, Vec F);
  PetscErrorCode update(Vec X, Vec z, double part, double ds);
  PetscErrorCode product(Vec a, Vec b, double* value) const;

  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  Equilibrium* model_ = nullptr;
  PseudoTime* start_solver_ = nullptr;
  CondensedDemand of_start_, of_path_;  ///< what is demanded of linear solves
  ArcPath path_;
  VecHandle start_, tangent_, way_, q_, zq_, zf_;
  double start_factor_ = 0, now_ = 0;      ///< s_n, s
  double tangent_s_ = 0, length_ = 0;      ///< t_s, ds
  double way_s_ = 0;                       ///< of the last good step, with way_
  double scale_ = 0;                       ///< X^2; 0: not known yet
  double from_ = -1;                       ///< time at which the present step starts
  bool has_way_ = false, to_end_ = false;  ///< to_end_: this step is one at the load factor end_
  bool repeated_ = false;                  ///< the present step was tried before
  bool arrived_ = false;
};

}  // namespace bs
