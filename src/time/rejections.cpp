#include "time/rejections.hpp"
#include <numeric>
#include "base/attached.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/petsc_versions.hpp"
#include "linalg/condensed/condensed.hpp"
#include "time/methods.hpp"

namespace bs {

namespace {

Rejection reason_of(SNESConvergedReason reason) {
  switch (reason) {
    case SNES_DIVERGED_LINE_SEARCH: return LINE_SEARCH;
    case SNES_DIVERGED_INNER:
    case SNES_DIVERGED_MAX_IT:
    case SNES_DIVERGED_FUNCTION_COUNT: return ITERATIONS;
    case SNES_DIVERGED_LINEAR_SOLVE: return LINEAR;
    case NORM_NOT_FINITE:
    case SNES_DIVERGED_FUNCTION_DOMAIN:
    case SNES_DIVERGED_JACOBIAN_DOMAIN: return DOMAIN_ERROR;
    default: return NEWTON;
  }
}

}  // namespace

std::string in_words(const RejectionCounts& counts) {
  std::string text;
  for (std::size_t k = 0; k < counts.size(); ++k)
    if (counts[k] > 0) text += (text.empty() ? "" : ", ") + format("%lld %s", static_cast<long long>(counts[k]), REJECTION_REASONS[k].word);
  return text;
}

PetscErrorCode RejectionWatch::attach(TS ts, double step_min, std::int64_t most) {
  TSAdapt adapt;
  PetscFunctionBegin;
  attempts_ = Attempts(step_min, most);
  // PETSc's own limit, ten rejections of a step, holds only where the option is given
  if (!is_given("-ts_max_reject")) PetscCall(TSSetMaxStepRejections(ts, -1));
  PetscCall(is_on("-snes_mf", &unprepared_));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetCheckStage(adapt, check));
  PetscCall(bs::attach(adapt, "bs_rejections", this));
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::attach_solvers(TS ts, const TSContext& context) {
  PetscFunctionBegin;
  context_ = &context;
  PetscCall(linear_.attach(ts, context));
  PetscFunctionReturn(0);
}

/// Rejects a stage whose linear solve left too large a residual, which the task's own examination finds wrong, or that comes after the step was given
/// up.
PetscErrorCode RejectionWatch::check(TSAdapt adapt, TS ts, PetscReal time, Vec y, PetscBool* accept) {
  SNES snes;
  SNESConvergedReason reason;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  if (reason < 0) PetscFunctionReturn(0);  // PETSc rejects the stage itself: before this call up to 3.24, after it since 3.25
  RejectionWatch* const watch = attached<RejectionWatch>(adapt, "bs_rejections");
  if (watch && (watch->gave_up_ || watch->linear_.failed())) *accept = PETSC_FALSE;
  if (!watch || !*accept || !watch->context_ || !watch->context_->examine) PetscFunctionReturn(0);
  watch->stage_ = {};
  PetscCall(watch->context_->examine(time, y, &watch->stage_));
  if (!watch->stage_.good) *accept = PETSC_FALSE;
  PetscFunctionReturn(0);
}

/// Names the reason for which the solve of a stage failed.
PetscErrorCode RejectionWatch::name_failure(TS ts) {
  SNES snes;
  SNESConvergedReason why;
  std::string fault;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetConvergedReason(snes, &why));
  last_reason_ = reason_of(why);
  PetscCall(model_.last_fault(&fault));
  if (!fault.empty() && why != SNES_DIVERGED_LOCAL_MIN) last_reason_ = DOMAIN_ERROR;  // the task refused a converged solution
  last_ = fault.empty() ? REJECTION_REASONS[last_reason_].sentence : fault;
  if (why == SNES_DIVERGED_INNER && fault.empty()) last_ = context_->newton.gave_up();
  if (why == SNES_DIVERGED_FUNCTION_COUNT && fault.empty()) last_ = "Newton did not converge within -snes_max_funcs evaluations of the residual";
  if (last_reason_ != LINEAR) PetscFunctionReturn(0);
  PC pc;
  std::string failure;
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_failure(pc, &failure));
  if (!failure.empty()) last_ = failure;
  if (unprepared_) last_ = "the linear solver failed, without a preconditioner under -snes_mf (-snes_mf_operator keeps one)";
  PetscCall(find_memory_lack(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), pc, &lack_));
  if (lack_.yes) last_ = lack_.why();
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::name_reason(TS ts, bool solve_failed) {
  PC pc;
  PetscFunctionBegin;
  if (solve_failed) {
    PetscCall(name_failure(ts));
    // the next attempt must not use anything that the failed one left in the solvers
    PetscCall(linear_solver_of(ts, nullptr, &pc));
    PetscCall(condensed_renew(pc));
  } else if (!stage_.good) {
    last_reason_ = NEWTON;
    last_ = stage_.failure;
    PetscCall(linear_solver_of(ts, nullptr, &pc));
    PetscCall(condensed_renew(pc));
  } else if (linear_.failed()) {
    last_reason_ = LINEAR;
    last_ = format("the linear solver left a residual of %.2g of its right side", linear_.residual());
  } else {
    last_reason_ = ERROR_ESTIMATE;
    last_ = REJECTION_REASONS[ERROR_ESTIMATE].sentence;
  }
  PetscFunctionReturn(0);
}

