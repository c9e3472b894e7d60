// Forces and energies of a state, and what of them still holds when the same state comes again.
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

/// Whether force_ holds the forces on particles that no ghost acts on, for the state that state_ holds and time t: they depend on states alone,
/// and on the time where anything does.
bool ParticleModel::knows_interior(double t) const {
  return interior_.known && interior_.version == state_.version() && (interior_.time == t || !time_dependent());
}

/// Whether forces on the same state differ from time to time.
bool ParticleModel::time_dependent() const {
  bool laws = false;
  for_each_law(laws_, [&](const auto& law) { laws = laws || (varies_in_time<std::decay_t<decltype(law)>>::value && law.active()); });
  return laws || constraints_.time_dependent() || forces_.varies() || callback_.active() || (net_.relaxes && !loads_);
}

/// What changes beside the state: histories of springs, springs that break, and what couples all particles.
bool ParticleModel::depends_on_state_alone() const { return !coupling_.active() && !terms_->remembers() && !terms_->breaking().active(); }

/// After they have been computed; a fault is to be met again.
void ParticleModel::note_interior(double t, const Singularity& fault) {
  interior_ = {depends_on_state_alone() && fault.kind == Singularity::none, state_.version(), t};
}

/// This rank's energies of y, which state_ holds: a frame's observables and what watches the energy ask for those of the same state.
const Energies& ParticleModel::energies_at(double t, Vec y) {
  constexpr int MOST_WASTED = 2;  // passes in a row that summed energies and forces together, and whose forces were not asked for
  PetscObjectId vec = 0;
  PetscObjectState state = 0;
  (void)PetscObjectGetId(reinterpret_cast<PetscObject>(y), &vec);
  (void)PetscObjectStateGet(reinterpret_cast<PetscObject>(y), &state);
  const bool same = known_.vec == vec && known_.state == state && known_.time == t;
  if (same && !terms_->remembers()) return known_.energies;  // histories change beside the state
  known_ = {vec, state, t, {}};
  if (!depends_on_state_alone() || wasted_ >= MOST_WASTED) {
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

}  // namespace bs
