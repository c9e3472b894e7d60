// Translations and rotations of groups of points that overlap: the columns of a coarse space Z. A group has `width` unknowns, d
// translations first; with its shares s_ia in groups a point moves by
//   z_i = sum_a s_ia (T_a + sum_k w_ak q_ak x (x_i - c_a))
// q_ak: the principal axes of the group, of length 1/(its radius about them); an axis that no point is off has q = 0.
#pragma once
#include <petscsys.h>
#include <algorithm>
#include <cstdint>
#include <vector>
#include "linalg/pair_matrix.hpp"

namespace bs {

/// Shares of owned points in groups, which sum to 1 for each that has any: compressed rows.
struct Shares {
  static constexpr int MOST = 8;  ///< of one point
  std::vector<PetscInt> start;
  std::vector<std::int32_t> group;
  std::vector<float> share;
};

/// Groups of a rank's free points that a coarse space moves as rigid bodies: compact, connected by pairs, of about equal size.
/// Groups overlap: a point near the edge of its own has shares in those beside it, so that what the groups move by passes into each
/// other smoothly. They depend on the start and the pattern alone.
class RigidGroups {
 public:
  /// Of about `size` points each, by halving the free points across their longest extent at the start, then apart where no pair
  /// connects. `steps` of blending make them overlap. Points tied to no other free one are in no group.
  void create(const PairMatrix& S, PetscInt size, int steps);
  PetscInt count() const { return count_; }
  const Shares& shares() const { return shares_; }

 private:
  void part(const PairMatrix& S, PetscInt size);
  void connect(const PairMatrix& S, PetscInt least);
  void blend(const PairMatrix& S, int steps);
  PetscInt count_ = 0;
  std::vector<std::int32_t> of_;  ///< the group of each owned point; -1: none
  Shares shares_;
};

/// Unknowns of a rigid body in d dimensions: 1, 3, 6.
inline constexpr int rigid_width(int d) { return d * (d + 1) / 2; }

class RigidMotions {
 public:
  /// Collective. Where S's points are at present. `groups`, of this rank, must outlive the object.
  PetscErrorCode create(PairMatrix& S, const RigidGroups& groups);
  int dim() const { return dim_; }
  /// Of all ranks; and the number of this rank's first.
  PetscInt groups() const { return total_; }
  PetscInt first() const { return first_; }
  /// Of owned points in this rank's groups.
  const Shares& shares() const { return groups_->shares(); }
  /// The group of all ranks' a ghost is in, alone; -1: none.
  PetscInt group_of_ghost(PetscInt ghost) const { return ghost_group_[static_cast<std::size_t>(ghost)]; }
  const double* point(PetscInt i) const { return points_.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(dim_); }
  /// Z_ia / s_ia of a local point and a group of all ranks', d x width, row-major.
  template <int d>
  void columns(PetscInt i, PetscInt a, double* z) const noexcept {
    constexpr int width = rigid_width(d);
    const double *x = point(i), *c = centre(a), *q = axes(a);
    double r[d];
    for (int k = 0; k < d; ++k) r[k] = x[k] - c[k];
    for (int k = 0; k < d * width; ++k) z[k] = 0;
    for (int k = 0; k < d; ++k) z[k * width + k] = 1;
    if constexpr (d == 2) {
      z[2] = -q[0] * r[1];
      z[width + 2] = q[0] * r[0];
    }
    if constexpr (d == 3)
      for (int k = 0; k < 3; ++k, q += 3) {
        z[3 + k] = q[1] * r[2] - q[2] * r[1];
        z[width + 3 + k] = q[2] * r[0] - q[0] * r[2];
        z[2 * width + 3 + k] = q[0] * r[1] - q[1] * r[0];
      }
  }

  /// coarse = Z^T r of this rank's groups and z += Z coarse over the owned points; r, z: (n, d), coarse: (groups, width).
  void restrict_to(const double* r, double* coarse) const;
  void prolong(const double* coarse, double* z) const;

 private:
  template <int d>
  void restrict_of(const double* r, double* coarse) const;
  template <int d>
  void prolong_of(const double* coarse, double* z) const;
  const double* centre(PetscInt a) const { return frame_.data() + a * FRAME; }
  /// q_k (3 x 3, rows k) of a group; in two dimensions its first number.
  const double* axes(PetscInt a) const { return centre(a) + 3; }
  static constexpr PetscInt FRAME = 12;
  int dim_ = 3;
  PetscInt first_ = 0, total_ = 0;
  const RigidGroups* groups_ = nullptr;
  std::vector<double> points_;         ///< (n + ghosts, d)
  std::vector<double> frame_;          ///< (groups, FRAME): centre, axes
  std::vector<PetscInt> ghost_group_;  ///< (ghosts)
  mutable std::vector<double> whole_;  ///< (groups of this rank, 8): force and moment about the origin, or velocity there and spin
};

/// Rigid motions as Galerkin wants them; blocks of E are width x width.
template <int d>
class RigidColumns {
 public:
  static constexpr int width = rigid_width(d);
  static constexpr double MULTIPLY = 2 * d * d * width, ADD = 2 * d * width * width;
  struct Columns {
    static constexpr int MOST = 2 * Shares::MOST;
    int count = 0;
    PetscInt node[MOST];
    double z[MOST][d * width];
  };
  struct Product {
    double numbers[d * width];
  };
  RigidColumns(const RigidMotions& motions, const Graph& graph) : motions_(motions), graph_(graph) {}
  void columns(PetscInt i, double sign, Columns* to) const noexcept {
    const Shares& shares = motions_.shares();
    if (i >= graph_.n) {
      const PetscInt a = motions_.group_of_ghost(i - graph_.n);
      if (a >= 0) add_group(i, a, sign, to);
      return;
    }
    for (PetscInt k = shares.start[i]; k < shares.start[i + 1]; ++k)
      add_group(i, motions_.first() + shares.group[k], sign * static_cast<double>(shares.share[k]), to);
  }
  void difference(PetscInt, PetscInt j, const Columns& own, bool, Columns* both) const noexcept {
    both->count = own.count;
    std::copy_n(own.node, own.count, both->node);
    std::copy_n(own.z[0], own.count * d * width, both->z[0]);
    columns(j, -1, both);
  }
  static void multiply(const double* B, const Columns& c, int q, Product* Bz) noexcept {
    std::fill_n(Bz->numbers, d * width, 0.0);
    for (int r = 0; r < d; ++r)
      for (int k = 0; k < d; ++k)
        for (int u = 0; u < width; ++u) Bz->numbers[r * width + u] += B[r * d + k] * c.z[q][k * width + u];
  }
  static void add(const Columns& c, int p, const Product& Bz, double* to) noexcept {
    for (int u = 0; u < width; ++u)
      for (int v = 0; v < width; ++v) {
        double sum = 0;
        for (int k = 0; k < d; ++k) sum += c.z[p][k * width + u] * Bz.numbers[k * width + v];
        to[u * width + v] += sum;
      }
  }

 private:
  void add_group(PetscInt i, PetscInt a, double part, Columns* to) const noexcept {
    const std::uint8_t mask = graph_.mask(i);
    double z[d * width];
    motions_.columns<d>(i, a, z);
    const int at = static_cast<int>(std::find(to->node, to->node + to->count, a) - to->node);
    if (at == to->count) {
      to->node[to->count++] = a;
      std::fill_n(to->z[at], d * width, 0.0);
    }
    for (int k = 0; k < d * width; ++k)
      if (!(mask >> k / width & 1)) to->z[at][k] += part * z[k];
  }
  const RigidMotions& motions_;
  const Graph& graph_;
};

}  // namespace bs
