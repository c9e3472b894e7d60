// The tangent at an equilibrium with the shift that regularises it, and the direction of the loads.
#include <cmath>
#include <cstdint>
#include <cstring>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/hash.hpp"
#include "base/vec_array.hpp"
#include "systems/equilibrium.hpp"
#include "systems/system.hpp"

namespace bs {

namespace {

/// z: 1 or -1 by chance in every position, which depends on where the particle starts, not on its number or rank.
void put_signs(const PetscScalar* start, const Layout& at, PetscScalar* z) {
  for (PetscInt i = 0; i < at.particles; ++i) {
    std::uint64_t chance = 0, bits = 0;
    for (PetscInt c = 0; c < at.dim; ++c) {
      std::memcpy(&bits, start + at.x(i, c), sizeof bits);
      chance = splitmix64(chance + bits);
    }
    for (PetscInt c = 0; c < at.dim; ++c) z[at.x(i, c)] = (chance = splitmix64(chance)) >> 63 ? 1 : -1;
  }
}

}  // namespace

// |Kz| over M, summed for a z of 1 and -1, which excites all frequencies alike: that of the stiffer springs, times their number
PetscErrorCode Equilibrium::mean_rate(double* rate) {
  const Layout at = own_->layout();
  const double* masses = own_->masses().data();
  std::vector<double> f(static_cast<std::size_t>(at.particles * at.dim));
  double sums[2] = {0, 0};
  VecHandle z;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(rest_, z.out()));
  PetscCall(VecZeroEntries(z));
  put_signs(ReadArray(initial_state()), at, WriteArray(z));
  PetscCall(own_->linearisation().change_of_force(z, f.data()));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      sums[0] += std::abs(f[static_cast<std::size_t>(i * at.dim + c)]);
      sums[1] += masses[i];
    }
  PetscCall(sum_over_ranks(comm(), sums, 2));
  *rate = sums[0] > 0 && std::isfinite(sums[0]) ? sums[0] / sums[1] : 1;
  PetscFunctionReturn(0);
}

// The shift of every solve is far below the stiffness of any structure that is held and above rounding: Newton's method then converges with
// a factor of 1e-10 / (lowest stiffness of a mode, relative to the mean one), and motions that cost no energy are made only as far as
// rounding errors of the forces push: 1e-16 / 1e-10 of the other ones. Where bodies are free, or broken springs may have set some free,
// nothing else holds them: 1e-6, until modes softer than that keep the residual from falling.
double Equilibrium::least_shift(bool sharp) const {
  constexpr double LEAST = 1e-10, LEAST_OF_FREE = 1e-6;
  const Breaks* breaks = own_->breaks();
  return (!sharp && (free_ > 0 || (breaks && breaks->any())) ? LEAST_OF_FREE : LEAST) * rate_;
}

void Equilibrium::begin_solve() {
  sharp_ = false;
  solve_first_ = solve_before_ = 0;
}

void Equilibrium::begin_anew() {
  rate_ = 0;
  seen_ = {};
  fault_.clear();
}

PetscErrorCode Equilibrium::jacobian(double t, Vec y, Vec, double sigma, Form form, Mat P) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(tangent_.linearise(s, rest_, moves() ? 1 / step_ : sigma, form));
  if (!moves()) {
    if (rate_ == 0) PetscCall(mean_rate(&rate_));
    tangent_.set_static(least_shift(sharp_));
  }
  PetscCall(tangent_.offer_transposed(P));
  PetscCall(assemble(P));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::linearise_with(double t, Vec y, double shift, Mat P) {
  PetscFunctionBegin;
  PetscCall(jacobian(t, y, nullptr, 1, Form::momentum, P));
  tangent_.set_static(shift);
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::linearise_sharply(double t, Vec y, Mat P) {
  PetscFunctionBegin;
  if (rate_ == 0) PetscCall(jacobian(t, y, nullptr, 1, Form::momentum, P));  // the shift is measured by the first tangent
  PetscCall(linearise_with(t, y, sharp_shift(), P));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::random_load(Vec r) {
  const Layout at = own_->layout();
  const Linearisation& lin = own_->linearisation();
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(r));
  const ReadArray start(initial_state());
  const WriteArray a(r);
  put_signs(start, at, a);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      a[at.v(i, c)] = lin.moves(i, c) ? a[at.x(i, c)] : 0;
      a[at.x(i, c)] = 0;
    }
  PetscFunctionReturn(0);
}

// central differences: exact but for rounding where f is linear in s, and only the speed of the corrector depends on them
PetscErrorCode Equilibrium::load_direction(double t, Vec y, Vec q) {
  constexpr double DS = 1e-3;
  const Layout at = own_->layout();
  const double* force = nullptr;
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(VecZeroEntries(q));
  for (const double side : {1.0, -1.0}) {
    load(s + side * DS);
    PetscCall(own_->force(s + side * DS, rest_, &force));
    const WriteArray a(q);
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) a[at.v(i, c)] += side * force[i * at.dim + c] / (2 * DS);
  }
  load(s);
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::strain_response(double t, Vec y, StrainResponse* out) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(own_->strain_response(s, rest_, out));
  PetscFunctionReturn(0);
}

std::vector<FreeStrain> Equilibrium::free_strains(double t) {
  const double s = factor(t);
  load(s);
  return own_->free_strains(s);
}

PetscErrorCode Equilibrium::last_fault(std::string* text) {
  PetscFunctionBegin;
  PetscCall(own_->last_fault(text));
  if (text->empty()) *text = fault_;
  PetscFunctionReturn(0);
}

}  // namespace bs
