#include "time/implicit/predictor.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/options.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/newton/search/energy.hpp"
#include "systems/layout.hpp"
#include "systems/mechanics.hpp"
#include "time/methods.hpp"

namespace bs {

PetscErrorCode Predictor::read_options(TS ts, PetscInt* most) {
  std::int64_t substeps = 16;
  int guess = 0;
  PetscFunctionBegin;
  PetscCall(read_section(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), "Newton's first iterate", [&](Section& o) {
    o.choice("-bs_guess",
             "where Newton's iteration of a step begins (beuler, cn, theta): extrapolate: at the last state, or at the one the last two velocities "
             "point to where that leaves less than half of the residual; substeps: at the lowest place of the step's potential on a motion of "
             "-bs_guess_substeps sub-steps; auto: substeps after steps whose tangents were not positive definite",
             {"auto", "extrapolate", "substeps"}, guess);
    o.integer("-bs_guess_substeps", "most linearly implicit sub-steps, each a quarter of the step, of a first iterate [1]", substeps,
              Range::positive);
  }));
  guess_ = static_cast<Guess>(guess);
  *most = static_cast<PetscInt>(std::min<std::int64_t>(substeps, PETSC_MAX_INT));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::attach(TS ts, Model& model, NewtonPolicy* newton) {
  PetscBool end_point = PETSC_TRUE, is = PETSC_FALSE;
  const Method* method;
  const char* why = "-ts_type beuler, cn or theta with -ts_theta_endpoint, and a nonlinear solve";
  PetscReal value = 1;
  PetscInt most = 0;
  SNES snes;
  PetscFunctionBegin;
  ts_ = ts;
  model_ = &model;
  newton_ = newton;
  PetscCall(read_options(ts, &most));
  PetscCall(method_of(ts, &method));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ts), TSBEULER, &is));
  const bool known = method->remembers(Memory::theta) && model.tangent();
  if (known) PetscCall(theta_of(ts, &value));
  if (known && !is) PetscCall(TSThetaGetEndpoint(ts, &end_point));
  theta_ = value;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESKSPONLY, &is));
  const bool hooks = known && end_point && !is;  // a single linear solve is meant to start from the last state
  if (hooks) PetscCall(SubstepGuess::missing(ts, model, &why));
  if (*why && guess_ == Guess::substeps)
    PetscCall(fail(model.comm(), Exit::input, std::string("option -bs_guess substeps: needs ") + why + ": write -bs_guess auto"));
  if (*why) guess_ = Guess::extrapolate;
  substeps_.attach(ts, model, theta_, most);
  if (!hooks) PetscFunctionReturn(0);
  PetscCall(searches_within_limits(snes, &within_limits_));
  PetscCall(SNESSetComputeInitialGuess(
      snes, [](SNES of, Vec X, void* self) { return static_cast<Predictor*>(self)->predict(of, X); }, this));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::count_indefinite(PetscInt* count) const {
  PC pc;
  bool is = false;
  CondensedCounts counts;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_counts(pc, &is, &counts));
  *count = counts.indefinite;
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::save(Facts* facts) const {
  PetscInt now = 0;
  PetscFunctionBegin;
  if (guess_ != Guess::automatic) PetscFunctionReturn(0);
  PetscCall(count_indefinite(&now));
  facts->whole["guess_folded"] = folded_ || now > indefinite_ ? 1 : 0;
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::restore(const Facts& facts) {
  PetscFunctionBegin;
  if (guess_ != Guess::automatic) PetscFunctionReturn(0);
  folded_ = facts.whole_of("guess_folded") != 0;
  PetscCall(count_indefinite(&indefinite_));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::wants_substeps(bool* yes) {
  PetscInt now = 0;
  PetscFunctionBegin;
  *yes = guess_ == Guess::substeps;
  if (guess_ != Guess::automatic) PetscFunctionReturn(0);
  PetscCall(count_indefinite(&now));
  *yes = folded_ || now > indefinite_;
  folded_ = false;
  indefinite_ = now;
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::residual_at(SNES snes, Vec X, ResidualNorms* norms) {
  Vec F;
  PetscFunctionBegin;
  PetscCall(SNESGetFunction(snes, &F, nullptr, nullptr));  // room that Newton fills anew
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(model_->residual_norms(F, norms));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::predict(SNES snes, Vec X) {
  Vec y;
  bool substeps = false;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &y));
  if (history_ && !history_->replaying()) PetscCall(wants_substeps(&substeps));
  substeps = substeps && !model_->limits();  // they go where they want
  PetscCall(substeps ? descend(snes, y, X) : extrapolate(snes, y, X));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::descend(SNES snes, Vec y, Vec X) {
  ResidualNorms start;
  PetscFunctionBegin;
  PetscCall(residual_at(snes, y, &start));
  PetscCall(substeps_.make(snes, y, X));
  if (std::isfinite(start[0] + start[1])) newton_->set_reference(start);
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::may_go(SNES snes, Vec y, Vec X, bool* yes) {
  Incremental* const forces = model_->limits();
  double most = 1;
  Vec line;
  PetscReal t = 0, h = 0;
  PetscFunctionBegin;
  *yes = true;
  if (!forces) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(SNESGetFunction(snes, &line, nullptr, nullptr));  // room that Newton fills anew
  PetscCall(VecWAXPY(line, -1.0, y, X));
  PetscCall(forces->follow(y, line));
  PetscCall(forces->largest_lambda(t + h, &most));
  *yes = most >= 1;
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::extrapolate(SNES snes, Vec y, Vec X) {
  PetscReal h;
  double last_h = 0;
  ResidualNorms here, ahead;
  PetscFunctionBegin;
  Vec before = history_ && !history_->replaying() ? history_->before_last(&last_h) : nullptr;
  const bool first = !before && model_->mechanics() && model_->mechanics()->flows();  // before the first step, too
  if (!before && !first) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(residual_at(snes, X, &here));
  const double ratio = first ? 0 : h / last_h;
  if (first) before = y;
  {
    const ReadArray a0(before), a1(y);
    const WriteArray at(X);
    layout_of(X).for_each([&](PetscInt x, PetscInt v) {
      at[v] = a1[v] + ratio * (a1[v] - a0[v]);
      at[x] = a1[x] + h * ((1 - theta_) * a1[v] + theta_ * at[v]);
    });
  }
  bool clear = true;
  PetscCall(may_go(snes, y, X, &clear));
  if (!clear) {
    PetscCall(VecCopy(y, X));
    PetscFunctionReturn(0);
  }
  PetscCall(residual_at(snes, X, &ahead));
  const double start = std::max(here[0] / (theta_ * h), here[1]), there = std::max(ahead[0] / (theta_ * h), ahead[1]);
  PetscCall(PetscInfo(snes, "residual at the last state %g, at the predicted one %g\n", start, there));
  if (std::isfinite(there) && there < 0.5 * start) newton_->set_reference(here);
  else PetscCall(VecCopy(y, X));
  PetscFunctionReturn(0);
}

}  // namespace bs
