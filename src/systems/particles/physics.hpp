// Springs, dampers, anchors and the laws of single particles, as one set of loops over the particles that this rank owns. Chosen once per run by
// dimension and laws, so that the loops hold no switch.
#pragma once
#include <memory>
#include "linalg/pair_matrix.hpp"
#include "physics/body/registry.hpp"
#include "physics/whole/motion.hpp"
#include "systems/particles/breaking/spring_breaks.hpp"
#include "systems/particles/spring_memory.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// A spring as it is: length [m], tension [N], stored energy and what it has lost so far [J].
struct LinkMeasures {
  double length, tension, energy, dissipated;
};

/// The first of a system's terms, with kinetic energy and momentum: forces(), forces_on(), multiply_tangent() and stiffness_sizes() overwrite what
/// they are given, the others add. Matrices by pairs and by rows are its own: they have its pattern.
class PairForces : public Term {
 public:
  /// Histories of springs, and those that break: nothing else writes links.
  PetscErrorCode remember(Network& net, const Lattice& lattice, const BreakRules& rules) final;
  bool remembers() const final { return memory_.active(); }
  PetscErrorCode accept(const Step& step, const LocalState& state) final;
  PetscErrorCode gather_history(std::vector<StatePart>* parts) final { return memory_.gather(parts); }
  PetscErrorCode history_fields(std::vector<Field>* out) final { return memory_.fields(out); }
  PetscErrorCode recall() final { return memory_.scatter(); }
  void keep(const Keeper& keep) final { memory_.keep(keep); }
  double dissipated() const final { return memory_.dissipated(); }
  PetscErrorCode force_changes(const std::string& name, const LocalState& state, const LocalState& lambda, std::vector<double>* rows) final;
  Breakable* breakable() const final { return breaks_.get(); }

  /// Adds the force of this rank's anchors on their particles to sum[d].
  virtual void pull(double t, const LocalState& state, double* sum) const = 0;
  /// Writes J = [sigma M, -M; -K, sigma M - D] (momentum form) or the same divided by M (velocity form); `terms`: of all rows, itself among them.
  virtual PetscErrorCode jacobian(double t, const LocalState& state, const std::vector<Term*>& terms, double sigma, bool momentum,
                                  RowWriter* writer) const = 0;
  /// S = a M - b D - c K spring by spring; what is not symmetric (axial dampers at work) is symmetrised. `positive`:
  /// only what makes S positive definite.
  virtual void condense_springs(double t, const LocalState& state, const Coefficients& abc, bool positive, PairMatrix* S) const = 0;
  /// The same by block rows, as it is; couplings of all particles are left out.
  virtual PetscErrorCode condense_rows(double t, const LocalState& state, const Coefficients& abc, bool positive, RowWriter* writer) const = 0;
  /// f += D w of the particle laws and anchors alone, w: (n, d). All of D where no spring has a damper.
  virtual void multiply_law_damping(double t, const LocalState& state, const double* w, double* f) const = 0;
  /// What springs carry from step to step becomes that of `state`, the end of a good step of length h. `links`: of the network given at creation.
  virtual void commit(const LocalState& state, double h, Links* links) const = 0;
  /// tension[e] += part (T + T' u.(z_i - z_j) - tension[e]) of every link e with a direction u at `state`, whose ends change their places by z: a
  /// first order estimate of its tension behind that change [N]. Links of zero rest length, whose tension is no matter of direction, get NaN.
  virtual void predict_tensions(const LocalState& state, const LocalState& z, double part, double* tension) const = 0;
  /// The largest |z_i - z_j|/l of any spring on this rank [1]: an angle by which it turns, or a strain.
  virtual double largest_turn(const LocalState& state, const LocalState& z) const = 0;
  /// Of the spring of link e at owned particle i.
  virtual LinkMeasures measure(const LocalState& state, PetscInt i, PetscInt e) const = 0;
  /// Lengths and tensions of `count` of them, of links e[s] at particles i[s].
  virtual void measure(const LocalState& state, std::size_t count, const PetscInt* i, const PetscInt* e, double* length, double* tension) const = 0;
  /// pull[d] = d(T u)/dp for the spring of link e at owned particle i, which pulls it with -T u; p is the number `of` (physics/pair/springs/law.hpp).
  virtual void pull_change(const LocalState& state, PetscInt i, PetscInt e, int of, double* pull) const = 0;
  /// Tension of this rank's anchor k [N].
  virtual double anchor_tension(double t, const LocalState& state, PetscInt k) const = 0;

 protected:
  /// Loops are chosen by the links as they are.
  virtual void choose_loops() = 0;

 private:
  SpringMemory memory_;
  Rows springs_;                          ///< of this rank in the input's order
  SpringTable numbers_;                   ///< made at first use
  std::unique_ptr<SpringBreaks> breaks_;  ///< null where no spring may break
};

/// `net`, `laws`, `motion` and `pattern` must outlive the result. Each dimension is in a file of its own (physics_<d>d.cpp), since they take long to
/// compile.
template <int d>
std::unique_ptr<PairForces> create_pair_forces_of(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern);

}  // namespace bs
