// Forces that are given for each particle: /particles/force of a lattice and -bs_force_NAME.
#pragma once
#include <string>
#include <vector>
#include "physics/whole/drive.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// On particle i act F_i of the lattice, and of every group g that it belongs to a constant C_g and E_g(t, x0), each for itself or an n_g-th part:
///   f_i = s (F_i + sum of w_g C_g) + sum of w_g E_g(t, x0_i),   w_g = 1 or 1/n_g
/// In dynamics s = 1. In an equilibrium under the load factor s all are dead loads, E_g as it is at t = s; where the loads do not grow, s = t = 1.
/// They depend on no position, so that the tangent has nothing of them. Dead loads have the potential
///   E = -sum of f_i.(x_i - x0_i)
/// and forces that vary in time do work (Reactions).
class NodalForces final : public Term {
 public:
  /// Collective. Reads -bs_force_NAME. Errors (exit 2): unknown groups, texts that are no forces, tables that are not there.
  PetscErrorCode read(MPI_Comm comm, const Lattice& lattice);
  /// Collective. Finds the particles in the network, which must outlive the object.
  PetscErrorCode create(const Network& net);
  /// Whether there are any on any rank; whether some vary in time.
  bool active() const { return active_; }
  bool varies() const { return varies_; }
  /// From now on all are dead loads of an equilibrium; `grow`: with s.
  void set_static(double s, bool grow);
  /// Adds what varies of them in time.
  void list_drives(std::vector<Drive*>* all);
  /// Whether some act that grow with s.
  bool grows() const { return active_ && grow_; }

  /// Owned particles on which some act, ascending; the force on the k-th of them, d numbers; and the part of it that has no potential.
  const std::vector<PetscInt>& loaded() const { return loaded_; }
  void force(std::size_t k, double t, double* f) const;
  void varying(std::size_t k, double t, double* f) const;

  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override;
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override;
  void energies(double t, const LocalState& state, Energies* sum) const override;
  void supply(double t, const LocalState& state, Supply* sum) const override;
  void outer_sizes(double t, const LocalState& state, double* size) const override;

  /// Collective. force/NAME (d numbers) and moment/NAME about the origin (3 numbers) of every group on whose particles some act; both of all before.
  PetscErrorCode observe(double t, const LocalState& state, std::vector<Observable>* out) const;
  /// Collective. Ends the run with exit code 2 where a table does not reach t_end.
  PetscErrorCode covers(double t_end) const;
  /// Collective. What of the forces is not finite at time t (System::foresee).
  PetscErrorCode foresee(double t, std::string* text) const;
  std::vector<std::string> describe() const;

 private:
  struct Given {
    std::size_t group;  ///< among the lattice's
    std::string text;
    double constant[3] = {0, 0, 0};
    bool shared = false, varies = false;
    Drive drive;  ///< the components that vary
  };
  /// Of one loaded particle by one of given_.
  struct Share {
    std::size_t given;
    double weight;
  };
  PetscErrorCode parse(MPI_Comm comm, const std::string& option, int dim, Given* out) const;
  std::string option_of(const Given& one) const { return "-bs_force_" + names_[one.group]; }
  double energy_of(std::size_t k, double t, const LocalState& state) const;
  void add_varying(std::size_t k, double t, double* f) const;

  const Network* net_ = nullptr;
  std::vector<std::string> names_;
  std::vector<Given> given_;
  std::vector<PetscInt> loaded_;
  std::vector<std::size_t> slots_[2];  ///< of loaded particles of either Part
  std::vector<double> constant_;       ///< (loaded, d), at s = 1
  std::vector<std::size_t> first_;     ///< (loaded + 1) of each among shares_
  std::vector<Share> shares_;          ///< of forces that vary
  std::int64_t rows_ = 0;              ///< particles on which the lattice's act, on all ranks
  bool active_ = false, varies_ = false, static_ = false, grow_ = true;
  double load_ = 1;
};

}  // namespace bs
