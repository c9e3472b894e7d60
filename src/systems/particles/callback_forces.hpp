// Forces that a program on the library computes itself.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "systems/client.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// What `callback` couples, both ways, ascending, each once.
std::vector<std::array<std::int64_t, 2>> couples_of(const ForceCallback& callback);

/// Those of the communicator's ForceCallback as a term, with the tangent and the potential that it gives.
class CallbackForces final : public Term {
 public:
  /// Local. The arguments must outlive the object.
  void create(const Network& net, const RowPattern& pattern);
  bool active() const { return static_cast<bool>(callback_.force); }
  /// Whether this rank asks for particles of other ranks, too.
  bool feels_ghosts() const { return asked_.size() > static_cast<std::size_t>(net_->n) && active(); }
  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override;
  bool begins_steps() const override { return static_cast<bool>(callback_.begin_step); }
  PetscErrorCode begin_step(const Step& step, const LocalState& state) override;
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override;
  void supply(double t, const LocalState& state, Supply* sum) const override;
  void energies(double t, const LocalState& state, Energies* sum) const override;
  std::string lacks_potential() const override { return callback_.energy ? "" : "a force that is computed outside"; }
  void beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma, PotentialChange* sum) const override;
  void outer_sizes(double t, const LocalState& state, double* size) const override;
  bool complete() const override { return static_cast<bool>(callback_.tangent); }
  bool symmetric() const override { return !callback_.tangent || callback_.energy; }
  bool depends_on_place() const override { return true; }
  bool limits_steps() const override { return static_cast<bool>(callback_.limit); }
  double largest_lambda(double t, const LocalState& state, const LocalState& line) const override;
  bool by_rows() const override { return true; }
  bool damps() const override { return static_cast<bool>(callback_.tangent); }
  void multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const override;
  void add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const override;
  void join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const override;
  void add_blocks(double t, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const override;
  void stiffness_sizes(double t, const LocalState& state, double* size) const override;

 private:
  /// What the callback was asked for last, of all own particles and those that they feel: so that nothing of it depends on what is fixed.
  struct Evaluation {
    bool known = false;
    double t = 0;
    std::vector<double> x, v;                  ///< (asked, d)
    std::vector<double> f, K, D;               ///< what it gave: (asked, d), or (asked, d, d)
    std::vector<double> K_between, D_between;  ///< (pairs, d, d)
  };
  /// The force on owned particle i, which moves, depends on local particle j, which is not fixed, or the force on j on i.
  struct Influence {
    PetscInt i, j, link;     ///< link: of i to j, whose block of matrices it shares
    std::size_t pair, back;  ///< (i, j) and (j, i) among those asked for; NONE: it is not
  };
  static constexpr std::size_t NONE = static_cast<std::size_t>(-1);
  void couple();
  void find_influences(const std::vector<std::pair<PetscInt, PetscInt>>& pairs);
  std::pair<const Influence*, const Influence*> influences_on(PetscInt i) const;
  /// An exception in a callback leaves numbers that are not: they are asked for again.
  static bool all_finite(const std::vector<double>& numbers);
  bool move_to(double t, const LocalState& state, Evaluation* asked) const;
  const std::vector<double>& own_forces(double t, const LocalState& state) const;
  const Evaluation& tangents(double t, const LocalState& state) const;
  std::vector<double> energies_at(double t, const std::vector<double>& x) const;
  std::size_t place(PetscInt i) const { return place_[static_cast<std::size_t>(i)]; }

  const Network* net_ = nullptr;
  const RowPattern* pattern_ = nullptr;
  ForceCallback callback_;
  std::vector<PetscInt> asked_;       ///< owned particles, and ghosts that they feel, by their rows in the input
  std::vector<std::int64_t> rows_;    ///< these
  std::vector<std::size_t> place_;    ///< of local particles among asked_
  ForceCallback::Pairs pairs_;        ///< by places among asked_
  std::vector<Influence> felt_;       ///< by i
  std::vector<PetscInt> counted_;     ///< owned particles whose energies count
  std::vector<PetscInt> changed_;     ///< those whose energies a step may change
  std::vector<PetscInt> free_;        ///< those that are not fixed or driven
  std::vector<PetscInt> of_part_[2];  ///< of these, by Part
  std::vector<PetscInt> moving_;      ///< those that are not fixed
  mutable Evaluation forces_, tangents_;
};

}  // namespace bs
