// S = sigma M - D - K/sigma of a spring lattice, kept spring by spring in single precision:
//   (S z)_i = A_i z_i + sum over linked pairs (i,j) of B_ij (z_i - z_j) + sum_j R_ij z_j,   B_ij = t I + w w^T
// A pair takes d + 1 numbers: t acts across it, w along it. Their rounding changes each spring's tangent by 6e-8 of itself,
// however stiff its neighbours are, and the matrix stays symmetric; A_i (mass, drag, anchors, springs to fixed particles)
// is double. Products are summed in double. R holds what interactions of more than two ends add, d x d blocks in double; it takes
// no memory where there are none.
#pragma once
#include <petscmat.h>
#include <vector>
#include "base/arrays.hpp"
#include "base/handle.hpp"
#include "network/network.hpp"
#include "systems/particles/interactions/sparse_blocks.hpp"

namespace bs {

class LocalState;

/// Which pairs of free particles are linked, each owned pair once, at its lower end.
struct SpringPattern {
  HugeVector<PetscInt> start, other;                ///< owned pairs (i, j > i): compressed rows (n + 1), (pairs)
  std::vector<PetscInt> cut_row, cut_start, ghost;  ///< pairs cut by the rank boundary: rows that have any, their ghosts (from 0)
  PetscInt n = 0, ghosts = 0;
  void create(const Network& net);
  std::size_t pairs() const { return other.size(); }
};

class SpringMatrix {
 public:
  /// Collective. `net` must outlive the object. Values are zero.
  PetscErrorCode create(const Network& net);
  int dim() const { return dim_; }
  const SpringPattern& pattern() const { return pattern_; }
  const Network& network() const { return *net_; }

  /// The values: (w, t) of pair k in the pattern's order, the symmetric A_i (d x d) of particle i.
  double* node(PetscInt i) { return node_.data() + static_cast<std::size_t>(i) * area_; }
  float* pair(std::size_t k) { return pair_.data() + k * width_; }
  float* cut(std::size_t k) { return cut_.data() + k * width_; }
  const double* node(PetscInt i) const { return node_.data() + static_cast<std::size_t>(i) * area_; }
  const float* pair(std::size_t k) const { return pair_.data() + k * width_; }
  const float* cut(std::size_t k) const { return cut_.data() + k * width_; }
  /// Trace of B = t I + w w^T of pair k, without t's multiplicity.
  double pair_size(std::size_t k) const { return size_of(pair(k)); }
  double cut_size(std::size_t k) const { return size_of(cut(k)); }
  void zero();
  /// R, not created where there is none.
  SparseBlocks& remainder() { return remainder_; }
  const SparseBlocks& remainder() const { return remainder_; }

  /// What the positions that S is made of are read from; borrowed.
  void set_state(const LocalState* state) { state_ = state; }
  /// Where the owned particles are in that state, (n, d).
  std::vector<double> positions() const;

  /// a of a M - b D - c K: what held components of rollers keep on the diagonal; their rows and columns are 0 otherwise.
  void set_inertia(double a) { inertia_ = a; }
  /// Makes rows and columns of held components 0 in the block between owned particle i and local particle j.
  void hold_block(PetscInt i, PetscInt j, double* block) const;
  /// Collective. y = S p; vectors of block size d, laid out like the owned particles.
  PetscErrorCode multiply(Vec p, Vec y);
  /// The diagonal block of particle i: A_i + sum B_ij + R_ii, d x d.
  void diagonal_blocks(std::vector<double>* out) const;
  PetscErrorCode diagonal(Vec out) const;
  /// Collective. Of the sizes of these diagonal blocks, the largest over the smallest, without those of fixed particles; infinite where one is 0.
  PetscErrorCode size_ratio(const std::vector<double>& blocks, double* ratio) const;
  /// Collective. A MATSHELL that multiplies by this object, which must outlive it; `from` finds it again.
  PetscErrorCode create_shell(Mat* out);
  static SpringMatrix* from(Mat A);
  /// Collective. Appends the ghosts' numbers to the owned particles', (n, d).
  PetscErrorCode append_ghosts(std::vector<double>* values);
  /// Collective. The ghosts' numbers of p, (ghosts, d), and what ghosts add to y at their owners.
  PetscErrorCode fetch_ghosts(Vec p, std::vector<double>* ghosts);
  PetscErrorCode add_ghosts(const std::vector<double>& ghosts, Vec y);
  /// Collective. A vector the matrix acts on.
  PetscErrorCode create_vector(Vec* out) const;

 private:
  PetscErrorCode hold_product(Vec p, Vec y) const;
  double size_of(const float* numbers) const {
    double sum = static_cast<double>(numbers[dim_]);
    for (int c = 0; c < dim_; ++c) sum += static_cast<double>(numbers[c]) * static_cast<double>(numbers[c]);
    return sum;
  }
  const Network* net_ = nullptr;
  const LocalState* state_ = nullptr;
  int dim_ = 3;
  std::size_t area_ = 9, width_ = 4;
  SpringPattern pattern_;
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
