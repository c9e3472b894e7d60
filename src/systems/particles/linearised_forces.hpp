// The forces of a particle system linearised at one state: a M - b D - c K in the storage asked for, and products without a
// matrix.
#pragma once
#include <memory>
#include <vector>
#include "linalg/pair_matrix.hpp"
#include "network/network.hpp"
#include "systems/mechanics.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

class LinearisedForces final : public Linearisation {
 public:
  /// Collective. The arguments must outlive the object; `coupled`: some force couples all particles.
  PetscErrorCode create(const Network& net, const Terms& terms, RowPattern& pattern, Vec layout, bool coupled);
  /// The state linearised at, and its time.
  const LocalState& state() const { return state_; }
  double time() const { return t_; }

  MPI_Comm comm() const override { return net_->comm; }
  const Layout& layout() const override { return at_; }
  Vec state_vector() const override { return vector_; }
  PetscInt unknowns() const override { return net_->total * net_->dim; }
  const std::vector<double>& masses() const override { return net_->inertia; }
  std::vector<double> positions() const override;
  bool moves(PetscInt i, PetscInt c) const override;
  PetscErrorCode linearise(double t, Vec y) override;
  PetscErrorCode change_of_force(Vec z, double* f) override;
  PetscErrorCode predict_tensions(Vec z, double turn, double* part) override;
  void forget_tensions() override { state_.set_tensions(nullptr); }
  PetscErrorCode damping_force(const double* w, double* f) override;
  bool damps() const override { return damped_; }
  double damping_rate() const override;
  void stiffness_sizes(double* size) override {
    for (const Term* term : *terms_) term->stiffness_sizes(t_, state_, size);
  }
  bool complete() const override { return terms_->complete(); }
  bool symmetric_at_rest() const override { return !coupled_ && terms_->symmetric(); }
  bool exact_symmetric() const override { return !coupled_ && !axial_damping_ && !net_->softens && terms_->symmetric(); }
  bool pairwise() const override { return net_->interactions.empty(); }
  PetscErrorCode create(CondensedStorage storage, Mat* S) override;
  PetscErrorCode factor_flops(double* flops) override;
  PetscErrorCode set_rigid_modes(Mat S) override;
  PetscErrorCode assemble(const Coefficients& abc, bool positive, Mat S) override;

 private:
  const Network* net_ = nullptr;
  const Terms* terms_ = nullptr;
  RowPattern* pattern_ = nullptr;
  Layout at_;
  Vec vector_ = nullptr;
  bool coupled_ = false, damped_ = false, axial_damping_ = false;
  double flops_ = -1;        ///< of a factorisation; negative: not counted yet
  bool linearised_ = false;  ///< state_ has been given
  double t_ = 0;
  LocalState state_, direction_;
  std::vector<double> tensions_, next_tensions_;       ///< of links, predicted
  VecHandle only_velocity_;                            ///< (0, w) of damping_force
  std::vector<std::unique_ptr<PairMatrix>> matrices_;  ///< behind the shells handed out
};

// A network as linear algebra sees it.

/// Refers to arrays of the network, with what holds its particles as it is now.
Graph graph_of(const Network& net);

/// Which pairs of free particles springs link.
PairPattern pairs_of(const Network& net);

/// Global indices of both ends of every coupling between free particles, as seen from owned ones: springs and interactions.
std::vector<PetscInt> coupled_ends(const Network& net);

}  // namespace bs
