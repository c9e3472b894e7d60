// The equilibria f(s, x, 0) = 0 of a second-order system under loads of factor s, in the form that TS steps through: its time is the load
// factor, its steps are load steps, and v = dx/ds only serves to predict the next state.
#pragma once
#include <cmath>
#include <memory>
#include <string>
#include "systems/first_order.hpp"

namespace bs {

/// Which loads grow with the factor; the others act in full from the start.
struct LoadRules {
  bool gravity = true, anchors = true, driven = true, box = true, forces = true;
};

/// What is left of the forces on particles that can move, and what they are to be measured by: the largest of each at any particle [N].
struct Balance {
  double left = 0;    ///< unbalanced force
  double beyond = 0;  ///< of it, what ten times the rounding errors of the particle's own forces do not explain
  double inner = 0;   ///< sum of the sizes of the forces between particles
  double outer = 0;   ///< load, or reaction of a support
  double uneven = 0;  ///< `beyond` by inner and outer of the same particle [1]
  double slight = 0;  ///< a thousandth of what the strains that load steps imposed would make springs exert
};

/// What a lattice holds, and what its springs have dissipated so far [J].
struct HeldEnergies {
  double potential = 0, kinetic = 0, dissipated = 0;
  double rounding = 0;  ///< of these
  double sum() const { return potential + kinetic + dissipated; }
};

/// F_x = M (x' - v), F_v = -f(s, x, 0): what beuler makes of it is Newton's method for f = 0 at s, and the momentum residual is the gradient of
///   Phi = sigma E(s, x)
/// so that the convergence test, the energy search and the condensed solve of dynamics serve here too. S = (shift M - K)/sigma.
class Equilibrium final : public FirstOrder {
 public:
  Equilibrium(std::unique_ptr<Mechanics> mechanics, const LoadRules& rules);
  /// Collective. Velocities become those of a box that the load factor strains, else 0; ends the run with exit code 2 where loads drive what nothing
  /// holds.
  PetscErrorCode begin();
  /// Bodies that are tied to nothing: corrections are M-orthogonal to their rigid motions, to the tolerances of the solvers.
  PetscInt free_bodies() const { return free_; }

  /// Collective. The tangent at (t, y) at rest, of which a solve takes `shift` M - K [1/s^2].
  PetscErrorCode linearise_with(double t, Vec y, double shift, Mat P);
  /// Collective. The same with a shift so small that it does not hide a negative eigenvalue: for its inertia.
  PetscErrorCode linearise_sharply(double t, Vec y, Mat P);
  /// Collective. A load r = (0, q), laid out as a residual, with entries 1 and -1 by chance wherever something can move: it excites all motions.
  PetscErrorCode random_load(Vec r);
  /// That shift, once there is one [1/s^2].
  double sharp_shift() const { return SHARP * least_shift(false); }
  /// Newton's method begins anew.
  void begin_solve();
  /// The system is another than it was, with other numbers: what was measured of it so far is no measure any more.
  void begin_anew();

  /// From now on a solve is a step of backward Euler of h [s] from y, with inertia and damping, at the loads of the factor that it is solved for, and
  /// what is observed moves; h = 0: ends that.
  PetscErrorCode set_motion(double h, Vec y);
  /// Collective. Of the residual F at y: what is left of the forces, and M (x - x_n)/h^2 of such a motion, else 0 [N].
  PetscErrorCode step_forces(Vec y, Vec F, double* left, double* inertia);
  /// Mean squared frequency at the first linearisation [1/s^2]; 0: there has been none.
  double mean_squared_frequency() const { return rate_; }

  /// Counts as released [J] what was neither stored, dissipated by springs nor broken when an equilibrium was found without the loads doing work.
  void release(double energy) { released_ += energy; }
  /// Collective. Of a state of time t.
  PetscErrorCode energies(double t, Vec y, HeldEnergies* out);
  /// Collective. Before the first step: the run goes on from y, at the loads of time t, to which the lattice came from a state that held `had`.
  PetscErrorCode begin_at(double t, Vec y, const HeldEnergies& had);

