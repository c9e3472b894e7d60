// The forces that constraints exert on groups, and the work that what moves does.
#pragma once
#include <string>
#include <vector>

#include "physics/body/registry.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/nodal_forces.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

/// A support exerts on a held component of a particle the force that Newton's law leaves to it,
///   R = m A - f
/// f what springs, particle laws and couplings exert and A the given acceleration; the reaction of a group is its sum. Of component c moved by
/// X(t) from step n to step n + 1 the work is
///   W = sum of -(f_n + f_{n+1})/2 (X_{n+1} - X_n) + m (V_{n+1}^2 - V_n^2)/2
/// which for springs with linear forces is what their energies and the trapezoidal rule's kinetic energy change by. Driven anchors
/// likewise, with the force of all their springs; and a box whose edges e_k move, with the forces F_k that hold the images shifted along them: the
/// sum of (F_k,n + F_k,{n+1})/2 (e_k,{n+1} - e_k,n). Loads that a load factor s multiplies have the energy s G(x), which changes with s where x
/// stays:
///   W = (G_n + G_{n+1})/2 (s_{n+1} - s_n)
/// Given forces f (NodalForces) are dead loads of an equilibrium, with the energy -f.u, u = x - x0, of which the same is
///   W = -(u_n + u_{n+1})/2 . (f_{n+1} - f_n)
/// and where they vary in time they do the work, work/forces,
///   W = (f_n + f_{n+1})/2 . (x_{n+1} - x_n)
class Reactions {
 public:
  /// Collective. The arguments must outlive the object.
  PetscErrorCode create(const Network& net, const Terms& terms, const NodalForces& forces);
  /// Given forces are dead loads from now on, and gravity by `laws`, unless null, grows with a load factor: work/loads is what growth of both adds to
  /// the energy. `laws` must outlive the object.
  void count_loads(const ParticleLaws* laws);
  /// Whether there is anything to report, or anything that does work.
  bool reports() const { return !groups_.empty(); }
  bool works() const { return !names_.empty(); }

  /// Collective. The state at (t, y) is what work is counted from, unless counting has begun.
  void begin(double t, const LocalState& state);
  /// Collective. Counts the work up to an accepted step.
  PetscErrorCode advance(double t, const LocalState& state);
  /// Counting goes on from this state: springs broke at that of the last advance(), or it was come to without a step.
  void renew(double t, const LocalState& state);
  /// Collective. reaction/NAME (d numbers) of every group with a held component, work/NAME of what moves.
  PetscErrorCode observe(double t, const LocalState& state, std::vector<Observable>* out);
  /// m A - f of held components, 0 of others: (Constraints::holders(), d) [N].
  std::vector<double> of_holders(double t, const LocalState& state) const;
  /// Sizes of the work of all steps, added up [J].
  double path() const { return path_; }
  /// Sum of the works [J].
  double total() const;
  /// The works so far by name, for a checkpoint, and back: those that it holds.
  void keep(const Keeper& keep);

 private:
  /// Forces of the moment and, for holds that move, where they are.
  struct Moment {
    std::vector<double> force;  ///< (holders, d), where something moves
    std::vector<double> x, v;   ///< (holds that move, d)
    double pull[3] = {0, 0, 0}, shift[3] = {0, 0, 0};
    BoxForces box;  ///< this rank's share
    double edges[9] = {};
    double load = 0, load_energy = 0;  ///< s; G [J], this rank's share
    std::vector<double> given, u;      ///< (loaded, d) given forces that do work, and displacements
  };
  double work_of_forces(const Moment& now) const;
  void measure(double t, const LocalState& state, Moment* out) const;
  /// The place of an owned particle among the constraints' holders; their number where it is none.
  std::size_t row_of(PetscInt particle) const;
  struct GroupRows {
    std::string name;
    std::vector<std::size_t> rows;  ///< among the constraints' holders
  };

  const Network* net_ = nullptr;
  const Constraints* constraints_ = nullptr;
  const Terms* terms_ = nullptr;
  const NodalForces* forces_ = nullptr;  ///< null: they do none
  const ParticleLaws* loads_ = nullptr;  ///< null: they do none
  std::vector<GroupRows> groups_;
  std::vector<std::size_t> moved_, row_;          ///< holds that move, of owned particles, and their places among the holders
  std::vector<std::string> names_;                ///< of what does work
  std::vector<int> place_;                        ///< of a motion's work among them
  std::size_t box_ = 0, pulled_ = 0, grown_ = 0;  ///< of the works of the box, the anchors and the loads or forces, where there are such
  bool counted_ = false;                          ///< count_loads() was called
  std::vector<double> work_;
  bool begun_ = false;
  double path_ = 0;
  Moment last_;
};

}  // namespace bs
