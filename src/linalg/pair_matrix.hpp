// A symmetric matrix S of d x d blocks between points, such as sigma M - D - K/sigma of springs, kept pair by pair in single precision:
//   (S z)_i = A_i z_i + sum over linked pairs (i,j) of B_ij (z_i - z_j) + sum_j R_ij z_j,   B_ij = t I + w w^T
// A pair takes d + 1 numbers: t acts across it, w along it. Their rounding changes each pair's B by 6e-8 of itself,
// however stiff its neighbours are, and the matrix stays symmetric; A_i (mass, drag, what ties to fixed points)
// is double. Products are summed in double. R holds what interactions of more than two ends add, d x d blocks in double; it takes
// no memory where there are none.
#pragma once
#include <petscmat.h>
#include <memory>
#include <utility>
#include <vector>
#include "base/arrays.hpp"
#include "base/handle.hpp"
#include "linalg/graph.hpp"
#include "linalg/sparse_blocks.hpp"

namespace bs {

/// Which pairs of free points are linked, each owned pair once, at its lower end.
struct PairPattern {
  HugeVector<PetscInt> start, other;                ///< owned pairs (i, j > i): compressed rows (n + 1), (pairs)
  std::vector<PetscInt> across;                     ///< of these, ascending, those by way of an image in a periodic box: their ends are far apart
  std::vector<PetscInt> cut_row, cut_start, ghost;  ///< pairs cut by the rank boundary: rows that have any, their ghosts (from 0)
  PetscInt n = 0, ghosts = 0;
  std::size_t pairs() const { return other.size(); }
  /// visit(i, j) for the owned pairs whose ends are near each other.
  template <class Visit>
  void for_near(Visit&& visit) const {
    auto far = across.begin();
    for (PetscInt i = 0; i < n; ++i)
      for (PetscInt k = start[i]; k < start[i + 1]; ++k) {
        if (far != across.end() && *far == k) ++far;
        else visit(i, other[k]);
      }
  }
};

class PairMatrix {
 public:
  /// Collective. Values are zero.
  PetscErrorCode create(const Graph& graph, PairPattern pattern);
  int dim() const { return dim_; }
  const PairPattern& pattern() const { return pattern_; }
  const Graph& graph() const { return *graph_; }

  /// The values: (w, t) of pair k in the pattern's order, the symmetric A_i (d x d) of point i.
  double* node(PetscInt i) { return node_.data() + static_cast<std::size_t>(i) * area_; }
  float* pair(std::size_t k) { return pair_.data() + k * width_; }
  float* cut(std::size_t k) { return cut_.data() + k * width_; }
  const double* node(PetscInt i) const { return node_.data() + static_cast<std::size_t>(i) * area_; }
  const float* pair(std::size_t k) const { return pair_.data() + k * width_; }
  const float* cut(std::size_t k) const { return cut_.data() + k * width_; }
  /// Trace of B = t I + w w^T of such numbers, without t's multiplicity.
  double size_of(const float* numbers) const {
    double sum = static_cast<double>(numbers[dim_]);
    for (int c = 0; c < dim_; ++c) sum += static_cast<double>(numbers[c]) * static_cast<double>(numbers[c]);
    return sum;
  }
  double pair_size(std::size_t k) const { return size_of(pair(k)); }
  double cut_size(std::size_t k) const { return size_of(cut(k)); }
  void zero();
  /// R, not created where there is none.
  SparseBlocks& remainder() { return remainder_; }
  const SparseBlocks& remainder() const { return remainder_; }
  /// Owned points that a pair or R couples to ghosts, ascending.
  std::vector<PetscInt> boundary() const;

  /// Where the points are that S is made of.
  void set_places(Places places) { places_ = std::move(places); }
  /// The owned ones there, (n, d).
  std::vector<double> positions() const;

  /// a of a M - b D - c K: what held components keep on the diagonal; their rows and columns are 0 otherwise.
  void set_inertia(double a) { inertia_ = a; }
  /// Makes rows and columns of held components 0 in the block between owned point i and local point j.
  void hold_block(PetscInt i, PetscInt j, double* block) const;
  /// Collective. y = S p; vectors of block size d, laid out like the owned points.
  PetscErrorCode multiply(Vec p, Vec y);
  /// The diagonal block of point i: A_i + sum B_ij + R_ii, d x d.
  void diagonal_blocks(std::vector<double>* out) const;
  PetscErrorCode diagonal(Vec out) const;
  /// Collective. Of the sizes of these diagonal blocks, the largest over the smallest, without those of fixed points; infinite where one is 0.
  PetscErrorCode size_ratio(const std::vector<double>& blocks, double* ratio) const;
  /// Collective. A MATSHELL that multiplies by this object, which must outlive it; `from` finds it again.
  PetscErrorCode create_shell(Mat* out);
  static PairMatrix* from(Mat A);
  /// Collective. Appends the ghosts' numbers to the owned points', (n, d).
  PetscErrorCode append_ghosts(std::vector<double>* values);
  /// Collective. The ghosts' numbers of p, (ghosts, d), and what ghosts add to y at their owners.
  PetscErrorCode fetch_ghosts(Vec p, std::vector<double>* ghosts);
  PetscErrorCode add_ghosts(const std::vector<double>& ghosts, Vec y);
  /// Collective. A vector the matrix acts on.
  PetscErrorCode create_vector(Vec* out) const { return create_vec(graph_->comm, graph_->n, dim_, out); }

 private:
  PetscErrorCode hold_product(Vec p, Vec y) const;
  double on_diagonal(PetscInt i) const { return (inertia_ > 0 ? inertia_ : 1) * graph_->mass[static_cast<std::size_t>(i)]; }
  std::unique_ptr<const Graph> graph_;
  Places places_;
  int dim_ = 3;
  std::size_t area_ = 9, width_ = 4;
  PairPattern pattern_;
  HugeVector<double> node_;
  HugeVector<float> pair_, cut_;
  SparseBlocks remainder_;
  HugeVector<double> sums_;  ///< what rows of a product add to later ones, padded
  double inertia_ = 0;
  VecHandle free_;  ///< room: a vector without held components
  VecHandle ghost_values_;
  ScatterHandle scatter_;
};

}  // namespace bs