/// Whether TS has rejected an attempt since the last call, and why.
PetscErrorCode RejectionWatch::count_rejection(TS ts) {
  PetscInt rejected, failures;
  PetscFunctionBegin;
  PetscCall(TSGetStepRejections(ts, &rejected));
  PetscCall(TSGetSNESFailures(ts, &failures));
  if (rejected > rejected_ && !gave_up_) {
    PetscCall(name_reason(ts, failures > failures_));
    attempts_.reject();
    ++counts_[last_reason_];
  }
  rejected_ = rejected;
  failures_ = failures;
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::before_stage(TS ts) {
  PetscReal h;
  PetscFunctionBegin;
  const std::int64_t before = attempts_.in_a_row();
  PetscCall(count_rejection(ts));
  if (attempts_.in_a_row() == before) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(ts, &h));
  attempts_.go_on(h);
  if (!enough(h)) PetscFunctionReturn(0);
  gave_up_ = true;
  PetscCall(TSSetConvergedReason(ts, TS_DIVERGED_STEP_REJECTED));
  PetscFunctionReturn(0);
}

PetscErrorCode RejectionWatch::end_step(TS ts) { return count_rejection(ts); }

std::string RejectionWatch::advice() const {
  if (lack_.yes) return lack_.remedy();
  // a fault that has a name says itself what to do
  if (last_reason_ == DOMAIN_ERROR && last_ != REJECTION_REASONS[DOMAIN_ERROR].sentence) return "";
  if (unprepared_) return "-snes_mf solves the linear systems without a preconditioner: give -snes_mf_operator, which keeps one, or leave it out";
  return REJECTION_REASONS[last_reason_].advice;
}

void RejectionWatch::save(Facts* facts) const {
  for (std::size_t k = 0; k < counts_.size(); ++k) facts->whole[std::string("rejected_") + REJECTION_REASONS[k].key] = counts_[k];
}

void RejectionWatch::restore(const Facts& facts) {
  for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] = facts.whole_of(std::string("rejected_") + REJECTION_REASONS[k].key);
}

std::int64_t total(const RejectionCounts& counts) { return std::accumulate(counts.begin(), counts.end(), std::int64_t{0}); }

void StepCounter::count(std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected, StepRecord* record) {
  newton += newton_before_;
  krylov += krylov_before_;
  for (std::size_t k = 0; k < rejected.size(); ++k) record->reasons[k] = rejected[k] - rejected_[k];
  rejected_ = rejected;
  record->newton = newton - counts_.newton;
  record->krylov = krylov - counts_.krylov;
  record->rejected = total(rejected) - counts_.rejected;
  counts_.newton = newton;
  counts_.krylov = krylov;
  counts_.rejected = total(rejected);
}

void StepCounter::save(Facts* facts) const {
  facts->whole["step"] = counts_.steps;
  facts->whole["rejected"] = counts_.rejected;
  facts->whole["newton"] = counts_.newton;
  facts->whole["krylov"] = counts_.krylov;
  facts->whole["shortened"] = counts_.shortened;
}

void StepCounter::restore(const Facts& facts, std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected) {
  counts_ = {facts.whole.at("step"), facts.whole.at("rejected"), facts.whole.at("newton"), facts.whole.at("krylov"), facts.whole.at("shortened")};
  newton_before_ = counts_.newton - newton;
  krylov_before_ = counts_.krylov - krylov;
  rejected_ = rejected;
}

}  // namespace bs
