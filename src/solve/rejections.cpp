#include "solve/rejections.hpp"
#include <cstring>
#include "base/fault.hpp"
#include "solve/condensed/condensed.hpp"
#include "solve/ts_queries.hpp"

namespace bs {
namespace {

enum : std::size_t { NEWTON, LINE_SEARCH, ITERATIONS, LINEAR, DOMAIN_ERROR, ERROR_ESTIMATE };
constexpr const char* SHORT[] = {"Newton diverged", "line search", "Newton iterations", "linear solver", "no finite force", "error estimate"};

std::size_t reason_of(SNESConvergedReason reason) {
  switch (reason) {
    case SNES_DIVERGED_LINE_SEARCH: return LINE_SEARCH;
    case SNES_DIVERGED_INNER:
    case SNES_DIVERGED_MAX_IT:
    case SNES_DIVERGED_FUNCTION_COUNT: return ITERATIONS;
    case SNES_DIVERGED_LINEAR_SOLVE: return LINEAR;
    case SNES_DIVERGED_FNORM_NAN:
    case SNES_DIVERGED_FUNCTION_DOMAIN:
    case SNES_DIVERGED_JACOBIAN_DOMAIN: return DOMAIN_ERROR;
    default: return NEWTON;
  }
}

const char* sentence_of(std::size_t reason) {
  static const char* const words[] = {"Newton's residual grew without end", "the line search found no smaller residual", "Newton did not converge within -snes_max_it iterations",
                                      "the linear solver failed", "a force was not finite", "the estimated error was above the tolerances"};
  return words[reason];
}

}  // namespace

std::int64_t total(const RejectionCounts& counts) {
  std::int64_t sum = 0;
  for (const std::int64_t count : counts) sum += count;
  return sum;
}

std::string in_words(const RejectionCounts& counts) {
  std::string text;
  for (std::size_t k = 0; k < counts.size(); ++k)
    if (counts[k] > 0) text += (text.empty() ? "" : ", ") + format("%lld %s", static_cast<long long>(counts[k]), SHORT[k]);
  return text;
}

PetscErrorCode RejectionWatch::attach(TS ts, double step_min, std::int64_t most) {
  TSAdapt adapt;
  PetscBool given = PETSC_FALSE;
  PetscContainer container;
  PetscFunctionBegin;
  step_min_ = step_min;
  most_ = most;
  // PETSc's own limit, ten a step, holds where it is named
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-ts_max_reject", &given));
  if (!given) PetscCall(TSSetMaxStepRejections(ts, -1));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetCheckStage(adapt, check));
  PetscCall(PetscContainerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), &container));
  PetscCall(PetscContainerSetPointer(container, this));
  PetscCall(PetscObjectCompose(reinterpret_cast<PetscObject>(adapt), "bs_rejections", reinterpret_cast<PetscObject>(container)));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(0);
}

