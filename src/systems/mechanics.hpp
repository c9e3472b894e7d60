// Second-order systems M x'' = f(t, x, v), independently of how they are integrated in time. M is diagonal, the state is
// y = (x, v) in the order of layout.hpp, K = df/dx, D = df/dv. Time stepping needs (a, b, c) = (sigma, 1, 1/sigma) of
// a M - b D - c K, equilibria (0, 0, 1), modes (1, 0, 0) and (0, 0, 1).
#pragma once
#include <petscmat.h>
#include <vector>
#include "base/handle.hpp"
#include "linalg/pencil.hpp"
#include "systems/incremental.hpp"
#include "systems/layout.hpp"
#include "systems/strain_response.hpp"
#include "systems/system.hpp"

namespace bs {

/// A second-order system linearised at one state.
class Linearisation : public Pencil {
 public:
  virtual const Layout& layout() const = 0;
  /// A vector laid out as a state; borrowed.
  virtual Vec state_vector() const = 0;
  PetscInt dim() const final { return layout().dim; }
  PetscInt points() const final { return layout().particles; }
  /// Collective. Linearises at (t, y); y is copied.
  virtual PetscErrorCode linearise(double t, Vec y) = 0;
  /// Collective. f = K z_x + D z_v exactly, (n, d), zero at fixed particles; z is laid out as a state.
  virtual PetscErrorCode change_of_force(Vec z, double* f) = 0;
  /// Collective. Positions change by a part of z, laid out as a state, that is at most 1 and turns no spring by more than `turn` [1]; from the next
  /// linearise() on the stiffness of springs across their directions is that of tensions predicted for the change, until forget_tensions().
  virtual PetscErrorCode predict_tensions(Vec, double /* turn */, double* part) {
    *part = 1;
    return 0;
  }
  virtual void forget_tensions() {}
  /// Collective. f = D w exactly; w, f: (n, d).
  virtual PetscErrorCode damping_force(const double* w, double* f) = 0;
  /// Whether links damp, the same on every rank; and the largest rate by which those of an owned particle do, D/m [1/s].
  virtual bool damps() const { return false; }
  virtual double damping_rate() const { return 0; }
  /// Whether the matrix of assemble(), which is symmetric, holds all of a M - b D - c K.
  virtual bool exact_symmetric() const = 0;
  /// Whether df/dx is symmetric where nothing moves.
  virtual bool symmetric_at_rest() const = 0;
  /// Whether df/dx and df/dv are all of what forces change by; else forces are computed outside without a tangent.
  virtual bool complete() const { return true; }
  /// Collective. Predicted floating-point operations of a sparse Cholesky factorisation of that matrix, the same on any number of ranks;
  /// for small systems: the whole graph is looked at by one rank.
  virtual PetscErrorCode factor_flops(double* flops) = 0;
  /// Collective. The rigid body modes of an AIJ matrix become those of the state linearised at; before that they are of the start.
  virtual PetscErrorCode set_rigid_modes(Mat S) = 0;
  PetscErrorCode multiply(const Coefficients& coefficients, Vec z, Vec out) override;

