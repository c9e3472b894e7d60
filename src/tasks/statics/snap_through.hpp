// Whether a load step has jumped from one branch of equilibria to another.
#pragma once
#include <petscts.h>
#include <cstdint>
#include "base/error.hpp"
#include "base/facts.hpp"
#include "tasks/statics/pseudo_time.hpp"

namespace bs {

/// A load step that releases more energy than the work of its loads accounts for is looked at more closely: it is halved again and again, each time
/// the half in which more happens, until a 32nd of it is left. What is continuous changes about alike in both halves then; a jump lies in one of
/// them, and releases energy. These solves are for the count alone: the state of the step stays as it is. Load steps that do not begin in
/// equilibrium, go by pseudo time or follow a break are not looked at but counted.
class SnapThrough {
 public:
  /// Collective. Once the options of `ts` are read; the arguments must outlive the solver. `inner`, attached already, solves.
  PetscErrorCode attach(TS ts, TSContext& context, Equilibrium& model, PseudoTime& inner);
  /// Collective. In the place of SNES's solve.
  PetscErrorCode solve(SNES snes);
  /// Whether the first load step begins in equilibrium.
  void begin_at_rest(bool rests) { rests_ = rests; }
  /// Springs broke in a load step.
  void note_break() { ++unknown_; }
  /// `otherwise`: why nothing is looked for; empty where attach() has been called.
  void count(const std::string& otherwise, std::vector<Tally>* out) const;
  PetscErrorCode warn(Warnings* warnings) const;
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  /// Between two equilibria, of the lower and the higher load factor.
  struct Span {
    double from = 0, to = 0;
    Vec low = nullptr, high = nullptr;
  };
  /// Of the particle whose changes in two halves differ most.
  struct Halves {
    double first = 0, second = 0;  ///< how far it moves in them [m]
    double most = 0;               ///< how far any moves, in both [m]
  };
  /// Of an equilibrium.
  struct Work {
    double energy = 0, power = 0;  ///< E [J], and its derivative by the load factor alone [J]
    double rounding = 0;           ///< of the work of a step [J]
  };
  PetscErrorCode suspects(Vec X, bool* yes);
  PetscErrorCode work_at(double t, double h, Vec y, Work* out);
  PetscErrorCode solve_at(SNES snes, double s, Vec from, Vec at, bool* good);
  PetscErrorCode compare(Vec low, Vec middle, Vec high, Halves* out) const;
  PetscErrorCode close_in(SNES snes, Span* span, double* jump);
  PetscErrorCode releases(SNES snes, const Span& span, bool* yes);
  PetscErrorCode examine_step(SNES snes, Vec X);

  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  Equilibrium* model_ = nullptr;
  PseudoTime* inner_ = nullptr;
  VecHandle found_, low_, middle_, high_;
  bool rests_ = false;
  std::int64_t count_ = 0, unknown_ = 0;  ///< load steps with a jump, and those of which not all was looked at
  double from_ = 0, to_ = 0, jump_ = 0;   ///< of the first one: load factors, and how far a particle went at the least [m]
  double last_ = -1, unknown_at_ = -1;    ///< load factors where the last ones' steps began: a repeated attempt counts once
};

}  // namespace bs
