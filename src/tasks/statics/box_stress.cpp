#include "tasks/statics/box_stress.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "lattice/box.hpp"
#include "solvers/own_solve.hpp"
#include "tasks/statics/pseudo_time.hpp"
#include "tasks/strain_relaxation.hpp"

namespace bs {

PetscErrorCode refuse_box_stress(Model& model, const char* task) {
  PetscFunctionBegin;
  if (model.mechanics() && !model.mechanics()->free_strains(0).empty())
    PetscCall(fail(model.comm(), Exit::input,
                   std::string("option -bs_box_stress does not go with ") + task +
                       ": give -bs_task statics, which finds the strain that bears the stress, or prescribe a strain by -bs_box_strain"));
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::begin(Equilibrium& model, const StaticsSettings& settings) {
  StrainResponse strained;
  PetscFunctionBegin;
  rtol_ = settings.box_stress_rtol;
  free_ = model.free_strains(0);
  active_ = !free_.empty();
  if (!active_) PetscFunctionReturn(0);
  if (settings.arc)
    PetscCall(fail(model.comm(), Exit::input, "option -bs_box_stress does not go with -bs_load_control arc: give the strains by -bs_box_strain"));
  if (settings.only_minima)
    PetscCall(fail(model.comm(), Exit::input,
                   "option -bs_equilibria minimum does not go with -bs_box_stress, which also finds saddle points: leave it out"));
  if (model.breaks())
    PetscCall(fail(model.comm(), Exit::input, "option -bs_box_stress does not go with springs that break: give the strains by -bs_box_strain"));
  PetscCall(model.strain_response(0, model.initial_state(), &strained));
  if (!strained.held.empty())
    PetscCall(fail(model.comm(), Exit::input, "option -bs_box_stress: " + strained.held + " do not follow the strain of the box: leave them out"));
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::attach(TS ts, TSContext& context, Equilibrium& model, PseudoTime& inner) {
  SNES snes;
  PetscFunctionBegin;
  ts_ = ts;
  context_ = &context;
  model_ = &model;
  inner_ = &inner;
  PetscCall(VecDuplicate(model.initial_state(), good_state_.out()));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(attach_own_solve(snes, this));
  PetscFunctionReturn(0);
}

/// The given stresses less those there are, and what to measure that by: a component that is held may be large beyond all measure in a box that
/// has given way.
double BoxStress::missing(const StrainResponse& at, const std::vector<FreeStrain>& free, std::vector<double>* each, double* scale) const {
  double worst = 0;
  each->clear();
  *scale = stress_measure(at, free);
  for (const FreeStrain& one : free) {
    each->push_back(one.stress - at.stress[static_cast<std::size_t>(component_place(model_->dim(), one.row, one.column))]);
    worst = std::isnan(each->back()) ? each->back() : std::max(worst, std::abs(each->back()));
  }
  return worst;
}

/// The largest component of L = dF F^-1, F that of relaxed_: of a box that is far from its start a change is measured by what it is now.
double BoxStress::flow_size(const std::vector<double>& step) const {
  const int d = model_->dim();
  double sum[9] = {0}, L[9], size = 0;
  for (std::size_t a = 0; a < free_.size(); ++a) {
    flow_of(free_[a], relaxed_.strained().gradient, d, L);
    for (int c = 0; c < d * d; ++c) sum[c] += step[a] * L[c];
  }
  for (int c = 0; c < d * d; ++c) size = std::max(size, std::abs(sum[c]));
  return size;
}

// Where the box is not stable, or Newton's step is long, the box changes by STEP at most. Stresses that are 0 beside those of single springs are
// met where no change of the box that rounding knows would bring them nearer.
PetscErrorCode BoxStress::judge(Vec X, Trial* out) {
  constexpr double STEP = 0.02, LONGEST = 0.1, ROUNDING = 1e-13, LEAST = 1e-14;
  const std::size_t n = free_.size();
  std::vector<double> A, left;
  double scale = 0, longest = 0, before[9];
  PetscFunctionBegin;
  const auto of_free = [this](const StrainResponse& at) { return strains_of(free_, at.gradient, model_->dim()); };
  PetscCall(relaxed_.estimate(ts_, context_->matrix, *model_, time_, X, of_free));
  const StrainResponse& at = relaxed_.strained();
  const int d = model_->dim();
  *out = {};
  std::copy_n(at.gradient, 9, before);
  for (std::size_t a = 0; a < n; ++a) before[free_[a].row * d + free_[a].column] -= free_[a].strain - start_[a];
  out->worst = missing(at, free_, &left, &scale);
  double inverse[9];
  out->volume_ratio = invert_edges(at.gradient, d, inverse) ? box_volume(at.gradient, d) / box_volume(before, d) : 0;
  out->state = box_tangent(relaxed_, free_, d, &A);
  const bool stable = out->state == BoxState::stable && solve_small(A, left, &out->step);
  if (!stable) out->step = left;
  longest = flow_size(out->step);
  const double most = stable ? LONGEST : STEP;
  if (longest > most || !stable)
    for (double& g : out->step) g *= longest > 0 ? most / longest : 0;
  out->met = out->worst <= rtol_ * scale || (stable && longest <= ROUNDING && (out->worst <= BOX_STRESS_MISSED * scale || longest <= LEAST));
  PetscFunctionReturn(0);
}

/// From the last good equilibrium: strains by `part` of the step, particles by L x and what they relax under it.
PetscErrorCode BoxStress::move(const Trial& from, double part, Vec X) {
  const Layout at = model_->mechanics()->layout();
  const int d = model_->dim();
  const StrainResponse& strained = relaxed_.strained();
  double flow[9] = {0}, L[9];
  std::vector<double> strains(free_.size());
  Vec y;
  PetscReal h;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < free_.size(); ++k) {
    free_[k].strain = strains[k] = good_[k] + part * from.step[k];
    flow_of(free_[k], strained.gradient, d, L);
    for (int c = 0; c < d * d; ++c) flow[c] += part * from.step[k] * L[c];
  }
  model_->mechanics()->set_free_strains(strains);
  PetscCall(VecCopy(good_state_, X));
  std::vector<double> strain(static_cast<std::size_t>(strained.count), 0.0);
  for (int r = 0; r < d; ++r)
    for (int c = 0; c < d; ++c) strain[static_cast<std::size_t>(component_place(d, r, c))] += flow[r * d + c];
  for (int k = 0; k < strained.count; ++k) PetscCall(VecAXPY(X, strain[static_cast<std::size_t>(k)], relaxed_.moved(k)));
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(TSGetSolution(ts_, &y));
  const ReadArray x(good_state_), a0(y);
  const WriteArray a(X);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt r = 0; r < d; ++r) {
      for (PetscInt c = 0; c < d; ++c) a[at.x(i, r)] += flow[r * d + c] * x[at.x(i, c)];
      a[at.v(i, r)] = (a[at.x(i, r)] - a0[at.x(i, r)]) / h;
    }
  ++corrections_;
  PetscFunctionReturn(0);
}

/// A new step starts from the strains of the last one, a repeated one from those that step started from.
PetscErrorCode BoxStress::begin_step() {
  PetscReal from;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts_, &from));
  PetscCall(inner_->time_of_loads(&time_));
  free_ = model_->free_strains(time_);
  if (from != from_ || !inner_->at_load_step()) {
    start_.clear();
    for (const FreeStrain& one : free_) start_.push_back(one.strain);
    from_ = from;
  }
  for (std::size_t k = 0; k < free_.size(); ++k) free_[k].strain = start_[k];
  model_->mechanics()->set_free_strains(start_);
  model_->set_fault("");
  relaxed_.renew();
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::refuse(SNES snes, const char* why) {
  PetscFunctionBegin;
  snes->reason = SNES_DIVERGED_LOCAL_MIN;
  model_->set_fault(std::string("the box does not bear the stress of -bs_box_stress: ") + why + " (-bs_box_strain can lead it further)");
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::iterate(SNES snes, bool* found) {
  constexpr int MOST = 60, MOST_CUTS = 8;
  constexpr double TWOFOLD = 2;
  Vec X = snes->vec_sol;
  Trial good, now;
  double part = 1;
  int cuts = 0;
  bool has = false;
  PetscInt newton = 0;
  ResidualNorms first = {0, 0};
  PetscFunctionBegin;
  *found = false;
  for (int it = 0; it < MOST; ++it) {
    if (it > 0) context_->newton.set_reference(first);  // as if it was one solve
    PetscCall(inner_->solve(snes));
    newton += snes->iter;
    snes->iter = newton;
    snes->vec_func_init_set = PETSC_FALSE;
    if (it == 0) first = context_->newton.solve().first;
    const bool solved = snes->reason >= 0;
    if (!solved && !has) PetscFunctionReturn(0);
    if (solved) PetscCall(judge(X, &now));
    const bool sane = solved && std::isfinite(now.worst) && now.volume_ratio > 1 / TWOFOLD && now.volume_ratio < TWOFOLD;
    if (sane && now.met) {
      *found = now.state != BoxState::unstable;
      if (!*found) PetscCall(refuse(snes, "the smallest disturbance of the free strains would grow"));
      PetscFunctionReturn(0);
    }
    if (sane && (!has || good.state != BoxState::stable || now.worst < good.worst)) {
      good = now;
      has = true;
      part = 1;
      cuts = 0;
      PetscCall(VecCopy(X, good_state_));
      good_.clear();
      for (const FreeStrain& one : free_) good_.push_back(one.strain);
    } else if (!has || ++cuts > MOST_CUTS) {
      PetscCall(refuse(
          snes, sane ? "no further change of the free strains brings it nearer" : "its volume would change more than twofold in one load step"));
      PetscFunctionReturn(0);
    } else {
      part *= 0.25;
      for (std::size_t k = 0; k < free_.size(); ++k) free_[k].strain = good_[k];
      model_->mechanics()->set_free_strains(good_);
      PetscCall(judge(good_state_, &good));
    }
    PetscCall(move(good, part, X));
  }
  PetscCall(refuse(snes, "it gives way under it"));
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::solve(SNES snes) {
  bool found = false;
  PetscFunctionBegin;
  PetscCall(begin_step());
  PetscCall(iterate(snes, &found));
  if (!found) model_->mechanics()->set_free_strains(start_);
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::confirm(Equilibrium& model, double t, Vec y, FinalResults* out) const {
  constexpr double ROUNDING = 1e-12;  // of the stiffness: a given stress may be 0
  StrainResponse at;
  std::vector<double> each;
  double scale = 0;
  PetscFunctionBegin;
  PetscCall(model.strain_response(t, y, &at));
  const std::vector<FreeStrain> free = model.free_strains(t);
  const double worst = missing(at, free, &each, &scale);
  if (!(worst <= std::max(BOX_STRESS_MISSED * scale, ROUNDING * stiffness_along(at, free, model.dim()))))
    out->failure = format("the stress of the box is off by %.3g, measured by stresses of %.3g: -bs_box_stress is not met; try more -bs_load_steps",
                          worst, scale);
  PetscFunctionReturn(0);
}

PetscErrorCode BoxStress::warn(Equilibrium& model, double t, Warnings* warnings) const {
  constexpr double FAR = 10;
  PetscFunctionBegin;
  for (const FreeStrain& one : model.free_strains(t))
    if (std::abs(one.strain) > FAR)
      PetscCall(warnings->add(
          "box_strain",
          format("the stress of -bs_box_stress, %s = %g, strains the box by %.3g: it is far beyond the stiffness of the springs; are its "
                 "units those of the lattice?",
                 component_name(one.row, one.column).c_str(), one.stress, one.strain)));
  PetscFunctionReturn(0);
}

void BoxStress::put(Equilibrium& model, double t, FinalResults* out) const {
  std::string text = "strain of the box under the given stress:";
  std::vector<std::string> names;
  std::vector<double> strains, stresses;
  for (const FreeStrain& one : model.free_strains(t)) {
    names.push_back(component_name(one.row, one.column));
    strains.push_back(one.strain);
    stresses.push_back(one.stress);
    text += format(" %s %.8g", names.back().c_str(), one.strain);
  }
  Report entry;
  entry.set("components", names);
  entry.set("strain", strains);
  entry.set("stress", stresses);
  out->report.set("box_stress", entry);
  out->lines.push_back(text);
}

}  // namespace bs