 private:
  VecHandle room_;  ///< (c z, b z), made at first use
  std::vector<double> force_;
};

/// How far the loads of a static analysis are applied. The factor is 1 in dynamics.
struct Loads {
  double gravity = 1;
  bool gravity_grows = false;         ///< with the load factor
  double factor = 1;                  ///< s
  bool forces_grow = false;           ///< forces on groups and of the lattice, with s
  bool at_rest = false;               ///< what is driven has the positions of its motion, not the velocities
  bool anchors_at_full_load = false;  ///< driven anchors stand where they are at t = 1
  bool driven_at_full_load = false;   ///< driven groups likewise
  bool box_at_full_load = false;      ///< the periodic box likewise
};

/// Particles under a name that options or the input give them.
struct ParticleGroup {
  std::string name;
  std::int64_t total = 0;        ///< members on all ranks
  std::vector<PetscInt> member;  ///< owned particles, by their places on this rank
};

class Mechanics : public System {
 public:
  /// Named sets of its particles: the same names in the same order on every rank.
  virtual std::vector<ParticleGroup> groups() const { return {}; }
  /// Collective. The run goes on from (t, y), which was set or found, not stepped to: histories of springs are brought up to it, and work is counted
  /// from here. Nothing breaks.
  virtual PetscErrorCode begin_at(double, Vec) { return 0; }
  /// Collective. Whether a spring that has no room in matrices would exert something with these numbers: the system has to be made anew for them.
  virtual PetscErrorCode lacks_pattern(const std::string&, const std::vector<double>&, bool* yes) {
    *yes = false;
    return 0;
  }
  /// Collective. Numbers of the lattice (lattice/lattice.hpp) from now on; `all`: of the whole, checked and the same on every rank. What was computed
  /// with others is forgotten; histories stay. Error (exit 2): numbers that a force has taken for good.
  virtual PetscErrorCode set_numbers(const std::string&, const std::vector<double>&) { return 0; }
  /// Collective. lambda . df/dp for the number p of that name of each spring at (t, y): of this rank's rows in the input's order. lambda is laid out
  /// as a state, in the places of x; histories are taken as they are.
  virtual PetscErrorCode force_changes(const std::string&, double, Vec, Vec, std::vector<double>* rows) {
    rows->clear();
    return 0;
  }
  /// Collective. Their present values, of the whole lattice, on every rank; rest lengths that were not given are the initial distances.
  virtual PetscErrorCode numbers(const std::string&, std::vector<double>* all) {
    all->clear();
    return 0;
  }
  /// Collective. What is held has the positions and velocities in y that it has at time t.
  virtual PetscErrorCode place_held(double, Vec) { return 0; }
  /// Collective. Constraints::give.
  virtual PetscErrorCode give_motion(const std::string&, double, double, Vec) { return 0; }
  /// Whether forces are computed outside, by functions that no file holds.
  virtual bool forced_outside() const { return false; }
  /// Whether forces relax with time where nothing moves, by histories that estimates of the error of y do not see; the same on every rank.
  virtual bool relaxes() const { return false; }
  /// Motions that are given: the group's name, and the times from and to which it is led [s]; the same on every rank.
  struct GivenMotion {
    std::string group;
    double from = 0, to = 0;
  };
  virtual std::vector<GivenMotion> given_motions() const { return {}; }
  /// The option of a motion that is given from outside, of which checkpoints hold nothing; empty: there is none.
  virtual std::string given_motion() const { return {}; }
  /// Collective. Forces that supports and motions exert on held components of the owned particles at (t, y), m A - f, (n, d) [N]; 0 on others.
  virtual PetscErrorCode reactions(double, Vec, std::vector<double>* out) {
    out->assign(static_cast<std::size_t>(layout().particles * layout().dim), 0.0);
    return 0;
  }
  /// The factors of the evaluations that follow.
  virtual void set_loads(const Loads&) {}
  /// Collective. Ends the run with exit code 2 where loads that do not depend on place or time act on particles that nothing holds, as
  /// they stand; else `free`: how many bodies are tied to no fixed particle and no anchor.
  virtual PetscErrorCode count_free_bodies(PetscInt* free) {
    *free = 0;
    return 0;
  }
  /// Collective, in statics. `to` is an equilibrium at t_to that was found from `from` at t_from, and v = (x - x_from)/h. No force says where bodies
  /// are that nothing holds: their centres of mass go back to where they were, or where the box has carried them, from where rounding and tolerances
  /// of the solvers have left them.
  virtual PetscErrorCode return_free_bodies(double, Vec, double, double, Vec) { return 0; }
  /// Collective. The response to strains of the periodic box at (t, y); without such a box `out->count` is 0.
  virtual PetscErrorCode strain_response(double, Vec, StrainResponse* out) {
    *out = {};
    return 0;
  }
  /// Components of the box' strain that are free, with the stresses given at time t; and their strains.
  virtual std::vector<FreeStrain> free_strains(double) const { return {}; }
  virtual void set_free_strains(const std::vector<double>&) {}
  /// Whether a box that changes carries all particles along; then y, the state of a start at time t, follows it: from where the lattice has them to
  /// where its strain has carried them, and with its velocity there added to theirs.
  virtual bool flows() const { return false; }
  virtual PetscErrorCode follow_box(double, Vec) { return 0; }
  virtual const Layout& layout() const = 0;
  /// Why the rows of the input that frames show do not stand in a state as layout() has them; empty: they do.
  virtual std::string why_not_by_rows() const { return "the system has an order of its own"; }
  /// Masses of the owned particles [kg], (n) or longer.
  virtual const std::vector<double>& masses() const = 0;
  /// Collective. f(t, x, v) [N] of the owned particles, (n, d), zero at fixed ones, where they are held at x; borrowed until
  /// the next call. Not finite where a law has no value: last_fault() says which.
  virtual PetscErrorCode force(double t, Vec y, const double** f) = 0;
  /// Collective. size: (n, d), magnitudes that add up to the force on each particle and may cancel: rounding errors of the
  /// force are this times the machine's precision [N]. sigma: of x' = sigma x + ..., by which velocities are rounded [1/s]; 0: nothing moves.
  virtual PetscErrorCode force_magnitudes(double t, Vec y, double sigma, double* size) = 0;
  /// Collective. At each owned particle, held ones included [N]. inner: sizes of the forces between particles, added up; outer: the largest of what
  /// anchors and fields exert, and of the force that holds it.
  virtual PetscErrorCode force_sizes(double t, Vec y, std::vector<double>* inner, std::vector<double>* outer) = 0;
  virtual Linearisation& linearisation() = 0;
  /// Whether some force couples all particles with one another; the matrices of linearisation() leave it out.
  virtual bool couples_all() const = 0;
  /// The energies along a line of states.
  virtual Incremental* potential() = 0;

  /// Collective. The matrix J = [sigma M, -M; -K, sigma M - D] of F_x = M (x' - v), F_v = M v' - f in the order of the state, or
  /// J divided by M, at the state of linearisation().
  virtual PetscErrorCode create_first_order(Mat* J) = 0;
  virtual PetscErrorCode assemble_first_order(double sigma, bool momentum, Mat J) = 0;
  /// The operator that goes with J: J itself (referenced), or J plus forces that couple all.
  virtual PetscErrorCode create_first_order_operator(Mat J, bool momentum, Mat* A) = 0;
};

}  // namespace bs
