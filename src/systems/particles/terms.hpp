// All forces on particles: the list of terms, in the order in which they are summed.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>
#include "systems/incremental.hpp"
#include "systems/particles/breaking/breaking.hpp"
#include "systems/particles/physics.hpp"

namespace bs {

class Coupling;

/// Springs and the laws of single particles come first and start every sum; then the coupling of all particles, interactions with several ends, and
/// any term added later. A loop over the list must keep this order: springs overwrite arrays over particles, the other terms add to them. Terms
/// itself has functions only for what needs more than such a loop, or is used in many places.
class Terms {
 public:
  /// The arguments must outlive the object; `coupling`: null where no force couples all particles.
  Terms(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern, Coupling* coupling = nullptr);
  /// Appends a term; it must outlive the object.
  void add(Term& term) { terms_.push_back(&term); }
  auto begin() const { return terms_.begin(); }
  auto end() const { return terms_.end(); }
  const PairForces& pairs() const { return *pairs_; }
  /// Collective. Sets up the histories of the terms added so far, and which of their parts may break. `net` is the network given at creation,
  /// `lattice` the lattice it was made of, whose chunk must still be in memory.
  PetscErrorCode remember(Network& net, const Lattice& lattice, const BreakRules& rules);
  const BreakRules& break_rules() const { return rules_; }
  Breaking& breaking() { return breaking_; }
  const Breaking& breaking() const { return breaking_; }
  bool remembers() const;
  /// Changes whenever forces and energies at the same state and time may have become others: by histories, by what broke, by numbers.
  std::uint64_t version() const { return version_ + breaking_.changes(); }
  /// Numbers of springs, particles or interactions are others from now on.
  void renew() { ++version_; }
  /// Collective. Term::begin_step and Term::accept of all.
  PetscErrorCode begin_step(const Step& step, const LocalState& state);
  PetscErrorCode accept(const Step& step, const LocalState& state);
  /// Collective. The histories and the list of broken parts, for a checkpoint; recall() takes them over after they were read.
  PetscErrorCode gather_history(std::vector<StatePart>* parts);
  PetscErrorCode recall();
  /// Collective. The histories as fields of a frame, and for each kind that may break a flag for every part.
  PetscErrorCode history_fields(std::vector<Field>* out);
  void keep(const Keeper& keep);
  /// Collective. Energy dissipated by parts that are whole, by those that broke, and before numbers were changed [J].
  PetscErrorCode dissipated(double* energy) const;
  /// Collective. To be called after numbers have changed: keeps the energy `before` that was dissipated until then [J].
  PetscErrorCode keep_dissipated(double before);

  PetscErrorCode gather(const LocalState& state);
  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum = nullptr) const;
  Energies energies(double t, const LocalState& state) const;
  PetscErrorCode jacobian(double t, const LocalState& state, double sigma, bool momentum, RowWriter* writer) const;
  void condense_springs(double t, const LocalState& state, const Coefficients& abc, bool positive, PairMatrix* S) const;
  PetscErrorCode condense_rows(double t, const LocalState& state, const Coefficients& abc, bool positive, RowWriter* writer) const;
  PotentialChange beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma) const;
  std::string lacks_potential() const;
  bool symmetric() const;
  bool complete() const;
  std::vector<double> rates() const;

 private:
  bool fill(double t, const LocalState& state, bool positive, bool rows, const Coefficients& abc, SparseBlocks* blocks) const;

  const Network& net_;
  std::unique_ptr<PairForces> pairs_;
  std::vector<std::unique_ptr<Term>> interactions_;
  std::vector<Term*> terms_;  ///< all of them, in order
  BreakRules rules_;
  Breaking breaking_;
  std::uint64_t version_ = 0;
  double dissipated_before_ = 0;  ///< dissipated before numbers were changed, which the terms no longer count [J]
  mutable SparseBlocks blocks_;   ///< blocks of the matrix that is being written
};

/// Collective. The message for an interaction whose force is not defined; `mine`: it occurred on this rank (on at least one it did).
PetscErrorCode interaction_fault(MPI_Comm comm, bool mine, const Singularity& fault, std::string* text);

/// The incremental potential of a particle system, along one line of states at a time.
class ParticlePotential final : public Incremental {
 public:
  /// Collective. The arguments must outlive the object; `coupled`: a force acts that couples all particles.
  PetscErrorCode create(const Network& net, const Terms& terms, Vec layout, bool coupled);
  std::string lacks_potential() const override { return lacks_; }
  PetscErrorCode add_kinematic(Vec F, Vec y) override;
  PetscErrorCode follow(Vec y, Vec z) override;
  PetscErrorCode beyond_slope(double t, double sigma, double lambda, PotentialChange* change) override;
  bool limits_steps() const override;
  PetscErrorCode largest_lambda(double t, double* lambda) override;

 private:
  const Network* net_ = nullptr;
  const Terms* terms_ = nullptr;
  Vec layout_ = nullptr;
  std::string lacks_;
  LocalState state_, line_;  ///< created at first use
};

}  // namespace bs
