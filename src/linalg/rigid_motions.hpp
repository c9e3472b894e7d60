// Translations and rotations of groups of points that overlap: the columns of a coarse space Z. A group has `width` unknowns, d
// translations first; with its shares s_ia in groups a point moves by
//   z_i = sum_a s_ia (T_a + sum_k w_ak q_ak x (x_i - c_a))
// q_ak: the principal axes of the group, of length 1/(its radius about them); an axis that no point is off has q = 0.
#pragma once
#include <petscsys.h>
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
  /// points: (n, d) where points are. `groups` must outlive the object.
  void create(int dim, const std::vector<double>& points, const RigidGroups& groups);
  int dim() const { return dim_; }
  PetscInt groups() const { return groups_->count(); }
  PetscInt unknowns() const { return groups() * rigid_width(dim_); }
  const Shares& shares() const { return groups_->shares(); }
  const double* point(PetscInt i) const { return points_.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(dim_); }
  const double* centre(PetscInt a) const { return centre_.data() + static_cast<std::size_t>(a) * static_cast<std::size_t>(dim_); }
  /// q_k (3 x 3, rows k) of a group; in two dimensions its first number.
  const double* axes(PetscInt a) const { return axes_.data() + static_cast<std::size_t>(a) * 9; }
  /// Z_ia / s_ia, d x width, row-major.
  template <int d>
  void columns(PetscInt i, PetscInt a, double* z) const noexcept {
    const std::size_t at = static_cast<std::size_t>(i) * d, group = static_cast<std::size_t>(a);
    double lever[d];
    for (int c = 0; c < d; ++c) lever[c] = points_[at + c] - centre_[group * d + c];
    rigid_columns<d>(lever, axes_.data() + group * 9, z);
  }
  /// The same of any point, at r [m] from the centre of a group with these axes.
  template <int d>
  static void rigid_columns(const double* r, const double* axes, double* z) noexcept {
    constexpr int width = rigid_width(d);
    for (int k = 0; k < d * width; ++k) z[k] = 0;
    for (int c = 0; c < d; ++c) z[c * width + c] = 1;
    if constexpr (d == 2) {
      z[2] = -axes[0] * r[1];
      z[width + 2] = axes[0] * r[0];
    }
    if constexpr (d == 3)
      for (int k = 0; k < 3; ++k) {
        const double* q = axes + 3 * k;
        z[3 + k] = q[1] * r[2] - q[2] * r[1];
        z[width + 3 + k] = q[2] * r[0] - q[0] * r[2];
        z[2 * width + 3 + k] = q[0] * r[1] - q[1] * r[0];
      }
  }

  /// coarse = Z^T r and z += Z coarse over the owned points; r, z: (n, d), coarse: (groups, width).
  void restrict_to(const double* r, double* coarse) const;
  void prolong(const double* coarse, double* z) const;

 private:
  template <int d>
  void restrict_of(const double* r, double* coarse) const;
  template <int d>
  void prolong_of(const double* coarse, double* z) const;
  int dim_ = 3;
  const RigidGroups* groups_ = nullptr;
  std::vector<double> points_, centre_, axes_;
  mutable std::vector<double> whole_;  ///< (groups, 8): force and moment about the origin, or velocity there and spin
};

}  // namespace bs
