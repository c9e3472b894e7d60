// Forces that a program on the library computes itself.
#pragma once
#include <string>
#include <vector>
#include "systems/force_callback.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// Those of the communicator's ForceCallback as a term, with the tangent and the potential that it gives.
class CallbackForces final : public Term {
 public:
  /// Local. The arguments must outlive the object.
  void create(const Network& net, const RowPattern& pattern);
  bool active() const { return static_cast<bool>(callback_.force); }
  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override;
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override;
  void supply(double t, const LocalState& state, Supply* sum) const override;
  void energies(double t, const LocalState& state, Energies* sum) const override;
  std::string lacks_potential() const override { return callback_.energy ? "" : "a force that is computed outside"; }
  void beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma, PotentialChange* sum) const override;
  void outer_sizes(double t, const LocalState& state, double* size) const override;
  bool symmetric() const override { return !callback_.tangent; }
  bool by_rows() const override { return true; }
  bool damps() const override { return static_cast<bool>(callback_.tangent); }
  void multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const override;
  void add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const override;
  void join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const override;
  void add_blocks(double t, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const override;
  void stiffness_sizes(double t, const LocalState& state, double* size) const override;

 private:
  /// Particles as the callback is asked for them: rows of the input, places and velocities (which, d).
  struct Points {
    std::vector<std::int64_t> row;
    std::vector<double> x, v;
  };
  /// The tangent of all owned particles that are not fixed, kept for the state it was asked for last: (free, d, d).
  struct Tangents {
    bool known = false;
    double t = 0;
    Points at;
    std::vector<double> K, D;
  };
  Points points(const std::vector<PetscInt>& which, const LocalState& state) const;
  std::vector<double> evaluate(const std::vector<PetscInt>& which, double t, const LocalState& state) const;
  const Tangents& tangents(double t, const LocalState& state) const;
  const Network* net_ = nullptr;
  const RowPattern* pattern_ = nullptr;
  ForceCallback callback_;
  std::vector<PetscInt> free_[2];  ///< owned particles of either Part that are not fixed, by their rows in the input
  std::vector<PetscInt> all_;      ///< of both
  std::vector<PetscInt> moving_;   ///< and those that are driven
  std::vector<PetscInt> place_;    ///< of owned particles among all; -1: fixed
  mutable Tangents tangents_;
};

}  // namespace bs
