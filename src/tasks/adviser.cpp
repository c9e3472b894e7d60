#include "tasks/adviser.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/options.hpp"
#include "base/text.hpp"
#include "time/methods.hpp"

namespace bs {

namespace {

// Rule of thumb: an implicit step of a lattice costs as much as so many evaluations of its forces.
constexpr double IMPLICIT_COST = 100;
// Of the largest stable step, what is recommended; and the time of such a step in evaluations of the forces.
constexpr double SAFE = 0.9, EXPLICIT_COST = 1.3;
// h times the rate of the present motion: above, backward Euler takes more than 2 % of its amplitude a step, and the
// phase of a second-order type is off by some 5 %.
constexpr double FIRST_ORDER = 0.2, SECOND_ORDER = 0.8;

// The largest h with (h w)^2 + k h c < 4 on x'' = -w^2 x - c x': k = 2 is symplectic Euler.
double limit(double w, double c, double k) {
  const double root = k * c + std::sqrt(k * c * k * c + 16 * w * w);
  return root > 0 ? 8 / root : 0.0;
}

std::string of_explicit(const Advice& a, const Method& method) {
  const double share = method.traits->oscillation, most = largest_stable_step(method, a.spectrum.omega_max, a.spectrum.damping);
  if (share == 0 && a.spectrum.damping == 0)
    return format("-ts_type %s amplifies undamped oscillations at any step: take -ts_type symplectic, which does not", method.type());
  if (share > 0 && a.step > most)
    return format("h exceeds the stability limit of -ts_type %s: take -ts_dt %.2g, or an implicit type such as beuler", method.type(), SAFE * most);
  return {};
}

std::string of_implicit(const Advice& a, bool first_order) {
  std::string text;
  const double steps = std::ceil(a.step / (SAFE * a.explicit_step));
  if (steps <= 1) text = "-ts_type symplectic is stable at this step, too, and should cost less";
  else if (steps <= IMPLICIT_COST)
    text = format("%.0f steps of -ts_type symplectic -ts_dt %.2g should cost less than one step of this type", steps, a.step / steps);
  const double swing = a.step * a.spectrum.motion, bound = first_order ? FIRST_ORDER : SECOND_ORDER;
  if (swing > bound)
    text += format("%sh is long for resolving the motion (rate %.3g 1/s, h times it %.2g): %s-ts_dt %.2g for accuracy", text.empty() ? "" : "; ",
                   a.spectrum.motion, swing, first_order ? "a type of higher order such as bdf, or " : "", a.step * bound / swing);
  return text;
}

}  // namespace

double largest_stable_step(const Method& method, double omega, double damping) {
  return method.traits->second_order ? limit(omega, damping, method.traits->damping) : method.traits->oscillation * limit(omega, damping, 2);
}

std::vector<std::string> Advice::lines() const {
  std::vector<std::string> out;
  if (explicit_step <= 0) return out;
  std::string text = format("fastest oscillation: omega_max about %.3g 1/s, h omega_max = %.3g", spectrum.omega_max, step * spectrum.omega_max);
  if (spectrum.damping > 0) text += format(", damping rate up to %.3g 1/s", spectrum.damping);
  out.push_back(text + format("; largest stable explicit step %.3g s (symplectic, as it starts)", explicit_step));
  if (!hint.empty()) out.push_back("hint: " + hint);
  return out;
}

void Advice::put(Report* report) const {
  if (explicit_step <= 0) return;
  report->set("omega_max", spectrum.omega_max);
  report->set("omega_max_ritz", spectrum.omega_ritz);
  report->set("h_omega_max", step * spectrum.omega_max);
  report->set("damping_rate_max", spectrum.damping);
  report->set("motion_rate", spectrum.motion);
  report->set("largest_explicit_step", explicit_step);
  report->set("advice_evaluations", spectrum.evaluations);
  report->set("hint", hint);
}

void Advice::put(PetscMPIInt rank, std::vector<Dataset>* constants) const {
  if (explicit_step <= 0) return;
  struct Figure {
    const char* name;
    double value;
    int time;  ///< power of time of its unit
  };
  const Figure figures[] = {{"omega_max", spectrum.omega_max, -1},
                            {"h_omega_max", step * spectrum.omega_max, 0},
                            {"damping_rate_max", spectrum.damping, -1},
                            {"motion_rate", spectrum.motion, -1},
                            {"largest_explicit_step", explicit_step, 1}};
  for (const auto& [name, value, time] : figures) {
    std::vector<double> mine;
    if (rank == 0) mine.push_back(value);
    constants->push_back({std::string("/backspring/advice/") + name, rank == 0 ? 0 : 1, 1, 0, std::move(mine), {}, {0, 0, time}});
  }
}

PetscErrorCode read_advise(MPI_Comm comm, bool* wanted) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Advice", [&](Section& o) {
    o.flag("-bs_advise",
           "estimate the fastest oscillation at the start, recommend a step and a -ts_type for it, and say on the way where explicit steps would "
           "cost less",
           *wanted);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode advise(Model& model, TS ts, const TSContext& context, Advice* out) {
  PetscReal time;
  PetscFunctionBegin;
  *out = {};
  PetscCall(TSGetTimeStep(ts, &out->step));
  if (!model.mechanics()) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts, &time));
  PetscCall(estimate_spectrum(*model.mechanics(), time, model.initial_state(), &out->spectrum));
  if (out->spectrum.omega_max <= 0) PetscFunctionReturn(0);
  out->explicit_step = limit(out->spectrum.omega_max, out->spectrum.damping, 2);
  // a type that adapts its step finds a stable and accurate one itself
  bool adaptive = false;
  PetscCall(is_adaptive(ts, &adaptive));
  if (adaptive) PetscFunctionReturn(0);
  PetscInt order;
  PetscCall(observed_order(ts, *context.method, &order));
  out->hint = context.implicit ? of_implicit(*out, order == 1) : of_explicit(*out, *context.method);
  PetscFunctionReturn(0);
}

