// What is given over time: whether a run can follow it; loads of a statics run, and bodies that nothing holds against them.
#include <cmath>
#include "base/error.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

PetscErrorCode ParticleModel::covers(double t_start, double t_end) {
  PetscFunctionBegin;
  if (net_.anchors_total > 0 && !motion_.covers(t_end))
    PetscCall(fail(net_.comm, Exit::input,
                   format("the table of -bs_anchor_table does not reach from t = 0 to the end of the run, "
                          "t = %g s: add rows or lower -ts_max_time",
                          t_end)));
  if (supports_.active()) PetscCall(supports_.covers(t_start, t_end));
  if (cell_.active()) PetscCall(cell_.covers(t_start, t_end));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::foresee(double from, double to, std::string* text) {
  Error fault;
  PetscFunctionBegin;
  text->clear();
  if (!time_dependent()) PetscFunctionReturn(0);
  if (net_.anchors_total > 0) {
    double s[3], v[3];
    motion_.at(to, s, v);
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(s[c]) || !std::isfinite(v[c]))
        fault.note(-2, format("option -bs_anchor_motion: anchor points have no finite place or velocity at t = %.10g: give smaller numbers", to));
  }
  if (cell_.active()) cell_.foresee(from, to, &fault);
  supports_.foresee(from, to, &fault);
  PetscCall(first_error(net_.comm, fault, text));
  PetscFunctionReturn(0);
}

void ParticleModel::set_loads(const Loads& loads) {
  std::get<UniformGravity>(laws_).load = std::get<CentralGravity>(laws_).load = loads.gravity;
  motion_.at_rest = loads.at_rest;
  motion_.at_full_load = loads.anchors_at_full_load;
  supports_.set_static(loads.at_rest, loads.driven_at_full_load);
  cell_.set_static(loads.at_rest, loads.box_at_full_load);
  loads_ = net_.links.at_rest = loads.at_rest;
  if (loads.gravity_grows) ledger_.count_loads(laws_);
  interior_.known = false;
  known_ = {};
}

// A law whose force depends on the place (attraction, walls) may hold a body; drag does not.
PetscErrorCode ParticleModel::count_free_bodies(PetscInt* free) {
  const PetscInt d = net_.dim;
  bool may_hold = coupling_.active();
  std::vector<double> load(static_cast<std::size_t>(net_.n * d), 0.0);
  FreeBodies bodies;
  PetscFunctionBegin;
  const auto add = [&](const auto& law, PetscInt i) {
    const double zero[3] = {0, 0, 0};
    const auto at = [&](auto dim) {
      (void)law.template force<decltype(dim)::value>({0, net_.mass[i], net_.columns(i), zero, zero}, load.data() + i * d);
    };
    if (d == 1) at(std::integral_constant<int, 1>{});
    else if (d == 2) at(std::integral_constant<int, 2>{});
    else at(std::integral_constant<int, 3>{});
  };
  for_each_law(laws_, [&](const auto& law) {
    using Law = std::decay_t<decltype(law)>;
    if (!law.active()) return;
    if (Law::potential == Potential::linear)
      for (PetscInt i = 0; i < net_.n; ++i) add(law, i);
    else may_hold = may_hold || Law::potential != Potential::of_velocity;
  });
  PetscCall(find_free_bodies(net_, load, &bodies));
  *free = bodies.count;
  bodies_adrift_ = !may_hold;
  if (bodies.driven_row >= 0 && !may_hold)
    PetscCall(
        fail(net_.comm, Exit::input,
             format("nothing holds particle %lld and what is tied to it against its loads: there is no equilibrium; fix a particle of it, tie it "
                    "to an anchor, or leave the load out",
                    static_cast<long long>(bodies.driven_row))));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::return_free_bodies(double t_from, Vec from, double t_to, double h, Vec to) {
  const int d = net_.dim;
  double A[9] = {0};
  PetscFunctionBegin;
  if (!bodies_adrift_) PetscFunctionReturn(0);
  if (!bodies_known_) PetscCall(places_.create(net_));
  bodies_known_ = true;
  for (int k = 0; k < d; ++k) A[k * d + k] = 1;
  if (cell_.active()) cell_.carried(t_from, t_to, A);
  PetscCall(places_.pull_back(A, h, from, to));
  PetscFunctionReturn(0);
}

}  // namespace bs
