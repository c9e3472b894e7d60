// Particle systems M x'' = f(t, x, x') as a Model: state (x, v) interlaced by particle, block size 2d.
#pragma once
#include <memory>
#include "lattice/lattice.hpp"
#include "model/model.hpp"
#include "model/particles/condensed/particle_tangent.hpp"
#include "model/particles/coupling.hpp"
#include "model/particles/local_state.hpp"
#include "model/particles/particle_potential.hpp"
#include "model/particles/physics.hpp"
#include "model/particles/row_pattern.hpp"
#include "model/particles/spring_memory.hpp"
#include "model/particles/spring_strain.hpp"
#include "system/network.hpp"

namespace bs {

class ParticleModel final : public Model {
 public:
  /// Collective. Reads the laws' options, distributes the lattice and sets the loops up. The lattice's chunk is kept
  /// until constants() has been called.
  static PetscErrorCode create(MPI_Comm comm, Lattice&& lattice, std::unique_ptr<Model>* out);

  const char* name() const override { return "particles"; }
  int dim() const override { return net_.dim; }
  MPI_Comm comm() const override { return net_.comm; }
  Vec initial_state() const override { return y0_; }
  std::vector<std::string> describe() const override;
  PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) override;
  PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) override;
  PetscErrorCode rhs(double t, Vec y, Vec G) override;
  PetscErrorCode create_matrix(Mat* P) override;
  PetscErrorCode create_operator(Mat P, Form form, Mat* A) override;
  bool time_dependent() const override { return motion_.active(); }
  Tangent* tangent() override { return coupling_.active() ? nullptr : &tangent_; }
  Incremental* incremental() override { return &potential_; }
  PetscErrorCode create_shell(Mat* P) override;
  PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) override;
  PetscErrorCode velocity_errors(Vec y, Vec F, double sigma, Form form, double* worst, double* fastest) override;
  PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) override;
  PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) override;
  PetscErrorCode energy_supply(double t, Vec y, EnergySupply* out, bool* has) override;
  PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) override;
  PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) override;
  PetscErrorCode scatter_state(Vec y) override;
  PetscErrorCode accept(double t, Vec y) override;
  PetscErrorCode gather_memory(std::vector<StatePart>* parts) override;
  PetscErrorCode scatter_memory() override;
  PetscErrorCode fingerprint(std::uint64_t* value) override;
  PetscErrorCode constants(std::vector<Dataset>* out) override;
  PetscErrorCode covers(double t_end) override;
  PetscErrorCode last_fault(std::string* text) override;

 private:
  PetscErrorCode read_laws(const Lattice& lattice);
  PetscErrorCode check_laws() const;
  PetscErrorCode take_fingerprint(const Lattice& lattice);
  PetscErrorCode create_state();
  PetscErrorCode create_output();
  PetscErrorCode fill_output(Vec y);
  PetscErrorCode read_strain_option();
  std::string spring_laws_in_words() const;
  PetscErrorCode compute_forces(double t, Vec y);

  Network net_;
  Lattice lattice_;
  ParticleLaws laws_;
  Motion motion_;
  Coupling coupling_;
  RowPattern pattern_;
  LocalState state_;
  SpringStrain strain_;
  SpringMemory memory_;
  bool store_strain_ = false;
  std::unique_ptr<Physics> physics_;
  ParticleTangent tangent_;
  ParticlePotential potential_;
  std::vector<double> force_, rates_;
  std::vector<double> rounding_;  ///< (n) velocity errors that rounding of the forces stands for [m/s], of the last floor
  VecHandle y0_, position_, velocity_;       ///< the latter two in the input's order
  ScatterHandle to_position_, to_velocity_;
  Singularity fault_;
  std::uint64_t fingerprint_ = 0;            ///< of the lattice, summed over the ranks
};

}  // namespace bs
