// d-linear hat functions on a grid over points in space: the shares of a point in the nodes around it.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <vector>

namespace bs {

class HatGrid {
 public:
  /// Collective. The finest grid of about cubic cells that fill the box of the owned points, with at most `nodes` nodes; none if the points
  /// are all in one place. Where cells reached beyond the box, a node could move a single layer of points, whose pairs to the next one
  /// `continued_shares` leaves out. points: (n + ghosts, d), of which the first n are owned; `fixed`: those take no part.
  PetscErrorCode create(MPI_Comm comm, int dim, PetscInt n, const std::vector<double>& points, const std::vector<std::uint8_t>& fixed,
                        PetscInt nodes);
  PetscInt nodes() const { return nodes_; }
  /// Collective. Whether it has cells in three dimensions, and points in more than half of them.
  PetscErrorCode fills_space(MPI_Comm comm, bool* yes) const;
  /// Owned points that take part.
  PetscInt particles() const { return particles_; }
  /// The lowest node of the cell point i is in; -1: it takes no part.
  PetscInt cell(PetscInt i) const { return cell_[static_cast<std::size_t>(i)]; }
  /// The 2^d nodes of a cell are cell + offset[k].
  template <int d>
  void offsets(PetscInt* offset) const noexcept;
  /// Point i's shares in them, which sum to 1.
  template <int d>
  void shares(PetscInt i, double* share) const noexcept;
  /// Shares of point j in the corners of point i's cell, whose hats are continued beyond it; false where j is further from i
  /// than half a cell, in any direction.
  template <int d>
  bool continued_shares(PetscInt i, PetscInt j, double* share) const noexcept;
  /// By what the numbers of two nodes of one cell may differ, ascending from 0.
  std::vector<PetscInt> differences() const;

  /// coarse_a += sum_i Z_ia r_i and z_i += sum_a Z_ia coarse_a over the owned points; r, z: (n, d), coarse: (nodes, d)
  /// in rows of LANES<d>.
  template <int d>
  void restrict_to(const double* r, double* coarse) const noexcept;
  template <int d>
  void prolong(const double* coarse, double* z) const noexcept;

 private:
  void place(int dim, const std::vector<double>& points, const std::vector<std::uint8_t>& fixed, const double* low, const double* high);
  PetscInt n_ = 0, nodes_ = 0, particles_ = 0, count_[3] = {1, 1, 1};
  std::vector<std::int32_t> cell_;
  std::vector<float> fraction_;  ///< (n + ghosts, d): where in the cell, 0 to 1
};

}  // namespace bs
