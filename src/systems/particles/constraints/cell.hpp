// The periodic box in the course of time.
#pragma once
#include <petscvec.h>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "network/network.hpp"
#include "physics/whole/drive.hpp"
#include "systems/strain_response.hpp"

namespace bs {

/// c = v - L x of a particle with the state y = (x, v), which the flow L (d, d) carries along with the box.
inline void beside_flow(int d, const double* y, const double* L, double* c) {
  for (int r = 0; r < d; ++r) {
    c[r] = y[d + r];
    for (int q = 0; q < d; ++q) c[r] -= L[r * d + q] * y[q];
  }
}

/// The box is strained homogeneously as given: its edges are
///   e_k(t) = F(t) E_k,   F = I + G(t)
/// with E_k those of the lattice and G_ab(t) the components that -bs_box_strain and -bs_box_rate prescribe: G_xx the stretch along x, G_xy the
/// displacement along x per distance along y (simple shear). Those of -bs_box_stress are free: what bears the given stress is found by a task. An
/// image s of a particle at x with velocity v is at x + sum of s_k e_k and moves with v + sum of s_k e_k'.
class Cell {
 public:
  /// Collective. Reads -bs_box_strain, -bs_box_rate and -bs_box_stress. Errors (exit 2): a lattice without a periodic box, texts that are no
  /// motion, components that are given twice, or that change nothing.
  PetscErrorCode read(MPI_Comm comm, const Lattice& lattice);
  /// The images among the ghosts of `net`, which must outlive the object.
  void create(const Network& net);

  /// Whether there is a periodic box.
  bool active() const { return box_.active(); }
  /// "periodic" or "none" for each edge; empty without a box.
  std::vector<std::string> boundary() const;
  /// Whether the box changes in time.
  bool moving() const;
  /// Edges (d, d) and their rates of change at time t; `rates` may be null.
  void edges(double t, double* edges, double* rates) const;
  /// F' F^-1 (d, d), row-major: the velocity gradient of the flow that the box prescribes.
  void velocity_gradient(double t, double* L) const;
  /// Whether its edges are not along the axes, or are going to be.
  bool triclinic() const;
  /// F(t) and dF/dt, (d, d) each.
  void gradient(double t, double* F, double* rate) const;
  /// A = F(to) F(from)^-1 (d, d), by which the box carries along what is in it: free strains at `from` are those that keep_strains() found.
  void carried(double from, double to, double* A) const;
  /// The free strains are those of an accepted state.
  void keep_strains() {
    for (Free& one : free_) one.kept = one.strain;
  }
  /// The components that are free, with the stress given at time t; and their strains.
  std::vector<FreeStrain> free_strains(double t) const;
  void set_free_strains(const std::vector<double>& strains);
  /// Free strains by name, for a checkpoint, and back.
  void keep(const Keeper& keep);
  /// Volume (area, length) at time t.
  double volume(double t) const;
  /// Adds the displacement of their images at time t to ghosts' states, 2d numbers (x, v) each, n + ghosts of them; `sign` -1 takes it away. Their
  /// velocities are added where `velocities` says so.
  void shift_images(double t, double sign, bool velocities, double* states) const;
  /// In the state y of a start at time t free particles are where the box has carried them from where the lattice has them, x = F x0, with the
  /// velocity of its flow added to their own, v += F' F^-1 x.
  PetscErrorCode follow(double t, Vec y) const;
  /// For equilibria, whose time is a load factor: rates are 0 from now on; `full_load`: the box is as at t = 1.
  void set_static(bool at_rest, bool full_load) {
    at_rest_ = at_rest;
    full_load_ = full_load;
  }
  /// Adds what its strains follow.
  void list_drives(std::vector<Drive*>* all);
  /// Collective. Ends the run with exit code 2 where a table does not reach t_end.
  PetscErrorCode reaches(double t_end) const;
  /// There is drag against a fluid, by this name, which a box that flows has no place for.
  void set_drag(const std::string& title) { drag_ = title; }
  /// Whether a strain jumps or the box flows against drag, and what else it cannot do, from time `from` to time `to` (System::foresee).
  void find_jumps(double from, double to, Error* fault) const;
  void foresee(double from, double to, Error* fault) const;
  std::vector<std::string> describe() const;

 private:
  struct Component {
    int row, column;
    Drive drive;
  };
  struct Free {
    int row, column;
    Drive stress;  ///< over time [N/m^(d-1)]
    double strain;
    double kept = 0;  ///< strain of the last accepted state
  };
  PetscErrorCode read_components(MPI_Comm comm, const char* option, const std::string& text);
  PetscErrorCode read_component(MPI_Comm comm, const std::string& option, const std::string& name, const std::string& text);
  PetscErrorCode check_free(MPI_Comm comm) const;
  void find_drag(double t, Error* fault) const;
  double time_of(double t) const { return full_load_ ? 1.0 : t; }
  bool has(int row, int column) const;
  bool collapses(double from, double to) const;
  const Network* net_ = nullptr;
  int dim_ = 3;
  PeriodicBox box_;
  std::vector<Component> components_;
  std::vector<Free> free_;
  std::vector<PetscInt> images_;  ///< ghosts that are images, by local index
  bool at_rest_ = false, full_load_ = false;
  std::string drag_;
};

/// Collective. Reads a motion given by `option`, and the tables it names; `component` begins what is said of a text that is none ("xy: "). Errors
/// (exit 2): texts that are no motion in `dim` dimensions (Drive::parse), files that are not there or are no tables to follow.
PetscErrorCode read_drive(MPI_Comm comm, const std::string& option, const std::string& component, const std::string& text, int dim, bool placed,
                          Drive* drive);
/// Collective. Ends the run with exit code 2 where a table of the motion does not reach t_end.
PetscErrorCode check_reach(MPI_Comm comm, const std::string& option, const Drive& drive, double t_end, bool at_rest);

}  // namespace bs
