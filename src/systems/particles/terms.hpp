// All forces on particles: the list of terms, in the order in which they are summed.
#pragma once
#include <memory>
#include <vector>
#include "systems/incremental.hpp"
#include "systems/particles/breaking/breaking.hpp"
#include "systems/particles/physics.hpp"

namespace bs {

class Coupling;

/// Springs and the laws of single particles come first and start every sum; then what couples all particles, interactions of several ends, and what
/// else is added. Who walks the list calls a function of Term of each, in that order: springs overwrite arrays over particles, the others add to
/// them. Functions of Terms are those that do more, or are asked for in many places.
class Terms {
 public:
  /// The arguments must outlive the object; `coupling`: null where nothing couples all.
  Terms(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern, Coupling* coupling = nullptr);
  /// One more, behind the others; it must outlive the object.
  void add(Term& term) { terms_.push_back(&term); }
  auto begin() const { return terms_.begin(); }
  auto end() const { return terms_.end(); }
  const PairForces& pairs() const { return *pairs_; }
  /// Collective. What the terms so far remember of the past, and which parts of them break; `net` is that given at creation, `lattice` what it was
  /// made of, whose chunk is still there.
  PetscErrorCode remember(Network& net, const Lattice& lattice, const BreakRules& rules);
  const BreakRules& break_rules() const { return rules_; }
  Breaking& breaking() { return breaking_; }
  const Breaking& breaking() const { return breaking_; }
  bool remembers() const;
  /// Collective. Histories, and the list of what broke.
  PetscErrorCode gather_history(std::vector<StatePart>* parts);
  PetscErrorCode recall();
  /// Collective. Of histories, and of kinds that may break a flag for each.
  PetscErrorCode history_fields(std::vector<Field>* out);
  void keep(const Keeper& keep);
  /// Collective. By what is whole, what broke, and with numbers that were others then [J].
  PetscErrorCode dissipated(double* energy) const;
  /// Collective. Numbers have changed: what was dissipated until then, `before`, stays.
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
  double dissipated_before_ = 0;  ///< beyond what the terms count by their present numbers [J]
  mutable SparseBlocks blocks_;   ///< of the matrix that is being written
};

/// Collective. The message for an interaction without a force; `mine`: it occurred on this rank (at least one has it).
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
  LocalState state_, line_;  ///< made at first use
};

}  // namespace bs
