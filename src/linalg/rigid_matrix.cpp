#include <algorithm>
#include "linalg/rigid_space.hpp"

namespace bs {

namespace {

// Added to E's diagonal, relatively, where held components make motions of a group depend on each other: more than rounding, far less than
// the softest motion of all groups.
constexpr double DISTINCT = 1e-12;

/// What a rank needs of the ghosts, each of which is in one group at most: its global number, -1: none; the lever to its centre, its axes.
struct Ghosts {
  std::vector<double> group, lever, axes[3];
};

/// Collective. Rows of owned points, then of ghosts.
PetscErrorCode gather_ghosts(PairMatrix& S, const RigidMotions& motions, PetscInt first, Ghosts* out) {
  const std::size_t d = static_cast<std::size_t>(S.dim()), n = static_cast<std::size_t>(S.pattern().n);
  const Shares& shares = motions.shares();
  PetscFunctionBegin;
  out->group.assign(n * d, -1.0);
  out->lever.assign(n * d, 0.0);
  for (auto& axis : out->axes) axis.assign(n * d, 0.0);
  for (const PetscInt i : S.boundary()) {
    if (shares.start[i] == shares.start[i + 1]) continue;
    const PetscInt group = shares.group[shares.start[i]];
    const std::size_t at = static_cast<std::size_t>(i) * d;
    out->group[at] = static_cast<double>(first + group);
    for (std::size_t c = 0; c < d; ++c) {
      out->lever[at + c] = motions.point(i)[c] - motions.centre(group)[c];
      for (std::size_t k = 0; k < 3; ++k) out->axes[k][at + c] = motions.axes(group)[3 * k + c];
    }
  }
  PetscCall(S.append_ghosts(&out->group));
  PetscCall(S.append_ghosts(&out->lever));
  for (std::size_t k = 0; k < (d == 3 ? 3U : d == 2 ? 1U : 0U); ++k) PetscCall(S.append_ghosts(&out->axes[k]));
  PetscFunctionReturn(0);
}

template <int d>
class Assembly {
 public:
  static constexpr int width = rigid_width(d), AREA = width * width;
  /// The columns of Z at a point, or their difference between two, by global group.
  struct Columns {
    int count = 0;
    PetscInt group[2 * Shares::MOST];
    double z[2 * Shares::MOST][d * width];
    void copy(const Columns& from) noexcept {
      count = from.count;
      std::copy_n(from.group, count, group);
      std::copy_n(from.z[0], count * d * width, z[0]);
    }
    void add(PetscInt a, const double* from, double sign) noexcept {
      int at = 0;
      while (at < count && group[at] != a) ++at;
      if (at == count) {
        group[count++] = a;
        std::fill_n(z[at], d * width, 0.0);
      }
      for (int k = 0; k < d * width; ++k) z[at][k] += sign * from[k];
    }
  };

  Assembly(const Graph& graph, const RigidMotions& motions, PetscInt first)
      : graph_(graph), motions_(motions), first_(first), rows_(static_cast<std::size_t>(motions.groups())) {
    blocks_.assign(rows_.size() * AREA, 0.0);
    for (std::size_t a = 0; a < rows_.size(); ++a) rows_[a].push_back({first + static_cast<PetscInt>(a), a});
  }

