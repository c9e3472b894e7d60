// Forces that tie every particle to the whole system or to one moving centre: XSpringies' forces 1 and 2.
#pragma once
#include <cstdint>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "network/network.hpp"
#include "physics/body/law.hpp"
#include "physics/body/xsp_forces.hpp"
#include "physics/whole/xsp_center_of_mass.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// With X, V the mean position and velocity of the selected particles (free, not the centre) weighted by mass, S their
/// mass and C the centre (a particle or a point):
///   centre of mass   f_i = -m_i (value (X - C) + damping V) / S   for every selected i
///   attraction       f_i = m_i value |C - x_i|^-p toward C, where C is a particle (a fixed point is a particle law)
/// Small systems get the exact dense coupling in the matrix; large ones a low-rank operator beside the sparse matrix.
class Coupling final : public Term {
 public:
  /// Collective. Reads the options; asks the network for the links the matrix needs.
  PetscErrorCode read_options(MPI_Comm comm, const Lattice& lattice, NetworkOptions* network);
  /// Collective. `net` and `pattern` must outlive the object.
  PetscErrorCode create(const Network& net, const RowPattern& pattern);
  /// Collective. Means and centre of the gathered state.
  PetscErrorCode gather(const LocalState& state) override;
  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override;
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override;
  void energies(double t, const LocalState& state, Energies* sum) const override;
  void supply(double t, const LocalState& state, Supply* sum) const override;
  void add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const override;
  bool depends_on_place() const override { return true; }
  std::string lacks_potential() const override { return "a force that couples all particles"; }
  bool active() const { return mass_.active() || attracts(); }
  /// The centre is a particle: the law of attraction to a point must not act, too.
  bool has_center_particle() const { return center_row_ >= 0; }
  std::string describe() const;
  /// Collective. P itself, or P + U W^T where the centre-of-mass force is too large to assemble.
  PetscErrorCode create_operator(const Network& net, Mat P, bool momentum, Mat* A) const;

 private:
  template <int d>
  Point<d> point(PetscInt i, double t, const LocalState& state) const {
    return {t, net_->mass[i], net_->columns(i), state.at(i), state.at(i) + d};
  }
  template <int d>
  void add_force(PetscInt i, const Point<d>& p, double* f) const noexcept {
    if (selected(i)) {
      double a[d] = {};
      mass_.acceleration<d>(X_, V_, C_, S_, a);
      for (int c = 0; c < d; ++c) f[c] += p.m * a[c];
    }
    if (attracts() && i != center_) XspAttraction::attraction_force<d>(p.m, pull_.value, pull_.exponent, p.x, C_, f);
  }
  /// As if the centre was at rest. That of the centre of mass is the particles' by their masses.
  template <int d>
  double energy(PetscInt i, const Point<d>& p) const noexcept {
    double E = 0;
    if (selected(i)) E += p.m / S_ * mass_.energy<d>(X_, C_);
    if (attracts() && i != center_) E += XspAttraction::attraction_energy<d>(p.m, pull_.value, pull_.exponent, p.x, C_);
    return E;
  }
  /// Adds df_i/dx_i and df_i/dv_i.
  template <int d>
  void add_self(PetscInt i, const Point<d>& p, double* K, double* D) const noexcept {
    if (dense_ && selected(i)) add_mean<d>(i, p, K, D);
    if (attracts() && i != center_) XspAttraction::attraction_dfdx<d>(p.m, pull_.value, pull_.exponent, p.x, C_, K);
  }
  /// Adds df_i/dx_j and df_i/dv_j of particle i at `p` for a local particle j linked by a coupling.
  template <int d>
  void add_cross(PetscInt i, PetscInt j, const Point<d>& p, double* K, double* D) const noexcept {
    if (dense_ && selected(i)) {
      if (selected(j)) add_mean<d>(j, p, K, D);
      if (j == center_)
        for (int c = 0; c < d; ++c) K[c * d + c] += p.m * mass_.value / S_;
    }
    if (attracts() && j == center_) {
      double toward[d * d] = {};
      XspAttraction::attraction_dfdx<d>(p.m, pull_.value, pull_.exponent, p.x, C_, toward);
      for (int k = 0; k < d * d; ++k) K[k] -= toward[k];
    }
  }
  bool attracts() const { return center_row_ >= 0 && pull_.value != 0; }
  bool selected(PetscInt i) const noexcept { return mass_.active() && selected_[i]; }
  template <int d>
  void add_mean(PetscInt j, const Point<d>& p, double* K, double* D) const noexcept {
    const double share = p.m * net_->mass[j] / (S_ * S_);
    for (int c = 0; c < d; ++c) {
      K[c * d + c] -= share * mass_.value;
      D[c * d + c] -= share * mass_.damping;
    }
  }

  XspCenterOfMass mass_;
  XspAttraction pull_;
  std::int64_t center_row_ = -1, dense_max_ = 400;
  PetscInt center_ = -1;  ///< local index of the centre, -1: not here
  bool dense_ = true;
  const Network* net_ = nullptr;
  const RowPattern* pattern_ = nullptr;
  std::vector<PetscInt> rows_[2];       ///< owned particles of either Part that are not fixed
  std::vector<std::uint8_t> selected_;  ///< (n + ghosts)
  double S_ = 1, X_[3] = {0, 0, 0}, V_[3] = {0, 0, 0}, C_[3] = {0, 0, 0};
};

}  // namespace bs