  /// s is given, from 0 to `end`, whatever the time is (arc length).
  void begin_path(double end) {
    factor_ = 0;
    end_ = end;
  }
  PetscErrorCode covers(double t_start, double t_end) override { return std::isnan(factor_) ? own_->covers(t_start, t_end) : own_->covers(0, end_); }
  /// From now on s is this, whatever the time is (arc length); NaN: the time again.
  void set_factor(double s) { factor_ = s; }
  double factor(double t) const;
  /// Collective. q = df/ds at y, as a residual is laid out: (0, q).
  PetscErrorCode load_direction(double t, Vec y, Vec q);
  /// Collective. Of the lattice at rest at (t, y); and the free strains of its box, with the stresses given at t.
  PetscErrorCode strain_response(double t, Vec y, StrainResponse* out);
  std::vector<FreeStrain> free_strains(double t);
  /// Collective. Of the forces at (t, y), evaluated afresh.
  PetscErrorCode balance(double t, Vec y, Balance* out);
  /// Collective. Mechanics::reactions at (t, y).
  PetscErrorCode reactions(double t, Vec y, std::vector<double>* out);
  /// Collective. Whether y, which a solver calls the equilibrium of time t, is one, whatever the solver's own tolerances: the unbalanced force and,
  /// where stresses of the box are given, what is missing of them, are below 1e-6 of the forces of the run so far, and no particle is left with a
  /// thousandth of its own. `why`: it is none; `hopeless`: a shorter load step would not mend that.
  PetscErrorCode examine(double t, Vec y, std::string* why, bool* hopeless);
  /// Collective. Whether the unbalanced force alone is below that.
  PetscErrorCode is_balanced(double t, Vec y, bool* yes);
  /// Collective. Mechanics::return_free_bodies of y, found for the time t from the state `from` of load factor s_from, with steps h.
  PetscErrorCode return_free_bodies(double s_from, Vec from, double t, double h, Vec y);
  /// Accepted equilibria whose unbalanced force is above 1e-6 of the largest load or reaction, for which rounding errors leave no other choice.
  std::int64_t unbalanced() const { return static_cast<std::int64_t>(seen_.unbalanced); }
  void keep_sums(const Keeper& keep) override;
  /// What a task found wrong with the last solve: the model's fault from now on; empty: nothing.
  void set_fault(const std::string& text) { fault_ = text; }

  PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) override;
  PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) override;
  PetscErrorCode create_matrix(Mat* P) override { return create_shell(P); }
  Incremental* incremental() override;
  bool time_dependent() const override { return true; }
  PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) override;
  PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) override;
  /// Forces are judged by their norms alone.
  PetscErrorCode velocity_errors(Vec y, Vec F, double sigma, Form form, double* worst, double* fastest) override;
  PetscErrorCode begin_step(const Step& step, Vec y) override;
  PetscErrorCode accept(const Step& step, Vec y) override;
  PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) override;
  PetscErrorCode energy_supply(double t, Vec y, EnergySupply* out, bool* has) override;
  PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) override;
  PetscErrorCode foresee(double from, double to, std::string* fault) override { return own_->foresee(factor(from), factor(to), fault); }
  PetscErrorCode last_fault(std::string* text) override;

 private:
  static constexpr double SHARP = 1e-4;  ///< of the shift of a solve
  /// Share of the forces on particle k that is left of them beyond their rounding errors. Where the springs at rest exert next to none, the measure
  /// is what a strain of FAINT rounding errors of the force would make them exert, or a thousandth of what the strains that load steps impose on
  /// them would: a share of forces that are 0, as in a net that bears no load, has no meaning.
  double share_left(PetscInt k, double left, double acting) const;
  double slight_force(PetscInt k) const;
  class Potential;
  /// rest_ becomes y without its velocities.
  PetscErrorCode at_rest(Vec y);
  /// Sets the loads of factor s, which is also the time of what is driven.
  void load(double s);
  /// Both, at the factor s of time t.
  PetscErrorCode apply_loads_at(double t, Vec y, double* s);
  PetscErrorCode mean_rate(double* rate);
  /// rounding_
  PetscErrorCode roundings(double s);
  /// Of the largest forces that an equilibrium may leave, with those of the run so far [N].
  double may_leave(const Balance& b) const;
  PetscErrorCode missing_stress(double t, Vec y, double* missing, double* size);
  bool moves() const { return step_ > 0; }
  PetscErrorCode momentum(double s, Vec y, Vec F);
  /// Of a solve [1/s^2].
  double least_shift(bool sharp) const;

  LoadRules rules_;
  std::shared_ptr<Potential> potential_;
  VecHandle rest_;         ///< (x, 0); in motion (x, v)
  double step_ = 0;        ///< of a motion [s]; 0: there is none
  VecHandle from_, flow_;  ///< where its step began; room for y'
  double rate_ = 0;        ///< mean squared frequency at the first linearisation [1/s^2]
  double factor_, end_ = 1;
  double load_factor_ = 0, floor_ = 0;  ///< of the last evaluation; rounding errors of all forces [N]
  PetscInt free_ = 0;
  bool sharp_ = false;                         ///< in this solve from now on: bodies that are tied to nothing have no larger shift than others
  double solve_first_ = 0, solve_before_ = 0;  ///< residuals of this solve: the first, the one before the last [N]
  std::vector<double> rounding_;               ///< (n) of the force on each particle, of the last floor [N]
  /// Of the run so far: largest forces [N], largest stress, largest residual beside its rounding errors and itself [N], equilibria that are not
  /// balanced.
  struct {
    double inner = 0, outer = 0, stress = 0, loaded = 0, unbalanced_norm = 0, unbalanced = 0;
  } seen_;
  double released_ = 0;  ///< [J]
  std::string fault_;
};

}  // namespace bs