  // E_ab = sum_i Z_ia^T A_i Z_ib + sum_ij (Z_ia - Z_ja)^T B_ij (Z_ib - Z_jb),  i and j not fixed
  void sum(const PairMatrix& S, const Ghosts& ghosts) {
    const PairPattern& pattern = S.pattern();
    Columns own, both;
    for (PetscInt i = 0; i < pattern.n; ++i) {
      own.count = 0;
      add_columns(i, 1, &own);
      if (own.count == 0) continue;
      add_blocks(own, S.node(i), own);
      for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) {
        both.copy(own);
        add_columns(pattern.other[k], -1, &both);
        add_pair(S.pair(static_cast<std::size_t>(k)), both);
      }
    }
    for (std::size_t r = 0; r < pattern.cut_row.size(); ++r) {
      own.count = 0;
      add_columns(pattern.cut_row[r], 1, &own);
      for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1] && own.count > 0; ++k) {
        both.copy(own);
        add_ghost(ghosts, pattern.n + pattern.ghost[k], -1, &both);
        add_pair(S.cut(static_cast<std::size_t>(k)), both);
      }
    }
    if (S.remainder().created()) add_remainder(S, ghosts);
  }

  /// Collective.
  PetscErrorCode write(MPI_Comm comm, Mat* E) {
    const PetscInt groups = static_cast<PetscInt>(rows_.size()), last = first_ + groups;
    std::vector<PetscInt> inside(rows_.size(), 0), outside(rows_.size(), 0);
    PetscFunctionBegin;
    PetscCall(PetscLogFlops(flops_));
    mirror();
    for (std::size_t a = 0; a < rows_.size(); ++a)
      for (const Entry& e : rows_[a]) ++(e.column >= first_ && e.column < last ? inside : outside)[a];
    PetscCall(MatCreate(comm, E));
    PetscCall(MatSetSizes(*E, groups * width, groups * width, PETSC_DETERMINE, PETSC_DETERMINE));
    PetscCall(MatSetType(*E, MATAIJ));
    PetscCall(MatSetBlockSize(*E, width));
    PetscCall(MatXAIJSetPreallocation(*E, width, inside.data(), outside.data(), nullptr, nullptr));
    for (std::size_t a = 0; a < rows_.size(); ++a) {
      const PetscInt row = first_ + static_cast<PetscInt>(a);
      for (const Entry& e : rows_[a]) {
        double* block = blocks_.data() + e.block * AREA;
        for (int c = 0; c < width && e.column == row; ++c)
          block[c * (width + 1)] = block[c * (width + 1)] == 0 ? 1 : (1 + DISTINCT) * block[c * (width + 1)];
        PetscCall(MatSetValuesBlocked(*E, 1, &row, 1, &e.column, block, INSERT_VALUES));
      }
    }
    PetscCall(MatAssemblyBegin(*E, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(*E, MAT_FINAL_ASSEMBLY));
    PetscCall(MatSetOption(*E, MAT_SYMMETRIC, PETSC_TRUE));
    PetscFunctionReturn(0);
  }

 private:
  struct Entry {
    PetscInt column;
    std::size_t block;
  };

  void add_columns(PetscInt i, double sign, Columns* to) const noexcept {
    const Shares& shares = motions_.shares();
    double z[d * width];
    for (PetscInt k = shares.start[i]; k < shares.start[i + 1]; ++k) {
      motions_.columns<d>(i, shares.group[k], z);
      hold(i, z);
      to->add(first_ + shares.group[k], z, sign * static_cast<double>(shares.share[k]));
    }
  }
  void add_ghost(const Ghosts& ghosts, PetscInt j, double sign, Columns* to) const noexcept {
    const std::size_t at = static_cast<std::size_t>(j) * d;
    double axes[9] = {}, z[d * width];
    if (ghosts.group[at] < 0) return;
    for (std::size_t k = 0; k < 3 && d > 1; ++k)
      for (std::size_t c = 0; c < d; ++c)
        if (k == 0 || d == 3) axes[3 * k + c] = ghosts.axes[k][at + c];
    RigidMotions::rigid_columns<d>(ghosts.lever.data() + at, axes, z);
    hold(j, z);
    to->add(static_cast<PetscInt>(ghosts.group[at]), z, sign);
  }

  void hold(PetscInt i, double* z) const noexcept {
    const std::uint8_t mask = graph_.mask(i);
    for (int c = 0; c < d; ++c)
      if (mask >> c & 1) std::fill_n(z + c * width, width, 0.0);
  }

  // E_ab += sum_ij Z_ia^T R_ij Z_jb
  void add_remainder(const PairMatrix& S, const Ghosts& ghosts) {
    const PetscInt n = S.pattern().n;
    Columns own, other;
    for (PetscInt i = 0; i < n; ++i) {
      own.count = 0;
      add_columns(i, 1, &own);
      if (own.count == 0) continue;
      S.remainder().for_row(i, [&](PetscInt j, const double* R) {
        other.count = 0;
        if (j < n) add_columns(j, 1, &other);
        else add_ghost(ghosts, j, 1, &other);
        add_blocks(own, R, other);
      });
    }
  }

  /// Null: a row of another rank.
  double* block(PetscInt group, PetscInt column) {
    if (group < first_ || group >= first_ + static_cast<PetscInt>(rows_.size())) return nullptr;
    std::vector<Entry>& row = rows_[static_cast<std::size_t>(group - first_)];
    for (const Entry& e : row)
      if (e.column == column) return blocks_.data() + e.block * AREA;
    row.push_back({column, blocks_.size() / AREA});
    blocks_.resize(blocks_.size() + AREA, 0.0);
    return blocks_.data() + row.back().block * AREA;
  }

  /// E_ab += Z_a^T B Z_b for a <= b of this rank, and for b of other ranks; Z_a: of `rows`, Z_b: of `columns`.
  void add_blocks(const Columns& rows, const double* B, const Columns& columns) {
    flops_ += 2.0 * d * d * width * columns.count;
    for (int q = 0; q < columns.count; ++q) {
      const double* zb = columns.z[q];
      const PetscInt b = columns.group[q];
      double Bz[d * width] = {};
      for (int r = 0; r < d; ++r)
        for (int k = 0; k < d; ++k)
          for (int c = 0; c < width; ++c) Bz[r * width + c] += B[r * d + k] * zb[k * width + c];
      for (int p = 0; p < rows.count; ++p) {
        if (b < rows.group[p] && b >= first_) continue;
        const double* za = rows.z[p];
        double* to = block(rows.group[p], b);
        if (to) flops_ += 2.0 * d * width * width;
        for (int u = 0; u < width && to; ++u)
          for (int c = 0; c < width; ++c) {
            double sum = 0;
            for (int k = 0; k < d; ++k) sum += za[k * width + u] * Bz[k * width + c];
            to[u * width + c] += sum;
          }
      }
    }
  }

  // B = t I + w w^T
  void add_pair(const float* pair, const Columns& columns) {
    double B[d * d];
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        B[r * d + c] = static_cast<double>(pair[r]) * static_cast<double>(pair[c]) + (r == c ? static_cast<double>(pair[d]) : 0);
    add_blocks(columns, B, columns);
  }

  /// Blocks below the diagonal from those above it, of this rank's groups.
  void mirror() {
    const PetscInt last = first_ + static_cast<PetscInt>(rows_.size());
    for (std::size_t a = 0; a < rows_.size(); ++a) {
      const PetscInt row = first_ + static_cast<PetscInt>(a);
      const std::vector<Entry> entries = rows_[a];
      for (const Entry& e : entries) {
        if (e.column <= row || e.column >= last) continue;
        double* to = block(e.column, row);
        const double* from = blocks_.data() + e.block * AREA;
        for (int r = 0; r < width; ++r)
          for (int c = 0; c < width; ++c) to[c * width + r] = from[r * width + c];
      }
    }
  }

  const Graph& graph_;
  const RigidMotions& motions_;
  double flops_ = 0;
  PetscInt first_;
  std::vector<std::vector<Entry>> rows_;  ///< per group, the diagonal first
  std::vector<double> blocks_;
};

template <int d>
PetscErrorCode assemble(PairMatrix& S, const RigidMotions& motions, PetscInt first, const Ghosts& ghosts, Mat* E) {
  PetscFunctionBegin;
  Assembly<d> assembly(S.graph(), motions, first);
  assembly.sum(S, ghosts);
  PetscCall(assembly.write(S.graph().comm, E));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode create_coarse_matrix(PairMatrix& S, const RigidMotions& motions, Mat* E) {
  PetscInt first = 0, groups = motions.groups();
  Ghosts ghosts;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Exscan(&groups, &first, 1, MPIU_INT, MPI_SUM, S.graph().comm));
  PetscCall(gather_ghosts(S, motions, first, &ghosts));
  if (S.dim() == 1) PetscCall(assemble<1>(S, motions, first, ghosts, E));
  else if (S.dim() == 2) PetscCall(assemble<2>(S, motions, first, ghosts, E));
  else PetscCall(assemble<3>(S, motions, first, ghosts, E));
  PetscFunctionReturn(0);
}

}  // namespace bs
