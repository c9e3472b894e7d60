#include "base/handle.hpp"
#include "systems/equilibrium.hpp"

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
    PetscCall(copy_into(&line_, z));
    PetscCall(zero_velocities(line_));
    PetscCall(self_.at_rest(y));
    PetscCall(energy_.follow(self_.rest_, line_));
    PetscFunctionReturn(0);
  }
  PetscErrorCode beyond_slope(double t, double sigma, double lambda, PotentialChange* change) override {
    PetscFunctionBegin;
    PetscCall(energy_.beyond_slope(loaded(t), self_.moves() ? 1 / self_.step_ : sigma, lambda, change));
    PetscFunctionReturn(0);
  }
  bool limits_steps() const override { return energy_.limits_steps(); }
  PetscErrorCode largest_lambda(double t, double* lambda) override {
    PetscFunctionBegin;
    PetscCall(energy_.largest_lambda(loaded(t), lambda));
    PetscFunctionReturn(0);
  }

 private:
  /// The load factor, under which the system is then.
  double loaded(double t) const {
    const double s = self_.factor(t);
    self_.load(s);
    return s;
  }
  Equilibrium& self_;
  Incremental& energy_;
  VecHandle line_;
};

Incremental* Equilibrium::incremental() {
  if (!own_->potential()) return nullptr;
  if (!potential_) potential_ = std::make_shared<Potential>(*this, *own_->potential());
  return potential_.get();
}

}  // namespace bs
