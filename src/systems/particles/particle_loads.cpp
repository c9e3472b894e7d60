// What is given in time, loads of a statics run, and bodies that nothing holds against them.
#include "base/error.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

PetscErrorCode ParticleModel::covers(double t_start, double t_end) {
  PetscFunctionBegin;
  PetscCall(constraints_.covers(t_start, t_end));
  PetscCall(forces_.covers(t_end));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::foresee(double from, double to, std::string* text) {
  PetscFunctionBegin;
  PetscCall(constraints_.foresee(from, to, text));
  if (text->empty()) PetscCall(forces_.foresee(to, text));
  PetscFunctionReturn(0);
}

void ParticleModel::set_loads(const Loads& loads) {
  std::get<UniformGravity>(laws_).load = std::get<CentralGravity>(laws_).load = loads.gravity;
  constraints_.set_loads(loads);
  loads_ = net_.links.at_rest = loads.at_rest;
  forces_.set_static(loads.factor, loads.forces_grow);
  reactions_.count_loads(loads.gravity_grows ? &laws_ : nullptr);
  interior_.known = false;
  known_ = {};
}

// A law whose force depends on the place (attraction, walls) may hold a body; drag does not.
PetscErrorCode ParticleModel::count_free_bodies(PetscInt* free) {
  const PetscInt d = net_.dim;
  bool may_hold = coupling_.active();
  std::vector<double> load(static_cast<std::size_t>(net_.n * d), 0.0);
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
  for (std::size_t k = 0; k < forces_.loaded().size(); ++k) {
    double f[3];
    forces_.force(k, 1, f);
    for (PetscInt c = 0; c < d; ++c) load[static_cast<std::size_t>(forces_.loaded()[k] * d + c)] += f[c];
  }
  PetscCall(free_bodies_.count(net_, load, may_hold, free));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::return_free_bodies(double t_from, Vec from, double t_to, double h, Vec to) {
  const int d = net_.dim;
  double A[9] = {0};
  PetscFunctionBegin;
  for (int k = 0; k < d; ++k) A[k * d + k] = 1;
  if (constraints_.box().active()) constraints_.box().carried(t_from, t_to, A);
  PetscCall(free_bodies_.pull_back(A, h, from, to));
  PetscFunctionReturn(0);
}

}  // namespace bs
