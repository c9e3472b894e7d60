#include "time/energy_watch.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"

namespace bs {
namespace {

// An undamped oscillator at h omega by symplectic Euler swings in energy by up to 1/(1 - h omega/2): 10 at 0.9 of its limit.
constexpr double EXPLICIT = 10;
constexpr PetscInt FIRST_EXPLICIT = 8, FIRST_IMPLICIT = 32;
const char* const KEY = "energy_growth";

}  // namespace

void EnergyWatch::set_explicit() {
  explicit_ = true;
  factor_ *= EXPLICIT;
}

/// By a hash of the number, the same in a run and its continuation.
bool EnergyWatch::chosen(PetscInt step) const {
  const std::uint64_t hash = static_cast<std::uint64_t>(step) * 0x9E3779B97F4A7C15u;
  return always_ || step <= (explicit_ ? FIRST_EXPLICIT : FIRST_IMPLICIT) || (hash >> 40) % (explicit_ ? 128 : 4) == 0;
}

std::string EnergyWatch::words(double inner, double budget) const {
  if (model_.linear())
    return format(
        "x.C x/2 is %.3g, more than %g times the %.3g supplied by the initial state, sources and active elements: lower -ts_dt, or take an implicit "
        "-ts_type "
        "such as beuler",
        inner, factor_, budget);
  return format(
      "%.3g J of kinetic and elastic energy, more than %g times the %.3g J supplied by the initial state, fields, driven anchors and groups and the "
      "fluid: %s",
      inner, factor_, budget,
      explicit_ ? "lower -ts_dt below the largest stable step, or take an implicit -ts_type such as beuler"
                : "lower -ts_dt, and leave out options that end Newton early (-snes_type ksponly, a loose -snes_rtol)");
}

/// Every number that it carries from check to check, by its name in a checkpoint.
std::vector<std::pair<const char*, double*>> EnergyWatch::numbers(EnergyWatch* of) {
  EnergySupply& last = of->last_;
  return {{"watch_time", &of->time_},        {"watch_supplied", &of->supplied_}, {"watch_start", &of->start_}, {"watch_released", &of->released_},
          {"watch_field", &of->field_},      {"watch_power", &last.power},       {"watch_pull", &last.pull},   {"watch_shift_x", &last.shift[0]},
          {"watch_shift_y", &last.shift[1]}, {"watch_shift_z", &last.shift[2]},  {"watch_speed", &last.speed}, {"watch_work", &last.work}};
}

void EnergyWatch::save(Facts* facts) const {
  if (!begun_) return;
  EnergyWatch copy = *this;
  for (const auto& [name, value] : numbers(&copy)) facts->real[name] = *value;
}

void EnergyWatch::restore(const Facts& facts) {
  if (facts.real.count("watch_time") == 0) return;
  begun_ = true;
  for (const auto& [name, value] : numbers(this)) *value = facts.real_of(name, *value);
}

PetscErrorCode EnergyWatch::check(PetscInt step, double t, Vec y, bool certainly) {
  EnergySupply now;
  PetscFunctionBegin;
  if (factor_ <= 0 || !active_ || warnings_.has(KEY)) PetscFunctionReturn(0);
  if (begun_ ? t == time_ || !(certainly || chosen(step)) : false) PetscFunctionReturn(0);
  PetscCall(model_.energy_supply(t, y, &now, &active_));
  if (!active_) PetscFunctionReturn(0);
  if (!begun_) {
    start_ = now.inner;
    field_ = now.field;
  } else {
    const double direct = std::hypot(now.shift[0] - last_.shift[0], now.shift[1] - last_.shift[1], now.shift[2] - last_.shift[2]);
    const double path = std::max(direct, std::max(now.speed, last_.speed) * (t - time_));
    supplied_ += std::max(now.power, last_.power) * (t - time_) + std::max(now.pull, last_.pull) * path + (now.work - last_.work);
    released_ = std::max(released_, field_ - now.field);
  }
  begun_ = true;
  time_ = t;
  last_ = now;
  const double budget = start_ + released_ + supplied_ + now.rounding;
  if (std::isfinite(now.inner) && !(now.inner > factor_ * budget)) PetscFunctionReturn(0);
  PetscCall(warnings_.add(KEY, format("energy grew beyond what drives it, first seen at step %lld, t = %.6g s: %s", static_cast<long long>(step), t,
                                      words(now.inner, budget).c_str())));
  PetscFunctionReturn(0);
}

}  // namespace bs
