// J of the first-order form of a linearised second-order system, and what a condensed solve makes of it.
#pragma once
#include <vector>
#include "systems/mechanics.hpp"
#include "systems/model.hpp"
#include "systems/tangent.hpp"

namespace bs {

class FirstOrderTangent final : public Tangent {
 public:
  /// `linearised` must outlive the object.
  explicit FirstOrderTangent(Linearisation& linearised) : own_(linearised) {}
  /// Collective. Linearises at y (a state vector) and remembers it.
  PetscErrorCode linearise(double t, Vec y, double sigma, Form form);
  /// mu/sigma, where the rows of v have mu M in the place of sigma M (alpha2).
  void set_inertia(double ratio) { inertia_ = ratio; }
  double inertia() const { return inertia_; }
  /// Of an equilibrium: the rows of v are (shift M - K) z_x, without inertia and damping; shift >= 0 [1/s^2] regularises what no spring
  /// holds.
  void set_static(double shift) {
    static_ = true;
    shift_ = shift;
  }
  void set_dynamic() { static_ = false; }
  /// Collective. A MATSHELL that multiplies by J.
  PetscErrorCode create_shell(Mat* J);

  bool exact_symmetric() const override { return own_.exact_symmetric(); }
  bool pairwise() const override { return own_.pairwise(); }
  bool has_inertia() const override { return !static_; }
  double sigma() const override { return sigma_; }
  int dim() const override { return static_cast<int>(own_.layout().dim); }
  MPI_Comm comm() const override { return own_.comm(); }
  PetscInt unknowns() const override { return own_.unknowns(); }
  PetscErrorCode multiply(Vec z, Vec y) override;
  PetscErrorCode condense(Vec r, Vec b) override;
  PetscErrorCode expand(Vec r, Vec w, Vec z) override;
  PetscErrorCode create(CondensedStorage storage, Mat* S) override { return own_.create(storage, S); }
  PetscErrorCode factor_flops(double* flops) override { return own_.factor_flops(flops); }
  PetscErrorCode set_rigid_modes(Mat S) override { return own_.set_rigid_modes(S); }
  PetscErrorCode assemble(bool positive, Mat S) override { return own_.assemble(coefficients(), positive, S); }
  PetscErrorCode multiply_condensed(Vec w, Vec y) override { return own_.multiply(coefficients(), w, y); }

 private:
  /// S = mu M - D - K/sigma, or (shift M - K)/sigma
  Coefficients coefficients() const {
    return static_ ? Coefficients{shift_ / sigma_, 0, 1 / sigma_} : Coefficients{inertia_ * sigma_, 1, 1 / sigma_};
  }
  PetscErrorCode change_of_force(Vec z);
  PetscErrorCode damp(const std::vector<double>& a, std::vector<double>* damping);
  double row_of_v(double m, double zx, double zv) const { return m * (static_ ? shift_ * zx : inertia_ * sigma_ * zv); }
  Linearisation& own_;
  double sigma_ = 1, inertia_ = 1, shift_ = 0;
  double size_ = 0, speed_ = 0;  ///< largest sigma |x| and |v| of this rank at the state [m/s]
  bool static_ = false;
  VecHandle places_;  ///< room
  Form form_ = Form::momentum;
  std::vector<double> force_;
};

}  // namespace bs
