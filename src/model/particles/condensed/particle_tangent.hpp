// The tangent of a particle system: S in the storage asked for, and products with J without a matrix.
#pragma once
#include <vector>
#include "model/model.hpp"
#include "model/particles/condensed/spring_matrix.hpp"
#include "model/particles/physics.hpp"
#include "model/tangent.hpp"

namespace bs {

class ParticleTangent final : public Tangent {
 public:
  /// Collective. The arguments must outlive the object; `exact`: nothing but particle laws and springs acts.
  PetscErrorCode create(const Network& net, const Physics& physics, RowPattern& pattern, Vec layout, bool coupled);
  /// Collective. Linearises at y (a state vector) and remembers it.
  PetscErrorCode linearise(double t, Vec y, double sigma, Form form);
  /// The state linearised at.
  const LocalState& state() const { return state_; }
  /// Collective. A MATSHELL that multiplies by J.
  PetscErrorCode create_shell(Mat* J);

  bool exact_symmetric() const override { return !coupled_ && !axial_damping_ && !net_->softens; }
  double sigma() const override { return sigma_; }
  int dim() const override { return net_->dim; }
  MPI_Comm comm() const override { return net_->comm; }
  PetscInt unknowns() const override { return net_->total * net_->dim; }
  PetscErrorCode multiply(Vec z, Vec y) override;
  PetscErrorCode condense(Vec r, Vec b) override;
  PetscErrorCode expand(Vec r, Vec w, Vec z) override;
  PetscErrorCode create(CondensedStorage storage, Mat* S) override;
  PetscErrorCode assemble(bool positive, Mat S) override;
  PetscErrorCode multiply_condensed(Vec w, Vec y) override;

 private:
  PetscErrorCode set_rigid_modes(Mat S) const;
  const Network* net_ = nullptr;
  const Physics* physics_ = nullptr;
  RowPattern* pattern_ = nullptr;
  Vec layout_ = nullptr;
  bool coupled_ = false, damped_ = false, axial_damping_ = false;
  double t_ = 0, sigma_ = 1;
  Form form_ = Form::momentum;
  LocalState state_, direction_;
  std::vector<double> force_;
  VecHandle both_;                ///< (w/sigma, w) of multiply_condensed
  std::vector<std::unique_ptr<SpringMatrix>> matrices_;   ///< behind the shells handed out
};

}  // namespace bs
