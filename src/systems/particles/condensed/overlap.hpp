// Particles of other ranks that stiff springs tie to owned ones: incomplete factors of a rank hold them as rows of their own, behind those of the
// owned particles, so that the blocks of the ranks overlap where a cut spring is stiff.
#pragma once
#include <vector>
#include "systems/particles/condensed/spring_matrix.hpp"

namespace bs {

class Overlap {
 public:
  /// A stiff spring between two ghosts that are rows, a < b.
  struct Tie {
    PetscInt a, b;
    float numbers[4];  ///< (w, t) of SpringMatrix
    PetscInt slot;     ///< its place among the stiff pairs of a
  };

  /// Collective. `least`: the size of pairs of S above which this rank takes them for stiff; 0: none.
  PetscErrorCode create(SpringMatrix& S, double least);
  /// Not collective. This rank has no such rows after all.
  void leave_out() {
    row_.assign(row_.size(), -1);
    ghosts_.clear();
    ties_.clear();
  }
  /// Collective. Numbers of the ties as they are now, and the ghosts' diagonal blocks behind those of the owned particles.
  PetscErrorCode update(SpringMatrix& S, std::vector<double>* diagonal);
  /// Collective. out = A^-1 in, solve(in, out) on the numbers of all rows; what belongs to ghosts is added at their owners.
  template <class Solve>
  PetscErrorCode apply(SpringMatrix& S, Vec in, Vec out, Solve&& solve) {
    PetscFunctionBegin;
    PetscCall(fetch(S, in));
    solve(in_.data(), out_.data());
    PetscCall(add(S, out));
    PetscFunctionReturn(0);
  }

  /// Whether some rank has such rows; the same on every rank.
  bool active() const { return active_; }
  /// Ghosts (from 0) of rows n, n + 1, ..., and the row of a ghost, -1: none.
  const std::vector<PetscInt>& ghosts() const { return ghosts_; }
  PetscInt row(PetscInt ghost) const { return row_.empty() ? -1 : row_[static_cast<std::size_t>(ghost)]; }
  /// Ascending by a.
  const std::vector<Tie>& ties() const { return ties_; }

 private:
  void choose(const SpringMatrix& S, const std::vector<std::uint8_t>& tied);
  void publish(const SpringMatrix& S, double least);
  PetscErrorCode find_ties(SpringMatrix& S);
  template <class Value>
  PetscErrorCode send(SpringMatrix& S, Value&& value, std::vector<double>* all) const;
  PetscErrorCode fetch(SpringMatrix& S, Vec in);
  PetscErrorCode add(SpringMatrix& S, Vec out);

  bool active_ = false;
  PetscInt slots_ = 0;  ///< stiff pairs of a particle, at most, on all ranks
  std::vector<PetscInt> ghosts_, row_;
  std::vector<Tie> ties_;
  /// Stiff pairs of owned particles, in compressed rows: their numbers, and the global number of the other end.
  std::vector<PetscInt> start_, other_;
  std::vector<const float*> numbers_;
  std::vector<double> in_, out_, values_;  ///< room
};

}  // namespace bs