PetscErrorCode StepWatch::begin(TS ts, const TSContext& context, const Advice& start) {
  bool adaptive = false;
  PetscReal time = 0;
  PetscFunctionBegin;
  PetscCall(is_adaptive(ts, &adaptive));
  if (adaptive || !model_.mechanics()) PetscFunctionReturn(0);
  step_ = start.step;
  implicit_ = context.implicit;
  if (implicit_) {
    PetscCall(TSGetTime(ts, &time));
    start_ = time;
    limit_ = start.explicit_step;
    evaluation_ = start.spectrum.seconds;
    wall_ = MPI_Wtime();
    if (limit_ > 0) method_ = context.method;
  } else if (context.method->traits->oscillation > 0 &&
             step_ <= largest_stable_step(*context.method, start.spectrum.omega_max, start.spectrum.damping)) {
    method_ = context.method;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode StepWatch::check(PetscInt step, double t, Vec y) {
  constexpr PetscInt RARELY = 512;
  PetscFunctionBegin;
  const bool power = step > 0 && (step & (step - 1)) == 0;
  if (!method_ || !(step < RARELY ? power : step % RARELY == 0)) PetscFunctionReturn(0);
  PetscCall(implicit_ ? check_cost(step, t, y) : check_limit(step, t, y));
  PetscFunctionReturn(0);
}

PetscErrorCode StepWatch::check_limit(PetscInt step, double t, Vec y) {
  constexpr double OVER = 1.001;  // the estimate is by differences of forces
  const char* const key = "step_limit";
  Spectrum now;
  PetscFunctionBegin;
  if (warnings_.has(key)) PetscFunctionReturn(0);
  PetscCall(estimate_spectrum(*model_.mechanics(), t, y, &now));
  const double most = largest_stable_step(*method_, now.omega_ritz, now.damping);
  if (!(most > 0) || step_ <= OVER * most) PetscFunctionReturn(0);
  PetscCall(warnings_.add(key, format("the step %g s is beyond the stability limit of -ts_type %s since step %lld at the latest, t = %.6g s: the "
                                      "fastest oscillation is at %.3g 1/s there; "
                                      "lower -ts_dt below %.3g s, or take an implicit type such as beuler",
                                      step_, method_->type(), static_cast<long long>(step), t, now.omega_ritz, most)));
  PetscFunctionReturn(0);
}

/// That symplectic Euler would have taken from the start to t.
double StepWatch::explicit_seconds(double t, double most) const { return EXPLICIT_COST * evaluation_ * std::ceil((t - start_) / (SAFE * most)); }

PetscErrorCode StepWatch::check_cost(PetscInt step, double t, Vec y) {
  constexpr double LONG = 5, MUCH = 2;  // seconds; times
  const char* const key = "explicit_cheaper";
  double seconds = MPI_Wtime() - wall_;
  Spectrum now;
  PetscFunctionBegin;
  if (warnings_.has(key)) PetscFunctionReturn(0);
  PetscCall(max_over_ranks(model_.comm(), &seconds));
  if (seconds < LONG || seconds < MUCH * explicit_seconds(t, limit_)) PetscFunctionReturn(0);
  PetscCall(estimate_spectrum(*model_.mechanics(), t, y, &now));
  if (now.omega_max > 0) limit_ = std::min(limit_, limit(now.omega_max, now.damping, 2));
  const double other = explicit_seconds(t, limit_);
  if (seconds < MUCH * other) PetscFunctionReturn(0);
  PetscCall(warnings_.add(
      key, format("explicit steps would cost less: %s to t = %.6g s took %.3g s, for which -ts_type symplectic -ts_dt %.2g would take about %.2g s",
                  how_many(step, "step").c_str(), t, seconds, SAFE * limit_, other)));
  PetscFunctionReturn(0);
}

}  // namespace bs