/// Nothing is taken of a linear solve that left its residual, or that comes once a step is given up.
PetscErrorCode RejectionWatch::check(TSAdapt adapt, TS, PetscReal, Vec, PetscBool* accept) {
  PetscContainer container = nullptr;
  void* self = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscObjectQuery(reinterpret_cast<PetscObject>(adapt), "bs_rejections", reinterpret_cast<PetscObject*>(&container)));
  if (container) PetscCall(PetscContainerGetPointer(container, &self));
  const RejectionWatch* watch = static_cast<RejectionWatch*>(self);
  if (watch && (watch->gave_up_ || watch->linear_.failed())) *accept = PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::name_failure(TS ts, std::size_t* reason) {
  SNES snes;
  SNESConvergedReason why;
  std::string fault;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetConvergedReason(snes, &why));
  *reason = reason_of(why);
  PetscCall(model_.last_fault(&fault));
  if (!fault.empty()) *reason = DOMAIN_ERROR;
  last_ = fault.empty() ? sentence_of(*reason) : fault;
  if (why == SNES_DIVERGED_INNER && fault.empty()) last_ = "too many tangents of one step were not positive definite (springs buckle)";
  if (*reason != LINEAR) PetscFunctionReturn(0);
  PetscCall(linear_solver_lacks_memory(ts, &no_memory_));
  if (no_memory_) last_ = "no memory was left for the factors of the linear solver";
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::look(TS ts) {
  PetscInt rejected, failures;
  PetscFunctionBegin;
  PetscCall(TSGetStepRejections(ts, &rejected));
  PetscCall(TSGetSNESFailures(ts, &failures));
  if (rejected > rejected_ && !gave_up_) {
    std::size_t reason = ERROR_ESTIMATE;
    if (failures > failures_) {
      // nothing that the failed attempt left in the solvers goes into the next one
      PC pc;
      PetscCall(name_failure(ts, &reason));
      PetscCall(linear_solver_of(ts, nullptr, &pc));
      PetscCall(condensed_renew(pc));
    } else if (linear_.failed()) {
      reason = LINEAR;
      last_ = format("the linear solver left a residual of %.2g of its right side", linear_.residual());
    } else {
      last_ = sentence_of(reason);
    }
    tried_ = present_;
    last_reason_ = reason;
    ++counts_[reason];
    ++in_a_row_;
  }
  rejected_ = rejected;
  failures_ = failures;
  PetscFunctionReturn(0);
}

bool RejectionWatch::enough(double next) const {
  return no_memory_ || next < step_min_ * (1 - SAME_STEP) || next < resolution_ || in_a_row_ > most_;
}

PetscErrorCode RejectionWatch::try_again(TS ts, double cut, bool* more) {
  PetscReal h;
  PetscFunctionBegin;
  PetscCall(look(ts));
  PetscCall(TSGetTimeStep(ts, &h));
  if (h > present_ * (1 - SAME_STEP)) h = present_ * cut;
  gave_up_ = enough(h);
  *more = !gave_up_;
  PetscCall(TSSetTimeStep(ts, h));
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::before_stage(TS ts) {
  PetscReal h;
  PetscFunctionBegin;
  const std::int64_t before = in_a_row_;
  PetscCall(look(ts));
  if (in_a_row_ == before) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(ts, &h));
  // alpha starts by two steps of half the length
  bool starting = false;
  PetscCall(is_alpha_starting(ts, &starting));
  if (starting) h *= 2;
  present_ = h;
  if (!enough(h)) PetscFunctionReturn(0);
  gave_up_ = true;
  PetscCall(TSSetConvergedReason(ts, TS_DIVERGED_STEP_REJECTED));
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::end_step(TS ts) {
  PetscFunctionBegin;
  PetscCall(look(ts));
  PetscFunctionReturn(0);
}

const char* RejectionWatch::advice() const {
  if (no_memory_) return "raise the memory limit, use more ranks, or an iterative solver (-condensed_pc_type bicc; -ksp_type gmres -pc_type bjacobi)";
  switch (last_reason_) {
    case LINEAR: return "try -pc_type lu, a larger -ksp_max_it, or a smaller -ts_dt; -ksp_converged_reason shows more";
    case DOMAIN_ERROR: return last_ == sentence_of(DOMAIN_ERROR) ? "try a smaller -ts_dt" : "";  // a fault that has a name says it itself
    case ERROR_ESTIMATE: return "try a larger -ts_rtol or -ts_atol (-bs_atol_x, -bs_atol_v), or a smaller -bs_step_min; -ts_adapt_monitor shows more";
    default: return "try a smaller -ts_dt or -bs_step_min, -snes_linesearch_type l2, or a larger -snes_max_it; -snes_monitor shows more";
  }
}

void RejectionWatch::save(Facts* facts) const {
  for (std::size_t k = 0; k < counts_.size(); ++k) facts->whole[std::string("rejected_") + REJECTION_KEYS[k]] = counts_[k];
}

void RejectionWatch::restore(const Facts& facts) {
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    const auto at = facts.whole.find(std::string("rejected_") + REJECTION_KEYS[k]);
    counts_[k] = at == facts.whole.end() ? 0 : at->second;
  }
}

}  // namespace bs
