#include "systems/equilibrium.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "systems/breaks.hpp"

namespace bs {

/// The energy along a line of positions: v and the line's velocity are 0, so that of Phi only sigma E is left.
class Equilibrium::Potential final : public Incremental {
 public:
  Potential(Equilibrium& self, Incremental& energy) : self_(self), energy_(energy) {}
  std::string lacks_potential() const override { return energy_.lacks_potential(); }
  PetscErrorCode add_kinematic(Vec F, Vec y) override { return energy_.add_kinematic(F, y); }
  PetscErrorCode follow(Vec y, Vec z) override {
    PetscFunctionBegin;
    if (self_.moves()) {
      PetscCall(energy_.follow(y, z));
      PetscFunctionReturn(0);
    }
    if (!line_) PetscCall(VecDuplicate(z, line_.out()));
    PetscCall(VecCopy(z, line_));
    PetscCall(zero_velocities(line_));
    PetscCall(self_.at_rest(y));
    PetscCall(energy_.follow(self_.rest_, line_));
    PetscFunctionReturn(0);
  }
  PetscErrorCode beyond_slope(double t, double sigma, double lambda, PotentialChange* change) override {
    const double s = self_.factor(t);
    PetscFunctionBegin;
    self_.load(s);
    PetscCall(energy_.beyond_slope(s, self_.moves() ? 1 / self_.step_ : sigma, lambda, change));
    PetscFunctionReturn(0);
  }

 private:
  Equilibrium& self_;
  Incremental& energy_;
  VecHandle line_;
};

Equilibrium::Equilibrium(std::unique_ptr<Mechanics> mechanics, const LoadRules& rules)
    : FirstOrder(std::move(mechanics)), rules_(rules), factor_(std::numeric_limits<double>::quiet_NaN()) {
  tangent_.set_static(0);
}

PetscErrorCode Equilibrium::begin() {
  PetscFunctionBegin;
  PetscCall(VecDuplicate(initial_state(), rest_.out()));
  PetscCall(zero_velocities(initial_state()));
  if (rules_.box) PetscCall(own_->add_flow(initial_state()));
  load(1);
  PetscCall(own_->count_free_bodies(&free_));
  PetscFunctionReturn(0);
}

double Equilibrium::factor(double t) const { return std::isnan(factor_) ? t : factor_; }

void Equilibrium::load(double s) {
  Loads loads;
  loads.gravity = rules_.gravity ? s : 1;
  loads.at_rest = true;
  loads.anchors_at_full_load = !rules_.anchors;
  loads.driven_at_full_load = !rules_.driven;
  loads.box_at_full_load = !rules_.box;
  own_->set_loads(loads);
}

Incremental* Equilibrium::incremental() {
  if (!own_->potential()) return nullptr;
  if (!potential_) potential_ = std::make_shared<Potential>(*this, *own_->potential());
  return potential_.get();
}

PetscErrorCode Equilibrium::at_rest(Vec y) {
  PetscFunctionBegin;
  PetscCall(VecCopy(y, rest_));
  if (!moves()) PetscCall(zero_velocities(rest_));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::set_motion(double h, Vec y) {
  PetscFunctionBegin;
  step_ = h;
  if (!moves()) PetscFunctionReturn(0);
  if (!from_) PetscCall(VecDuplicate(y, from_.out()));
  if (!flow_) PetscCall(VecDuplicate(y, flow_.out()));
  PetscCall(VecCopy(y, from_));
  tangent_.set_dynamic();
  PetscFunctionReturn(0);
}

// y' = (y - y_n)/h, whatever the steps of the load are
PetscErrorCode Equilibrium::momentum(double s, Vec y, Vec F) {
  PetscFunctionBegin;
  PetscCall(VecWAXPY(flow_, -1.0, from_, y));
  PetscCall(VecScale(flow_, 1 / step_));
  PetscCall(FirstOrder::residual(s, y, flow_, Form::momentum, F));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::stand(double t, Vec y, double* s) {
  PetscFunctionBegin;
  *s = factor(t);
  load(*s);
  PetscCall(at_rest(y));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::residual(double t, Vec y, Vec ydot, Form, Vec F) {
  const Layout at = own_->layout();
  const double *force = nullptr, *masses = own_->masses().data();
  const PetscScalar *ay = nullptr, *ayd = nullptr;
  PetscScalar* aF = nullptr;
  double s = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
  if (moves()) {
    PetscCall(momentum(s, y, F));
    PetscFunctionReturn(0);
  }
  PetscCall(own_->force(s, rest_, &force));
  PetscCall(VecGetArrayRead(y, &ay));
  PetscCall(VecGetArrayRead(ydot, &ayd));
  PetscCall(VecGetArrayWrite(F, &aF));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      aF[at.x(i, c)] = masses[i] * (ayd[at.x(i, c)] - ay[at.v(i, c)]);
      aF[at.v(i, c)] = -force[i * at.dim + c];
    }
  PetscCall(VecRestoreArrayWrite(F, &aF));
  PetscCall(VecRestoreArrayRead(ydot, &ayd));
  PetscCall(VecRestoreArrayRead(y, &ay));
  PetscFunctionReturn(0);
}

// -z.Kz/z.Mz of a z of 1 and -1, which excites all frequencies alike: that of the stiffer springs, times their number
PetscErrorCode Equilibrium::mean_rate(double* rate) {
  const Layout at = own_->layout();
  const double* masses = own_->masses().data();
  std::vector<double> f(static_cast<std::size_t>(at.particles * at.dim));
  PetscScalar* a = nullptr;
  PetscInt first = 0;
  double sums[2] = {0, 0};
  VecHandle z;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(rest_, z.out()));
  PetscCall(VecZeroEntries(z));
  PetscCall(VecGetOwnershipRange(z, &first, nullptr));
  const auto sign = [&](PetscInt k) { return ((static_cast<std::uint64_t>(first + k) * 0x9E3779B97F4A7C15ULL) >> 63) ? 1.0 : -1.0; };
  PetscCall(VecGetArray(z, &a));
  at.for_each([&](PetscInt x, PetscInt) { a[x] = sign(x); });
  PetscCall(VecRestoreArray(z, &a));
  PetscCall(own_->linearisation().change_of_force(z, f.data()));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      sums[0] += std::abs(f[static_cast<std::size_t>(i * at.dim + c)]);
      sums[1] += masses[i];
    }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, comm()));
  *rate = sums[0] > 0 && std::isfinite(sums[0]) ? sums[0] / sums[1] : 1;
  PetscFunctionReturn(0);
}

