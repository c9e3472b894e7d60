// A second-order system M x'' = f(t, x, v) as the first-order system of its state y = (x, v): the one place of F, J, G and sigma.
#pragma once
#include <memory>
#include <vector>
#include "base/handle.hpp"
#include "linalg/condensed/tangent.hpp"
#include "systems/mechanics.hpp"
#include "systems/model.hpp"

namespace bs {

/// J of the first-order form of a linearised second-order system, and what a condensed solve makes of it.
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
  /// Collective. The shell has a product with J^T while K and D are symmetric: PETSc asks where a line search has failed, and for trust regions.
  PetscErrorCode offer_transposed(Mat J);

  bool exact_symmetric() const override { return own_.exact_symmetric(); }
  bool pairwise() const override { return own_.pairwise(); }
  bool has_inertia() const override { return !static_; }
  double sigma() const override { return sigma_; }
  int dim() const override { return static_cast<int>(own_.layout().dim); }
  MPI_Comm comm() const override { return own_.comm(); }
  PetscInt unknowns() const override { return own_.unknowns(); }
  PetscErrorCode multiply(Vec z, Vec y) override;
  /// Collective. y = J^T z, where K and D are symmetric.
  PetscErrorCode multiply_transposed(Vec z, Vec y);
  PetscErrorCode stiffness_sizes(Vec s) override;
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
  PetscErrorCode choose_unknown(const std::vector<double>& a);
  double row_of_v(double m, double zx, double zv) const { return m * (static_ ? shift_ * zx : inertia_ * sigma_ * zv); }
  double scale(double m) const { return form_ == Form::momentum ? 1.0 : 1.0 / m; }
  Linearisation& own_;
  double sigma_ = 1, inertia_ = 1, shift_ = 0;
  double size_ = 0, speed_ = 0;  ///< largest sigma |x| and |v| of this rank at the state [m/s]
  bool static_ = false;
  bool by_velocity_ = false;  ///< the condensed unknown is z_v
  VecHandle places_;          ///< room
  Form form_ = Form::momentum;
  std::vector<double> force_;
};

class FirstOrder : public Model {
 public:
  explicit FirstOrder(std::unique_ptr<Mechanics> mechanics);

  Mechanics* mechanics() override { return own_.get(); }
  std::unique_ptr<Mechanics> take_mechanics() override { return std::move(own_); }
  PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) override;
  PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) override;
  void set_inertia(double ratio) override { tangent_.set_inertia(ratio); }
  PetscErrorCode rhs(double t, Vec y, Vec G) override;
  PetscErrorCode create_matrix(Mat* P) override;
  PetscErrorCode create_operator(Mat P, Form form, Mat* A) override { return own_->create_first_order_operator(P, form == Form::momentum, A); }
  PetscErrorCode create_shell(Mat* P) override;
  Tangent* tangent() override { return own_->couples_all() ? nullptr : &tangent_; }
  Incremental* incremental() override { return own_->potential(); }
  PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) override;
  PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) override;
  PetscErrorCode velocity_errors(Vec y, Vec F, double sigma, Form form, double* worst, double* fastest) override;

  // forwarded to the second-order system
  const char* name() const override { return own_->name(); }
  int dim() const override { return own_->dim(); }
  std::vector<std::string> boundary() const override { return own_->boundary(); }
  MPI_Comm comm() const override { return own_->comm(); }
  Vec initial_state() const override { return own_->initial_state(); }
  std::vector<std::string> describe() const override { return own_->describe(); }
  bool time_dependent() const override { return own_->time_dependent(); }
  Knot next_knot(double from, double to) override { return own_->next_knot(from, to); }
  void set_sides(const Sides& sides) override { own_->set_sides(sides); }
  std::vector<Tally> tallies() const override { return own_->tallies(); }
  Breaks* breaks() override { return own_->breaks(); }
  bool begins_steps() const override { return own_->begins_steps(); }
  PetscErrorCode begin_step(const Step& step, Vec y) override { return own_->begin_step(step, y); }
  PetscErrorCode accept(const Step& step, Vec y) override { return own_->accept(step, y); }
  PetscErrorCode gather_memory(std::vector<StatePart>* parts) override { return own_->gather_memory(parts); }
  PetscErrorCode scatter_memory() override { return own_->scatter_memory(); }
  bool remembers() const override { return own_->remembers(); }
  void keep_sums(const Keeper& keep) override { own_->keep_sums(keep); }
  PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) override { return own_->observe(t, y, out); }
  PetscErrorCode energy_supply(double t, Vec y, EnergySupply* out, bool* has) override { return own_->energy_supply(t, y, out, has); }
  PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) override { return own_->fields(t, y, out); }
  PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) override { return own_->gather_state(y, parts); }
  PetscErrorCode scatter_state(Vec y) override { return own_->scatter_state(y); }
  PetscErrorCode fingerprint(std::uint64_t* value) override { return own_->fingerprint(value); }
  PetscErrorCode take_constants(std::vector<Dataset>* out) override { return own_->take_constants(out); }
  void release_input() override { own_->release_input(); }
  PetscErrorCode prepare(const Plan& plan) override { return own_->prepare(plan); }
  PetscErrorCode covers(double t_start, double t_end) override { return own_->covers(t_start, t_end); }
  PetscErrorCode foresee(double from, double to, std::string* fault) override { return own_->foresee(from, to, fault); }
  PetscErrorCode last_fault(std::string* text) override { return own_->last_fault(text); }

 protected:
  std::unique_ptr<Mechanics> own_;
  FirstOrderTangent tangent_;

 private:
  PetscErrorCode add_inertia(double sigma, Form form, Mat P);
  VecHandle diagonal_;            ///< room
  std::vector<double> rounding_;  ///< (n) velocity errors that rounding of the forces stands for [m/s], of the last floor
};

}  // namespace bs
