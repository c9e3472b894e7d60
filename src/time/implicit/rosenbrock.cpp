#include <algorithm>
#include <array>
#include <cmath>
#include "base/handle.hpp"
#include "base/vec_array.hpp"
#include "time/implicit/predictor.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

/// What a step of y' = 1 with h = 1 shows of a tableau.
struct Probe {
  std::vector<double> stages;        ///< u_i
  std::vector<bool> explicit_stage;  ///< such a stage asks for the Jacobian without its shift
  std::vector<double> shifts;        ///< sigma of the others
  double earliest = 0;               ///< stage, in steps from the start of the step
  bool shiftless = false;
};

PetscErrorCode probe_residual(TS, PetscReal, Vec, Vec ydot, Vec F, void*) {
  PetscFunctionBegin;
  PetscCall(VecCopy(ydot, F));
  PetscCall(VecShift(F, -1));
  PetscFunctionReturn(0);
}

PetscErrorCode probe_jacobian(TS, PetscReal, Vec, Vec, PetscReal sigma, Mat, Mat P, void* data) {
  PetscFunctionBegin;
  Probe* probe = static_cast<Probe*>(data);
  probe->shiftless = sigma == 0;
  if (sigma != 0) probe->shifts.push_back(sigma);
  PetscCall(MatSetValue(P, 0, 0, sigma, INSERT_VALUES));
  PetscCall(assemble(P));
  PetscFunctionReturn(0);
}

PetscErrorCode probe_stage(TS ts, PetscReal time, PetscInt index, Vec* stages) {
  Probe* probe = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &probe));
  const ReadArray value(stages[index]);
  probe->stages.push_back(value[0]);
  probe->explicit_stage.push_back(probe->shiftless);
  probe->earliest = std::min(probe->earliest, time);
  probe->shiftless = false;
  PetscFunctionReturn(0);
}

PetscErrorCode make_probe_step(const char* subtype, Probe* probe) {
  TSHandle ts;
  VecHandle y;
  MatHandle J;
  TSAdapt adapt;
  SNES snes;
  KSP ksp;
  PC pc;
  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 1, y.out()));
  PetscCall(VecZeroEntries(y));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 1, 1, nullptr, J.out()));
  PetscCall(TSCreate(PETSC_COMM_SELF, ts.out()));
  PetscCall(TSSetType(ts, TSROSW));
  PetscCall(TSRosWSetType(ts, subtype));
  PetscCall(TSRosWSetRecomputeJacobian(ts, PETSC_TRUE));
  PetscCall(TSSetApplicationContext(ts, probe));
  PetscCall(TSSetIFunction(ts, nullptr, probe_residual, probe));
  PetscCall(TSSetIJacobian(ts, J, J, probe_jacobian, probe));
  PetscCall(TSSetPostStage(ts, probe_stage));
  PetscCall(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_STEPOVER));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscCall(TSSetTimeStep(ts, 1));
  PetscCall(TSSetMaxSteps(ts, 1));
  PetscCall(TSSetSolution(ts, y));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESSetType(snes, SNESKSPONLY));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(TSSetUp(ts));
  PetscCall(TSStep(ts));
  PetscFunctionReturn(0);
}

}  // namespace

/// u_i = sum_j gamma_ij k_j with k_j = 1; PETSc writes 1 for the gamma_ii = 0 of an explicit stage.
PetscErrorCode RosenbrockStages::probe(const char* subtype) {
  Probe probe;
  PetscFunctionBegin;
  PetscCall(make_probe_step(subtype, &probe));
  stage_before_ = probe.earliest < -1e-12;
  for (std::size_t i = 0; i < probe.stages.size(); ++i) {
    gamma_.push_back(probe.stages[i] - (probe.explicit_stage[i] ? 1 : 0));
    explicit_ = explicit_ || probe.explicit_stage[i];
  }
  for (const double shift : probe.shifts) uneven_ = uneven_ || shift != probe.shifts[0];
  PetscFunctionReturn(0);
}

