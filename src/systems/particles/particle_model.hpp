// Particle systems as second-order systems M x'' = f(t, x, v): what is read, what acts, what is shown.
#pragma once
#include <memory>
#include "lattice/lattice.hpp"
#include "network/network.hpp"
#include "systems/mechanics.hpp"
#include "systems/particles/callback_forces.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/constraints/free_bodies.hpp"
#include "systems/particles/constraints/reactions.hpp"
#include "systems/particles/coupling.hpp"
#include "systems/particles/input_order.hpp"
#include "systems/particles/linearised_forces.hpp"
#include "systems/particles/local_state.hpp"
#include "systems/particles/nodal_forces.hpp"
#include "systems/particles/particle_stress.hpp"
#include "systems/particles/row_pattern.hpp"
#include "systems/particles/spring_fields.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

class ParticleModel final : public Mechanics {
 public:
  /// Collective. Reads the laws' options, distributes the lattice and sets the loops up. The lattice's chunk is kept
  /// until release_input() is called.
  static PetscErrorCode create(MPI_Comm comm, Lattice&& lattice, std::unique_ptr<Mechanics>* out);

  const char* name() const override { return "particles"; }
  int dim() const override { return net_.dim; }
  std::vector<std::string> boundary() const override { return constraints_.box().boundary(); }
  MPI_Comm comm() const override { return net_.comm; }
  Vec initial_state() const override { return y0_; }
  std::vector<std::string> describe() const override;
  const Layout& layout() const override { return layout_; }
  const std::vector<double>& masses() const override { return net_.inertia; }
  std::vector<ParticleGroup> groups() const override;
  PetscErrorCode force(double t, Vec y, const double** f) override;
  PetscErrorCode force_magnitudes(double t, Vec y, double sigma, double* size) override;
  PetscErrorCode force_sizes(double t, Vec y, std::vector<double>* inner, std::vector<double>* outer) override;
  Linearisation& linearisation() override { return linearised_; }
  bool couples_all() const override { return coupling_.active(); }
  Incremental* potential() override { return &potential_; }
  PetscErrorCode create_first_order(Mat* J) override;
  PetscErrorCode assemble_first_order(double sigma, bool momentum, Mat J) override;
  PetscErrorCode create_first_order_operator(Mat J, bool momentum, Mat* A) override { return coupling_.create_operator(net_, J, momentum, A); }
  bool flows() const override { return constraints_.box().moving(); }
  PetscErrorCode follow_box(double t, Vec y) override { return constraints_.box().follow(t, y); }
  PetscErrorCode strain_response(double t, Vec y, StrainResponse* out) override;
  std::vector<FreeStrain> free_strains(double t) const override { return constraints_.box().free_strains(t); }
  void set_free_strains(const std::vector<double>& strains) override { constraints_.box().set_free_strains(strains); }
  bool time_dependent() const override;
  PetscErrorCode lacks_pattern(const std::string& name, const std::vector<double>& all, bool* yes) override;
  PetscErrorCode set_numbers(const std::string& name, const std::vector<double>& all) override;
  PetscErrorCode numbers(const std::string& name, std::vector<double>* all) override;
  PetscErrorCode force_changes(const std::string& name, double t, Vec y, Vec lambda, std::vector<double>* rows) override;
  std::string why_not_by_rows() const override;
  PetscErrorCode place_held(double t, Vec y) override;
  PetscErrorCode give_motion(const std::string& group, double from, double to, Vec places) override {
    return constraints_.give(group, from, to, places);
  }
  bool forced_outside() const override { return callback_.active(); }
  bool relaxes() const override { return net_.relaxes; }
  std::vector<GivenMotion> given_motions() const override { return constraints_.given_motions(); }
  std::string given_motion() const override { return constraints_.given(); }
  PetscErrorCode reactions(double t, Vec y, std::vector<double>* out) override;
  void set_loads(const Loads& loads) override;
  PetscErrorCode count_free_bodies(PetscInt* free) override;
  PetscErrorCode return_free_bodies(double t_from, Vec from, double t_to, double h, Vec to) override;
  Breaks* breaks() override { return terms_->breaking().active() ? &terms_->breaking() : nullptr; }
  std::vector<Tally> tallies() const override;
  void keep_sums(const Keeper& keep) override;
  PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) override;
  PetscErrorCode energy_supply(double t, Vec y, EnergySupply* out, bool* has) override;
  PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) override;
  PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) override;
  PetscErrorCode scatter_state(Vec y) override { return order_.to_state(y); }
  bool begins_steps() const override;
  PetscErrorCode begin_step(const Step& step, Vec y) override;
  PetscErrorCode accept(const Step& step, Vec y) override;
  PetscErrorCode begin_at(double t, Vec y) override;
  PetscErrorCode gather_memory(std::vector<StatePart>* parts) override { return terms_->gather_history(parts); }
  PetscErrorCode scatter_memory() override { return terms_->recall(); }
  bool remembers() const override { return terms_->remembers(); }
  Knot next_knot(double from, double to) override;
  void set_sides(const Sides& sides) override;
  PetscErrorCode fingerprint(std::uint64_t* value) override;
  PetscErrorCode take_constants(std::vector<Dataset>* out) override;
  void release_input() override;
  PetscErrorCode covers(double t_start, double t_end) override;
  PetscErrorCode foresee(double from, double to, std::string* text) override;
  PetscErrorCode last_fault(std::string* text) override;

 private:
  PetscErrorCode read_laws(const Lattice& lattice);
  PetscErrorCode find_fluid(DisplacedFluid* fluid) const;
  void add_mass();
  PetscErrorCode check_laws() const;
  PetscErrorCode take_fingerprint(const Lattice& lattice, const std::vector<std::uint8_t>& fixed);
  void find_roomless();
  PetscErrorCode note_numbers(const std::string& name, const std::vector<double>& all);
  PetscErrorCode create_state();
  PetscErrorCode commit_start();
  PetscErrorCode commit(Step step);
  PetscErrorCode observe_box(double t, std::vector<Observable>* out);
  std::vector<std::int64_t> drawn_pairs() const;
  PetscErrorCode add_drawn(const std::string& bonds, std::vector<Dataset>* out);
  PetscErrorCode keep_drawn();
  PetscErrorCode draw_broken(Vec broken);
  PetscErrorCode make_order();
  PetscErrorCode fill_output(Vec y);
  std::string spring_laws_in_words() const;
  /// All that is given over time.
  std::vector<Drive*> drives();
  bool knows_interior(double t) const;
  void note_interior(double t, const Singularity& fault);
  /// Collective. What every evaluation of the terms needs of the state: ghosts, and sums over all particles.
  PetscErrorCode gather(double t, Vec y);
  const Energies& energies_at(double t, Vec y);

  Network net_;
  Lattice lattice_;
  ParticleLaws laws_;
  Constraints constraints_;
  Coupling coupling_;
  NodalForces forces_;
  CallbackForces callback_;
  RowPattern pattern_;
  Layout layout_;
  LocalState state_;
  SpringFields springs_;
  ParticleStress stress_;
  bool loads_ = false;  ///< the evaluations that follow are of statics, whose time is the load factor
  FreeBodies free_bodies_;
  std::unique_ptr<Terms> terms_;
  Reactions reactions_;
  LinearisedForces linearised_;
  ParticlePotential potential_;
  std::vector<double> force_, rates_;
  std::vector<PetscInt> roomless_;  ///< links without blocks in matrices
  VecHandle y0_;
  VecHandle drawn_;  ///< ends of springs that can break, in the input's order, as they are drawn
  InputOrder order_;
  Singularity fault_;
  struct {
    PetscObjectId vec = 0;
    PetscObjectState state = 0;
    std::uint64_t terms = 0;
    double time = 0;
    Energies energies;
  } known_;  ///< this rank's energies of the state they were computed for last
  struct {
    bool known = false;
    std::uint64_t state = 0, terms = 0;  ///< versions of these
    double time = 0;
  } interior_;                     ///< the state for which force_ holds the forces on particles that no ghost acts on
  bool summed_ = false;            ///< they came with energies, and were not asked for since
  int wasted_ = 0;                 ///< times in a row that they were not asked for
  std::uint64_t fingerprint_ = 0;  ///< of the lattice, summed over the ranks
};

}  // namespace bs
