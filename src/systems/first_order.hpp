// A second-order system M x'' = f(t, x, v) as the first-order system of its state y = (x, v): the one place of F, J, G and sigma.
#pragma once
#include <memory>
#include <vector>
#include "base/handle.hpp"
#include "systems/first_order_tangent.hpp"
#include "systems/mechanics.hpp"
#include "systems/model.hpp"

namespace bs {

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
  PetscErrorCode create_operator(Mat P, Form form, Mat* A) override;
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
  std::vector<Tally> tallies() const override { return own_->tallies(); }
  Breaks* breaks() override { return own_->breaks(); }
  PetscErrorCode accept(double t, Vec y) override { return own_->accept(t, y); }
  PetscErrorCode gather_memory(std::vector<StatePart>* parts) override { return own_->gather_memory(parts); }
  PetscErrorCode scatter_memory() override { return own_->scatter_memory(); }
  void save_sums(std::map<std::string, double>* sums) const override { own_->save_sums(sums); }
  void restore_sums(const std::map<std::string, double>& sums) override { own_->restore_sums(sums); }
  PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) override { return own_->observe(t, y, out); }
  PetscErrorCode energy_supply(double t, Vec y, EnergySupply* out, bool* has) override { return own_->energy_supply(t, y, out, has); }
  PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) override { return own_->fields(t, y, out); }
  PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) override { return own_->gather_state(y, parts); }
  PetscErrorCode scatter_state(Vec y) override { return own_->scatter_state(y); }
  PetscErrorCode fingerprint(std::uint64_t* value) override { return own_->fingerprint(value); }
  PetscErrorCode take_constants(std::vector<Dataset>* out) override { return own_->take_constants(out); }
  void release_input() override { own_->release_input(); }
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