// The shift of every solve is far below the stiffness of any structure that is held and above rounding: Newton's method then converges with
// a factor of 1e-10 / (lowest stiffness of a mode, relative to the mean one), and motions that cost no energy are made only as far as
// rounding errors of the forces push: 1e-16 / 1e-10 of the other ones. Where bodies are free, or broken springs may have set some free,
// nothing else holds them: 1e-6.
double Equilibrium::least_shift() const {
  constexpr double LEAST = 1e-10, LEAST_OF_FREE = 1e-6;
  const Breaks* breaks = own_->breaks();
  return (free_ > 0 || (breaks && breaks->any()) ? LEAST_OF_FREE : LEAST) * rate_;
}

PetscErrorCode Equilibrium::jacobian(double t, Vec y, Vec, double sigma, Form form, Mat P) {
  double s = 0, rate = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
  PetscCall(tangent_.linearise(s, rest_, moves() ? 1 / step_ : sigma, form));
  if (moves()) {
    PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
    PetscFunctionReturn(0);
  }
  if (rate_ == 0 || pseudo_ > 0) {
    PetscCall(mean_rate(&rate));
    if (rate_ == 0) rate_ = rate;
  }
  const double part = pseudo_ > 0 && first_ > 0 ? pseudo_ * rate * std::min(1.0, last_ / first_) : 0;
  tangent_.set_static(std::max(part, least_shift()));
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::linearise_sharply(double t, Vec y, Mat P) {
  PetscFunctionBegin;
  PetscCall(jacobian(t, y, nullptr, 1, Form::momentum, P));
  tangent_.set_static(sharp_shift());
  PetscFunctionReturn(0);
}

void Equilibrium::set_pseudo_time(double part) {
  pseudo_ = part;
  first_ = 0;
}

// central differences: exact but for rounding where f is linear in s, and only the speed of the corrector depends on them
PetscErrorCode Equilibrium::load_direction(double t, Vec y, Vec q) {
  constexpr double DS = 1e-3;
  const Layout at = own_->layout();
  const double* force = nullptr;
  PetscScalar* a = nullptr;
  double s = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
  PetscCall(VecZeroEntries(q));
  for (const double side : {1.0, -1.0}) {
    load(s + side * DS);
    PetscCall(own_->force(s + side * DS, rest_, &force));
    PetscCall(VecGetArray(q, &a));
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) a[at.v(i, c)] += side * force[i * at.dim + c] / (2 * DS);
    PetscCall(VecRestoreArray(q, &a));
  }
  load(s);
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::strain_response(double t, Vec y, StrainResponse* out) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
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
  if (text->empty()) *text = trouble_;
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::residual_norms(Vec F, ResidualNorms* norms) {
  PetscFunctionBegin;
  PetscCall(FirstOrder::residual_norms(F, norms));
  if (moves()) PetscFunctionReturn(0);
  (*norms)[0] = 0;  // v is only a prediction
  last_ = (*norms)[1];
  if (first_ == 0) first_ = last_;
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::residual_floor(double t, Vec y, double, Form form, ResidualNorms* floor) {
  const Layout at = own_->layout();
  double s = 0, sum = 0;
  PetscFunctionBegin;
  std::vector<double> size(static_cast<std::size_t>(at.particles * at.dim));
  PetscCall(stand(t, y, &s));
  if (moves()) {
    PetscCall(FirstOrder::residual_floor(s, y, 1 / step_, form, floor));
    PetscFunctionReturn(0);
  }
  PetscCall(own_->force_magnitudes(s, rest_, size.data()));
  for (const double each : size) sum += each * each;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, comm()));
  *floor = {0, 2 * PETSC_MACHINE_EPSILON * std::sqrt(sum)};
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::velocity_errors(Vec y, Vec F, double, Form form, double* worst, double* fastest) {
  PetscFunctionBegin;
  *worst = *fastest = 0;
  if (moves()) PetscCall(FirstOrder::velocity_errors(y, F, 1 / step_, form, worst, fastest));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::accept(double t, Vec y) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
  PetscCall(own_->accept(s, rest_));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::observe(double t, Vec y, std::vector<Observable>* out) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
  PetscCall(own_->observe(s, rest_, out));
  out->push_back({"load_factor", {s}});
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::energy_supply(double, Vec, EnergySupply*, bool* has) {
  *has = false;
  return 0;
}

PetscErrorCode Equilibrium::fields(double t, Vec y, std::vector<Field>* out) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(stand(t, y, &s));
  PetscCall(own_->fields(s, rest_, out));
  PetscFunctionReturn(0);
}

}  // namespace bs
