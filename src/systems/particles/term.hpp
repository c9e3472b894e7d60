// A force on particles as one part of the sum that moves them: what every kind of force gives, and nothing of how it does so.
#pragma once
#include <limits>
#include <string>
#include <vector>
#include "linalg/sparse_blocks.hpp"
#include "systems/incremental.hpp"
#include "systems/mechanics.hpp"
#include "systems/particles/local_state.hpp"
#include "systems/particles/row_pattern.hpp"
#include "systems/system.hpp"

namespace bs {

class Breakable;
struct BreakRules;

/// The fault met in a loop and its place: a law has no value there.
struct Singularity {
  /// state: that of a particle is not finite; outside: a force that is computed outside is not
  enum Kind { none, spring, anchor, particle, interaction, state, outside } kind = none;
  std::int64_t row = -1;  ///< row of the spring, anchor, particle or interaction in the input
  const char* law = "";   ///< title of the particle law or of the interaction's
  const char* why = "";   ///< what an interaction met
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

/// Owned particles by what they are linked to: owned ones alone, or some ghost as well.
enum class Part { interior, boundary };

/// Every function ADDS the term's share of this rank to what it is given, unless it says otherwise; `state` is gathered, `t` the time of evaluation.
/// The defaults contribute nothing. A term that gives tangents gives them by rows, by blocks, or both as the matrix asks.
class Term {
 public:
  virtual ~Term() = default;
  /// Collective. Sums over all particles which the functions below need of this state, before any of them.
  virtual PetscErrorCode gather(const LocalState&) { return 0; }
  /// Forces on the particles of `part` that are not fixed, f: (n, d); where `sum` is given also the energies of these particles, fixed ones
  /// included, bit for bit as energies() adds them. The first singularity met is kept in `fault`; the particle's force is then not finite.
  virtual void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const = 0;
  /// Forces on some owned particles, ascending, whatever holds them: f: (which, d).
  virtual void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const = 0;
  /// Elastic energy counts an equal part of each end.
  virtual void energies(double, const LocalState&, Energies*) const {}
  virtual void supply(double, const LocalState&, Supply*) const {}
  /// f += K z_x + D z_v for every owned particle that is not fixed; `z` is gathered, zero at fixed particles.
  virtual void multiply_tangent(double, const LocalState&, const LocalState&, double*) const {}
  /// -df_i/dx_j and -df_i/dv_j side by side for every column j of the pattern, of owned particle i that is not fixed: `panel` (d, width).
  virtual void add_row(PetscInt, double, const LocalState&, double*, PetscInt) const {}
  /// Whether it gives all of its tangent.
  virtual bool complete() const { return true; }
  /// Whether K and D are symmetric, and whether there is a D beside those of springs and of the laws of single particles.
  virtual bool symmetric() const { return true; }
  virtual bool damps() const { return false; }
  /// Whether add_row gives all of the tangent, so that what add_blocks gives is for S alone.
  virtual bool by_rows() const { return false; }
  /// Blocks that no pair of linked particles has: where they lie, and -b D - c K of S = a M - b D - c K, of which the symmetric part; `positive`:
  /// only what makes it positive semidefinite.
  virtual void join(std::vector<std::pair<PetscInt, PetscInt>>*) const {}
  virtual void add_blocks(double, const LocalState&, bool /* positive */, const Coefficients&, SparseBlocks*) const {}
  /// What the incremental potential changes by beyond its slope along lambda `line` (gathered as a direction), anchors at rest meanwhile:
  ///   sigma/2 m |dv|^2 + sigma (E(x + dx) - E(x) - E'.dx) + R(v + dv) - R(v) - R'.dv
  virtual void beyond_slope(double, const LocalState&, const LocalState&, double /* lambda */, double /* sigma */, PotentialChange*) const {}
  /// Whether a step may be too long for it, the same on every rank; and the largest lambda for which its forces are as they should be all the way
  /// from `state` to state + lambda `line` (gathered as a direction): nothing goes at once through what repels it.
  virtual bool limits_steps() const { return false; }
  virtual double largest_lambda(double, const LocalState&, const LocalState&) const { return std::numeric_limits<double>::infinity(); }
  /// Whether its forces depend on where in space particles are, not on each other's places alone.
  virtual bool depends_on_place() const { return false; }
  /// Empty, or what of it has no potential.
  virtual std::string lacks_potential() const { return {}; }
  virtual void strain_response(const LocalState&, StrainResponse*) const {}
  virtual void box_forces(const LocalState&, BoxForces*) const {}
  /// An equal part of the virial to either end's d(d+1)/2 components; sum: (n, d(d+1)/2) [J].
  virtual void particle_stress(const LocalState&, double*) const {}
  /// Sizes of the forces between particles that springs do not exert, to size[i] of owned particles [N].
  virtual void inner_sizes(const LocalState&, double*) const {}
  /// Sizes of the forces of fields and of given ones, which may cancel each other, to size[i] of owned particles that are not fixed [N].
  virtual void outer_sizes(double, const LocalState&, double*) const {}
  /// Sizes of the forces whose difference damping is, D |v_i| and D |v_j| of -D (v_i - v_j), likewise: where all moves alike they cancel each other.
  /// A velocity is as large as v and, being x' as well, as sigma x.
  virtual void damping_sizes(double, const LocalState&, double /* sigma */, double*) const {}
  /// Rates at rest at every owned particle [N/m].
  virtual void add_rates(std::vector<double>*) const {}
  /// Magnitudes of the rates in its rows of K, none less than at rest: what rounding errors of these rows are relative to [N/m].
  virtual void stiffness_sizes(double, const LocalState&, double*) const {}
  /// Collective, once, before all that follows: what it remembers and which parts of it may break. `net` is the network that it was made of, and
  /// `lattice` what that was made of, whose chunk is still there.
  virtual PetscErrorCode remember(Network& /* net */, const Lattice&, const BreakRules&) { return 0; }
  /// Whether forces depend on what was before: at the same state they may be others after accept().
  virtual bool remembers() const { return false; }
  /// Whether it is told of the beginnings of steps; the same on every rank.
  virtual bool begins_steps() const { return false; }
  /// Collective. Before the evaluations of every attempt at `step`, from `state` at its time t: what is drawn or looked up once for a step. Forces at
  /// the same state may be others after it.
  virtual PetscErrorCode begin_step(const Step&, const LocalState&) { return 0; }
  /// Collective. The history is brought up to `state`, the end of a step that counts (of length 0 where no time went by); trial states never write
  /// it.
  virtual PetscErrorCode accept(const Step&, const LocalState&) { return 0; }
  /// Collective. The history by numbers in the input's order, for checkpoints and, with units, for frames; vectors are borrowed. recall() takes what
  /// gather_history() handed out, refilled.
  virtual PetscErrorCode gather_history(std::vector<StatePart>*) { return 0; }
  virtual PetscErrorCode history_fields(std::vector<Field>*) { return 0; }
  virtual PetscErrorCode recall() { return 0; }
  /// What a checkpoint holds of it beside that, the same on every rank, by names with the term's in front; and back.
  virtual void keep(const Keeper&) {}
  /// Energy lost by what is whole [J], this rank's share.
  virtual double dissipated() const { return 0; }
  /// Collective. What forces change by with its numbers of that name (changeable_numbers, lattice/lattice.hpp): rows = lambda . df/dp [J per unit of
  /// p] of this rank's rows in the input's order, 0 where a law takes no such number and of what is broken; histories are taken as they are. `rows`
  /// is left as it is where the term has no such numbers, or its law does not say. `lambda` is gathered as a direction; after remember().
  virtual PetscErrorCode force_changes(const std::string& /* name */, const LocalState&, const LocalState& /* lambda */, std::vector<double>*) {
    return 0;
  }
  /// What of it may break; null: nothing.
  virtual Breakable* breakable() const { return nullptr; }
};

}  // namespace bs
