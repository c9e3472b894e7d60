// Linear time-invariant systems G x + C x' = B u(t) as a Model; C may be singular.
#pragma once
#include <array>
#include <memory>
#include "systems/linear/system.hpp"
#include "systems/model.hpp"

namespace bs {

class LinearModel final : public Model {
 public:
  /// Collective. Reads options and system; ends the run with exit code 2 if they do not fit together.
  static PetscErrorCode create(MPI_Comm comm, std::unique_ptr<Model>* out);

  const char* name() const override { return "linear"; }
  MPI_Comm comm() const override { return comm_; }
  Vec initial_state() const override { return system_.x0; }
  std::vector<std::string> describe() const override;
  bool linear() const override { return true; }
  bool time_dependent() const override { return !sources_.constant(); }
  Knot next_knot(double from, double) override { return sources_.next_knot(from); }
  void set_sides(const Sides& sides) override { sides_ = sides; }
  PetscErrorCode prepare(const Plan& plan) override;
  std::int64_t startup_steps() const override { return startup_steps_; }
  PetscErrorCode check_solver(KSP ksp) override;
  std::vector<Tally> tallies() const override;
  /// Momentum: F = C x' + G x - B u. Velocity (C diagonal): F = x' + C^-1 (G x - B u).
  PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) override;
  /// sigma C + G, or sigma + C^-1 G; a sigma that differs by less than 1e-12 from the one before is that one, and `P` left as it is.
  PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) override;
  PetscErrorCode rhs(double t, Vec y, Vec G) override;
  PetscErrorCode create_matrix(Mat* P) override;
  PetscErrorCode create_operator(Mat P, Form form, Mat* A) override;
  PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) override;
  PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) override;
  PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) override;
  PetscErrorCode energy_supply(double t, Vec y, EnergySupply* out, bool* has) override;
  PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) override;
  PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) override;
  PetscErrorCode scatter_state(Vec y) override { return VecCopy(work_, y); }
  PetscErrorCode fingerprint(std::uint64_t* value) override;
  PetscErrorCode take_constants(std::vector<Dataset>* out) override;
  PetscErrorCode covers(double t_start, double t_end) override;
  void keep_sums(const Keeper& keep) override;
  PetscErrorCode last_fault(std::string* text) override;
  PetscErrorCode mark_differential(Vec* marks) override;
  PetscErrorCode advice(double t, std::string* text) override;

 private:
  /// What a matrix was last filled with.
  struct Filling {
    PetscObjectId id;
    PetscObjectState state;
    double sigma;
  };

  PetscErrorCode read(MPI_Comm comm);
  PetscErrorCode inspect_C();
  PetscErrorCode create_start_solver(Mat A, const std::string& fault, KSP* ksp);
  PetscErrorCode warn_of_jump();
  PetscErrorCode operating_point();
  PetscErrorCode start_from_conditions();
  PetscErrorCode check_start(Vec z);
  PetscErrorCode warn_inconsistent(const Plan& plan);
  PetscErrorCode warn_index();
  PetscErrorCode warn_unstable(const Plan& plan);
  PetscErrorCode require_solver(KSP ksp, const char* prefix);
  PetscErrorCode invert_C(const Plan& plan);
  PetscErrorCode apply_inverse_C(Vec x);
  PetscErrorCode set_sources(double t);
  PetscErrorCode add_sources(double t, double scale, Vec F);

  MPI_Comm comm_ = MPI_COMM_NULL;
  LinearSystem system_;
  Sources sources_;
  std::array<double, 4> sigmas_ = {};  ///< of the first matrices: what they were last filled with, in this run or before its checkpoint
  double start_ = 0, norm_G_ = 0, norm_C_ = 0;
  bool dc_ = false, conditions_ = false, diagonal_ = false, symmetric_ = false;
  NullSpaces of_C_;  ///< as long as the system is being looked at
  std::int64_t startup_steps_ = 0, fillings_ = 0, zero_rows_ = 0;
  VecHandle u_, Bu_, work_, diagonal_C_;
  KSPHandle C_solver_;
  std::vector<Filling> filled_;
  std::string type_;       ///< of the TS
  Sides sides_;            ///< of the sources
  bool may_grow_ = false;  ///< whether steps of it can make energy
};

}  // namespace bs
