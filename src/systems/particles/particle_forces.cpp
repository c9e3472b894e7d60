// Forces and energies of a state, what of them still holds when the same state comes again, loads of a statics run, and bodies that nothing holds
// against them.
#include "base/dimension.hpp"
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "base/petsc_versions.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

// A frame's energies are summed in the pass that makes the forces (forces_and_energies), which the next step often begins with: from the state
// it starts at. Then only the particles that are linked to ghosts are evaluated again, whose states may have changed on another rank.
PetscErrorCode ParticleModel::force(double t, Vec y, const double** f) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::forces, y);
  PetscCall(state_.gather_begin(t, y));
  const bool known = knows_interior(t);
  fault_ = {};
  wasted_ = known ? 0 : wasted_ + (summed_ ? 1 : 0);
  summed_ = false;
  // ghosts travel meanwhile, unless forces on any particle are asked for together with them
  const bool ghosts_first = coupling_.active() || callback_.feels_ghosts();
  if (!ghosts_first && !known) terms_->forces(Part::interior, t, state_, force_.data(), &fault_);
  PetscCall(state_.gather_end(t, y));
  PetscCall(terms_->gather(state_));
  if (ghosts_first && !known) terms_->forces(Part::interior, t, state_, force_.data(), &fault_);
  note_interior(t, fault_);
  terms_->forces(Part::boundary, t, state_, force_.data(), &fault_);
  constraints_.clear(0, net_.n, 1, force_.data());
  *f = force_.data();
  // of a spring at one end: distance and length 3d, the law 6, its share 2d
  PetscCall(PetscLogFlops((5.0 * net_.dim + 6) * static_cast<double>(net_.links.other.size())));
  PetscFunctionReturn(0);
}

/// Whether force_ holds the forces on particles that no ghost acts on, for the state that state_ holds and time t: they depend on the states and
/// the terms as they are, and on the time where anything does.
bool ParticleModel::knows_interior(double t) const {
  return interior_.known && interior_.state == state_.version() && interior_.terms == terms_->version() && (interior_.time == t || !time_dependent());
}

/// Whether forces on the same state differ from time to time.
bool ParticleModel::time_dependent() const {
  bool laws = false;
  for_each_law(laws_, [&](const auto& law) { laws = laws || (varies_in_time<std::decay_t<decltype(law)>>::value && law.active()); });
  return laws || constraints_.time_dependent() || forces_.varies() || callback_.active() || (net_.relaxes && !loads_);
}

/// After they have been computed; a fault is to be met again. What couples all particles depends on the states of other ranks, too.
void ParticleModel::note_interior(double t, const Singularity& fault) {
  interior_ = {!coupling_.active() && fault.kind == Singularity::none, state_.version(), terms_->version(), t};
}

PetscErrorCode ParticleModel::gather(double t, Vec y) {
  PetscFunctionBegin;
  PetscCall(state_.gather(t, y));
  PetscCall(terms_->gather(state_));
  PetscFunctionReturn(0);
}

/// This rank's energies of y, which state_ holds: a frame's observables and what watches the energy ask for those of the same state.
const Energies& ParticleModel::energies_at(double t, Vec y) {
  constexpr int MOST_WASTED = 2;  // passes in a row that summed energies and forces together, and whose forces were not asked for
  PetscObjectId vec = 0;
  PetscObjectState state = 0;
  (void)PetscObjectGetId(reinterpret_cast<PetscObject>(y), &vec);
  (void)PetscObjectStateGet(reinterpret_cast<PetscObject>(y), &state);
  if (known_.vec == vec && known_.state == state && known_.terms == terms_->version() && known_.time == t) return known_.energies;
  known_ = {vec, state, terms_->version(), t, {}};
  if (coupling_.active() || wasted_ >= MOST_WASTED) {
    known_.energies = terms_->energies(t, state_);
    return known_.energies;
  }
  Singularity fault;
  for (const Part part : {Part::interior, Part::boundary}) {
    terms_->forces(part, t, state_, force_.data(), &fault, &known_.energies);
    if (part == Part::interior) note_interior(t, fault);
  }
  summed_ = true;
  return known_.energies;
}

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
  for_each_law(laws_, [&](auto& law) {
    if constexpr (has_load<std::decay_t<decltype(law)>>::value) law.load = loads.gravity;
  });
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
    with_dimension(d, [&](auto dim) { (void)law.template force<dim>({0, net_.mass[i], net_.columns(i), zero, zero}, load.data() + i * d); });
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
  PetscCall(free_bodies_.count(net_, terms_->version(), load, may_hold, free));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::return_free_bodies(double t_from, Vec from, double t_to, double h, Vec to) {
  const int d = net_.dim;
  double A[9] = {0};
  PetscFunctionBegin;
  for (int k = 0; k < d; ++k) A[k * d + k] = 1;
  if (constraints_.box().active()) constraints_.box().carried(t_from, t_to, A);
  PetscCall(free_bodies_.pull_back(terms_->version(), A, h, from, to));
  PetscFunctionReturn(0);
}

}  // namespace bs
