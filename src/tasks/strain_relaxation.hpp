// How a periodic lattice in equilibrium answers homogeneous strains, all particles relaxed.
#pragma once
#include <petscts.h>
#include <functional>
#include <vector>
#include "systems/equilibrium.hpp"
#include "tasks/tangent_solve.hpp"

namespace bs {

/// For the strains x -> (I + e) x of StrainResponse, about the equilibrium at hand with its stresses:
///   C_ab = (d2 E/(d e_a d e_b) - X_a.(-K)^-1 X_b)/V,   X_a = df/d e_a at particles that follow the strain, K = df/dx
class StrainRelaxation {
 public:
  /// Collective. At the equilibrium y of time t, by the linear solver of `ts` with the matrix J, which is given back as it was; where that leaves
  /// more than GOOD, by factors of MUMPS, then and from then on. Floppy parts make K singular: no strain loads their motions.
  PetscErrorCode find(TS ts, Mat J, Equilibrium& model, double t, Vec y);
  /// Collective. The same of the strains that `choose` names alone, the stiffness among these to about 1e-10; what is of the others is not to be
  /// used.
  using Choose = std::function<std::vector<bool>(const StrainResponse&)>;
  PetscErrorCode estimate(TS ts, Mat J, Equilibrium& model, double t, Vec y, const Choose& choose);
  /// The linear solver of the run is tried again: a run and its continuation then do the same.
  void renew() { direct_ = false; }
  const StrainResponse& strained() const { return strained_; }
  /// (q, q) row by row [N/m^(d-1)].
  const std::vector<double>& stiffness() const { return stiffness_; }
  static constexpr double GOOD = 1e-9, ROUGH = 1e-3;
  /// Largest part of the forces of a strain that is left, of what the springs add up to; NaN: the linear solver failed.
  double left() const { return left_; }
  /// Where left() is too much: whether that is for want of memory.
  const MemoryLack& memory_lack() const { return lack_; }
  /// u_a = (-K)^-1 X_a, laid out as a state: what particles move per unit of strain a beyond following it.
  Vec moved(int a) const { return moved_[static_cast<std::size_t>(a)]; }

 private:
  PetscErrorCode relax(TS ts, Mat J, Equilibrium& model, double t, Vec y);
  PetscErrorCode set_load(std::size_t a, Vec load) const;
  PetscErrorCode reduce(MPI_Comm comm);
  void keep_residual(std::size_t a, Vec r);

  Layout layout_;
  StrainResponse strained_;
  std::vector<double> stiffness_;
  std::vector<VecHandle> moved_;
  std::vector<std::vector<double>> residual_;  ///< X_a + K u_a, (n, d) each; empty: 0
  std::vector<bool> wanted_;                   ///< strains; empty: all, as well as rounding lets
  double left_ = 0;
  MemoryLack lack_;
  bool direct_ = false;  ///< the linear solver of the run has failed
};

// How the stress of a relaxed periodic lattice changes with the free components of its box.

/// L = dF F^-1 of a unit change of F's component (row, column), (d, d) row by row.
void flow_of(const FreeStrain& one, const double* gradient, int d, double* L);

/// Whether energy is needed for every small change of the free strains under their stresses (stable), for none (neutral), or set free by one.
enum class BoxState { stable, neutral, unstable };

/// With the stress sigma and the relaxed stiffness C, a change dF of the box, L = dF F^-1 = e + w (symmetric and antisymmetric), gives
///   d sigma = C:e + (sigma e + e sigma)/2 - tr(e) sigma + w sigma - sigma w
/// matrix: (n, n) row by row, d sigma of the component of free strain a per change of free strain b. The state is by the signs of L_a:d sigma_b.
BoxState box_tangent(const StrainRelaxation& relaxed, const std::vector<FreeStrain>& free, int d, std::vector<double>* matrix);

/// The strains of StrainResponse that `free` have a part in, at the gradient of the box.
std::vector<bool> strains_of(const std::vector<FreeStrain>& free, const double* gradient, int d);

/// x solves A x = b; false where A is singular.
bool solve_small(const std::vector<double>& A, std::vector<double> b, std::vector<double>* x);

}  // namespace bs
