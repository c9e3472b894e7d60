// All forces on particles, as one set of loops over the particles that this rank owns. Chosen once per run by dimension
// and laws, so that the loops hold no switch.
#pragma once
#include <memory>
#include <string>
#include <vector>
#include "linalg/pair_matrix.hpp"
#include "physics/body/registry.hpp"
#include "physics/whole/motion.hpp"
#include "systems/incremental.hpp"
#include "systems/mechanics.hpp"
#include "systems/particles/condensed/block_rows.hpp"
#include "systems/particles/coupling.hpp"
#include "systems/particles/local_state.hpp"
#include "systems/particles/row_pattern.hpp"

namespace bs {

/// The fault met in a loop and its place: a law has no value there.
struct Singularity {
  enum Kind { none, spring, anchor, particle, interaction, state } kind = none;  ///< state: that of a particle is not finite
  std::int64_t row = -1;                                                         ///< row of the spring, anchor, particle or interaction in the input
  const char* law = "";                                                          ///< title of the particle law or of the interaction's
  const char* why = "";                                                          ///< what an interaction met
};

/// Energies [J], momentum sum m v [kg m/s] and angular momentum sum x cross m v about the origin [kg m^2/s] of this rank's share.
struct Energies {
  double kinetic = 0, elastic = 0, field = 0;
  double momentum[3] = {0, 0, 0}, angular_momentum[3] = {0, 0, 0};
};

/// What acts from outside on this rank's particles.
struct Supply {
  double field = 0, coupling = 0, fluid = 0;  ///< power of laws with a potential, of forces that couple all, of the fluid's motion [W]
  double pull[3] = {0, 0, 0};                 ///< force of the anchors on the particles [N]
};

/// This rank's share of sums over the springs of a periodic box, with force f and x_i - x_j = dx at one end.
struct BoxForces {
  double virial[9] = {};  ///< -sum of f dx over springs, symmetric part, (d, d) [J]
  double pull[9] = {};    ///< row k: the force with which images shifted along edge k are held, times their shifts [N]
};

/// A spring as it is: length [m], tension [N], stored energy and what it has lost so far [J].
struct LinkMeasures {
  double length, tension, energy, dissipated;
};

/// Owned particles by what they are linked to: owned ones alone, or some ghost as well.
enum class Part { interior, boundary };

/// Forces are of every owned particle, zero on fixed ones; `state` is gathered, `t` the time of evaluation.
class Physics {
 public:
  virtual ~Physics() = default;
  /// f: (n, d), overwritten where the particles of `part` are. The first singularity met is kept in `fault`; the particle's force is then not finite.
  virtual void forces(Part part, double t, const LocalState& state, const Coupling& coupling, double* f, Singularity* fault) const = 0;
  /// The same in one pass with the energies of the particles of `part`, fixed ones included, which are added to `sum`: bit for bit those of
  /// energies().
  virtual void forces_and_energies(Part part, double t, const LocalState& state, const Coupling& coupling, double* f, Singularity* fault,
                                   Energies* sum) const = 0;
  /// The same of some owned particles, whatever holds them: f: (which, d), all laws included.
  virtual void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, const Coupling& coupling, double* f) const = 0;
  /// Adds the force of this rank's anchors on their particles to sum[d].
  virtual void pull(double t, const LocalState& state, double* sum) const = 0;
  /// Writes J = [sigma M, -M; -K, sigma M - D] (momentum form) or the same divided by M (velocity form).
  virtual PetscErrorCode jacobian(double t, const LocalState& state, const Coupling& coupling, double sigma, bool momentum,
                                  RowWriter* writer) const = 0;
  /// S = a M - b D - c K spring by spring; what is not symmetric (axial dampers at work) is symmetrised. `positive`:
  /// only what makes S positive definite.
  virtual void condense_springs(double t, const LocalState& state, const Coefficients& abc, bool positive, PairMatrix* S) const = 0;
  /// The same by block rows, as it is; couplings of all particles are left out.
  virtual PetscErrorCode condense_rows(double t, const LocalState& state, const Coefficients& abc, bool positive, BlockRowWriter* writer) const = 0;
  /// f = K z_x + D z_v for every owned particle, overwritten; `z` is gathered, zero at fixed particles.
  virtual void multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const = 0;
  /// f += D w of the particle laws and anchors alone, w: (n, d). All of D where no spring has a damper.
  virtual void multiply_law_damping(double t, const LocalState& state, const double* w, double* f) const = 0;
  /// What springs carry from step to step becomes that of `state`, the end of a good step of length h. `links`: of the network
  /// given at creation; no other function writes them.
  virtual void commit(const LocalState& state, double h, Links* links) const = 0;
  /// Of the spring of link e at owned particle i.
  virtual LinkMeasures measure(const LocalState& state, PetscInt i, PetscInt e) const = 0;
  /// Elastic energy counts half a spring from either end.
  virtual Energies energies(double t, const LocalState& state) const = 0;
  /// Adds the springs' share to force and affine, which have their sizes.
  virtual void strain_response(const LocalState& state, StrainResponse* sum) const = 0;
  /// Adds to `sum`; springs alone, with their dampers.
  virtual void box_forces(const LocalState& state, BoxForces* sum) const = 0;
  /// Adds half of the virial of every spring, dampers included, to either end's d(d+1)/2 components; sum: (n, d(d+1)/2) [J].
  virtual void particle_stress(const LocalState& state, double* sum) const = 0;
  virtual Supply supply(double t, const LocalState& state, const Coupling& coupling) const = 0;
  /// This rank's share of what the incremental potential changes by beyond its slope along lambda `line` (gathered as a
  /// direction), anchors at rest meanwhile: sum over particles, springs and laws of
  ///   sigma/2 m |dv|^2 + sigma (E(x + dx) - E(x) - E'.dx) + R(v + dv) - R(v) - R'.dv
  virtual PotentialChange beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma) const = 0;
  /// Empty, or what of the springs and particle laws here has no potential.
  virtual std::string lacks_potential() const = 0;
  /// size[i]: sum of the magnitudes of the particle laws' forces on owned particle i, which may cancel each other [N].
  virtual void law_sizes(double t, const LocalState& state, double* size) const = 0;
  /// Tension of this rank's anchor k [N].
  virtual double anchor_tension(double t, const LocalState& state, PetscInt k) const = 0;
  /// Adds the sizes of the forces of interactions of three and more ends to size[i] of owned particles [N].
  virtual void add_interaction_sizes(const LocalState&, double*) const {}
  /// Sum of the rates of the springs at every owned particle [N/m].
  virtual std::vector<double> rates() const = 0;
  /// size[i]: sum of the magnitudes of the tangents' axial and transverse rates of all links, anchors, angles and laws at owned particle i, none
  /// less than at rest: what rounding errors of its rows of K are relative to [N/m].
  virtual void stiffness_sizes(double t, const LocalState& state, double* size) const = 0;
};

/// `net`, `laws`, `motion` and `pattern` must outlive the result.
std::unique_ptr<Physics> create_physics(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern);

/// The same for one dimension: each in a file of its own (physics_<d>d.cpp), since they take long to compile.
template <int d>
std::unique_ptr<Physics> create_physics_of(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern);

}  // namespace bs
