// Points of other ranks that pairs tie to owned ones: incomplete factors of a rank hold them as rows of their own, behind those of the owned points,
// so that the blocks of the ranks overlap, where a cut pair is stiff or at all of them.
#pragma once
#include <vector>
#include "linalg/pair_matrix.hpp"

namespace bs {

class Overlap {
 public:
  /// Numbers between two ghosts that are rows, a < b.
  template <class Number, int most>
  struct Between {
    PetscInt a, b;
    Number numbers[most];
    PetscInt slot;  ///< its place among those of a that are sent
  };
  using Tie = Between<float, 4>;     ///< a pair's (w, t) of PairMatrix
  using Block = Between<double, 9>;  ///< d x d, what the remainder holds

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
    blocks_.clear();
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
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  /// What is told of owned points, in compressed rows: the global number of the other end, and the numbers between them.
  template <class Number>
  struct Told {
    std::vector<PetscInt> start, other;
    std::vector<const Number*> numbers;
    PetscInt slots = 0;  ///< those of a point that are sent, at most, on all ranks
  };
  void choose(const PairMatrix& S, const std::vector<std::uint8_t>& tied);
  void publish(const PairMatrix& S, double least);
  template <class Number, class Pair>
  PetscErrorCode find(PairMatrix& S, Told<Number>* told, std::vector<Pair>* ties) const;
  template <class Number, class Pair>
  PetscErrorCode renew(PairMatrix& S, const Told<Number>& told, PetscInt width, std::vector<Pair>* ties) const;
  template <class Pair>
  void keep_rows(std::vector<Pair>* ties) const;
  template <class Value>
  PetscErrorCode send(PairMatrix& S, Value&& value, std::vector<double>* all) const;
  PetscErrorCode set_weights(PairMatrix& S);
  void weigh(PetscInt d, std::vector<double>* rows) const;
  PetscErrorCode fetch(PairMatrix& S, Vec in);
  PetscErrorCode add(PairMatrix& S, Vec out);

  bool active_ = false;
  std::vector<PetscInt> ghosts_, row_;
  std::vector<Tie> ties_;
  std::vector<Block> blocks_;
  Told<float> pairs_;                      ///< pairs above `least`
  Told<double> remainder_;                 ///< all of the remainder
  std::vector<double> weight_;             ///< of rows; empty: 1
  std::vector<double> in_, out_, values_;  ///< room
};

}  // namespace bs
