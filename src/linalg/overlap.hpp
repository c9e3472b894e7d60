// Points of other ranks that pairs tie to owned ones: incomplete factors of a rank hold them as rows of their own, behind those of the owned points,
// so that the blocks of the ranks overlap, where a cut pair is stiff or at all of them.
#pragma once
#include <vector>
#include "linalg/pair_matrix.hpp"

namespace bs {

class Overlap {
 public:
  /// A pair between two ghosts that are rows, a < b.
  struct Tie {
    PetscInt a, b;
    float numbers[4];  ///< (w, t) of PairMatrix
    PetscInt slot;     ///< its place among the pairs of a that are sent
  };

  /// Collective. At pairs of S whose size is above `least`; 0: at none.
  PetscErrorCode create(PairMatrix& S, double least);
  /// Collective. At all pairs. Of a point that is a row of m ranks each of them is then given the 1/sqrt(m)-th part, and so much of its result
  /// counts: where stiff pairs end at points with different m, this would strain them.
  PetscErrorCode create_everywhere(PairMatrix& S);
  /// Not collective. This rank has no such rows after all.
  void leave_out() {
    row_.assign(row_.size(), -1);
    ghosts_.clear();
    ties_.clear();
  }
  /// Collective. Numbers of the ties as they are now, and the ghosts' diagonal blocks behind those of the owned points.
  PetscErrorCode update(PairMatrix& S, std::vector<double>* diagonal);
  /// Collective. out = A^-1 in, solve(in, out) on the numbers of all rows; what belongs to ghosts is added at their owners.
  template <class Solve>
  PetscErrorCode apply(PairMatrix& S, Vec in, Vec out, Solve&& solve) {
    PetscFunctionBegin;
    PetscCall(fetch(S, in));
    weigh(S.dim(), &in_);
    solve(in_.data(), out_.data());
    weigh(S.dim(), &out_);
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
  void choose(const PairMatrix& S, const std::vector<std::uint8_t>& tied);
  void publish(const PairMatrix& S, double least);
  PetscErrorCode find_ties(PairMatrix& S);
  template <class Value>
  PetscErrorCode send(PairMatrix& S, Value&& value, std::vector<double>* all) const;
  PetscErrorCode set_weights(PairMatrix& S);
  void weigh(PetscInt d, std::vector<double>* rows) const;
  PetscErrorCode fetch(PairMatrix& S, Vec in);
  PetscErrorCode add(PairMatrix& S, Vec out);

  bool active_ = false;
  PetscInt slots_ = 0;  ///< such pairs of a point, at most, on all ranks
  std::vector<PetscInt> ghosts_, row_;
  std::vector<Tie> ties_;
  /// Pairs of owned points above `least`, in compressed rows: their numbers, and the global number of the other end.
  std::vector<PetscInt> start_, other_;
  std::vector<const float*> numbers_;
  std::vector<double> weight_;             ///< of rows; empty: 1
  std::vector<double> in_, out_, values_;  ///< room
};

}  // namespace bs