PetscErrorCode RosenbrockStages::attach(TS ts, Model& model, Form form) {
  const Method* method;
  PetscFunctionBegin;
  PetscCall(method_of(ts, &method));
  if (!method->is(TSROSW)) PetscFunctionReturn(0);
  model_ = &model;
  form_ = form;
  active_ = true;
  PetscCall(probe(method->subtype));
  if (uneven_) PetscCall(TSRosWSetRecomputeJacobian(ts, PETSC_TRUE));
  if (!model.time_dependent()) PetscFunctionReturn(0);
  for (VecHandle* vec : {&rate_, &still_, &trial_[0], &trial_[1], &trial_[2], &trial_[3], &trial_[4]})
    PetscCall(VecDuplicate(model.initial_state(), vec->out()));
  PetscCall(VecZeroEntries(still_));
  PetscFunctionReturn(0);
}

/// The Jacobian is computed by the first solve of an attempt and kept by the others: the lag -2, which that solve turns
/// into -1. PETSc does so too, but takes the lag back after the last stage's solve only: not where that stage is explicit,
/// or where an attempt is given up before it. Stages of different gamma_ii need a matrix each.
PetscErrorCode RosenbrockStages::before_stage(TS ts) {
  PetscInt step, rejected;
  SNES snes;
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(TSGetStepNumber(ts, &step));
  PetscCall(TSGetStepRejections(ts, &rejected));
  if (step == step_ && rejected == rejected_) {
    ++stage_;
    PetscFunctionReturn(0);
  }
  step_ = step;
  rejected_ = rejected;
  stage_ = 0;
  fresh_ = false;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESSetLagJacobian(snes, uneven_ ? 1 : -2));
  PetscFunctionReturn(0);
}

/// dF/dt at (t_n, y_n, y' = 0) by differences to the right over 4/1000 of the step: of fourth order where F is smooth; where a source or its slope
/// jumps meanwhile, the smallest of the four slopes. Smooth: the slopes differ little from one another, or change evenly (near a time where dF/dt is
/// 0): their second differences are within a quarter of their range, while a jump or a kink makes them at least a third.
PetscErrorCode RosenbrockStages::differentiate(TS ts) {
  PetscReal t, h;
  Vec y;
  PetscInt n = 0;
  std::array<const PetscScalar*, 5> f{};
  PetscScalar* rate = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(TSGetSolution(ts, &y));
  for (int k = 0; k < 5; ++k) PetscCall(model_->residual(t + k * (h / 1000), y, still_, form_, trial_[k]));
  const double delta = (t + 4 * (h / 1000) - t) / 4;  // as the sums were rounded
  PetscCall(VecGetLocalSize(rate_, &n));
  for (std::size_t k = 0; k < 5; ++k) PetscCall(VecGetArrayRead(trial_[k], &f[k]));
  PetscCall(VecGetArrayWrite(rate_, &rate));
  for (PetscInt i = 0; i < n; ++i) {
    std::array<double, 4> slope{};
    for (std::size_t k = 0; k < 4; ++k) slope[k] = (f[k + 1][i] - f[k][i]) / delta;
    const auto [low, high] = std::minmax_element(slope.begin(), slope.end());
    const double least = std::abs(*low) < std::abs(*high) ? *low : *high, most = std::max(std::abs(*low), std::abs(*high));
    const double bend = std::max(std::abs(slope[2] - 2 * slope[1] + slope[0]), std::abs(slope[3] - 2 * slope[2] + slope[1]));
    const bool smooth = (*low * *high > 0 && most <= 2 * std::abs(least)) || bend <= 0.25 * (*high - *low);
    rate[i] = !smooth ? *std::min_element(slope.begin(), slope.end(), [](double a, double b) { return std::abs(a) < std::abs(b); })
                      : (25 * slope[0] - 23 * slope[1] + 13 * slope[2] - 3 * slope[3]) / 12;
  }
  PetscCall(VecRestoreArrayWrite(rate_, &rate));
  for (std::size_t k = 0; k < 5; ++k) PetscCall(VecRestoreArrayRead(trial_[k], &f[k]));
  fresh_ = true;
  PetscFunctionReturn(0);
}

PetscErrorCode RosenbrockStages::limit_time(TS ts, PetscReal* t) {
  PetscReal start;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &start));
  *t = std::max(*t, start);
  PetscFunctionReturn(0);
}

PetscErrorCode RosenbrockStages::add_time_term(TS ts, Vec F) {
  PetscReal h;
  PetscFunctionBegin;
  if (!rate_ || stage_ >= gamma_.size() || gamma_[stage_] == 0) PetscFunctionReturn(0);
  if (!fresh_) PetscCall(differentiate(ts));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(VecAXPY(F, gamma_[stage_] * h, rate_));
  PetscFunctionReturn(0);
}

}  // namespace bs
