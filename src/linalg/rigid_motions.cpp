#include "linalg/rigid_motions.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/dimension.hpp"
#include "linalg/lanes.hpp"

namespace bs {

namespace {

/// Rows q_k / radius_k of the principal axes of J = sum (|r|^2 I - r r^T) over `count` points; zero where the radius is nothing.
void principal_axes(const double* J, double count, double* axes) {
  constexpr double NOTHING = 1e-7;  // of the largest squared radius
  double A[9], lambda[3] = {0, 0, 0}, work[32];
  PetscBLASInt three = 3, length = 32, info = 0;
  std::copy_n(J, 9, A);
  LAPACKsyev_("V", "U", &three, A, &three, lambda, work, &length, &info);
  for (int k = 0; k < 3; ++k) {
    const bool some = info == 0 && lambda[k] > NOTHING * lambda[2] && lambda[k] > 0;
    for (int c = 0; c < 3; ++c) axes[3 * k + c] = some ? A[3 * k + c] / std::sqrt(lambda[k] / count) : 0;
  }
}

}  // namespace

PetscErrorCode RigidMotions::create(PairMatrix& S, const RigidGroups& groups) {
  const Shares& shares = groups.shares();
  const std::size_t d = static_cast<std::size_t>(S.dim()), n = static_cast<std::size_t>(S.pattern().n),
                    own = static_cast<std::size_t>(groups.count());
  std::vector<double> count(own, 0.0), inertia(own * 9, 0.0), group_of(n * d, -1.0);
  PetscInt here = groups.count();
  PetscFunctionBegin;
  dim_ = S.dim();
  groups_ = &groups;
  points_ = S.positions();
  first_ = 0;
  PetscCallMPI(MPI_Exscan(&here, &first_, 1, MPIU_INT, MPI_SUM, S.graph().comm));
  PetscCall(MPIU_Allreduce(&here, &total_, 1, MPIU_INT, MPI_SUM, S.graph().comm));
  frame_.assign(static_cast<std::size_t>(total_ * FRAME), 0.0);
  const auto frame = [this](std::size_t a) { return frame_.data() + (static_cast<std::size_t>(first_) + a) * FRAME; };
  const auto each = [&](auto use) {
    for (std::size_t i = 0; i < n; ++i)
      for (PetscInt k = shares.start[i]; k < shares.start[i + 1]; ++k)
        use(i, static_cast<std::size_t>(shares.group[k]), static_cast<double>(shares.share[k]));
  };
  each([&](std::size_t i, std::size_t a, double share) {
    count[a] += share;
    for (std::size_t c = 0; c < d; ++c) frame(a)[c] += share * points_[i * d + c];
  });
  for (std::size_t a = 0; a < own; ++a)
    for (std::size_t c = 0; c < d; ++c) frame(a)[c] /= count[a];
  each([&](std::size_t i, std::size_t a, double share) {
    double r[3] = {0, 0, 0}, square = 0;
    for (std::size_t c = 0; c < d; ++c) {
      r[c] = points_[i * d + c] - frame(a)[c];
      square += r[c] * r[c];
    }
    for (int p = 0; p < 3; ++p)
      for (int q = 0; q < 3; ++q) inertia[a * 9 + 3 * p + q] += share * ((p == q ? square : 0) - r[p] * r[q]);
  });
  for (std::size_t a = 0; a < own; ++a) {
    const double* J = inertia.data() + a * 9;
    if (dim_ == 3) principal_axes(J, count[a], frame(a) + 3);
    if (dim_ == 2) frame(a)[3] = J[8] > 0 ? std::sqrt(count[a] / J[8]) : 0;
  }
  whole_.assign(own * 8, 0.0);
  PetscCall(sum_over_ranks(S.graph().comm, frame_.data(), frame_.size()));
  for (std::size_t i = 0; i < n; ++i)
    if (shares.start[i] < shares.start[i + 1]) group_of[i * d] = static_cast<double>(first_ + shares.group[shares.start[i]]);
  PetscCall(S.append_ghosts(&group_of));
  PetscCall(S.append_ghosts(&points_));
  ghost_group_.clear();
  for (std::size_t k = n * d; k < group_of.size(); k += d) ghost_group_.push_back(static_cast<PetscInt>(group_of[k]));
  PetscFunctionReturn(0);
}

// force and moment about the origin, then about each group's centre: m - c x f
template <int d>
void RigidMotions::restrict_of(const double* r, double* coarse) const {
  typedef typename lanes::Register<double, 4>::type Four;
  constexpr int width = rigid_width(d);
  const Shares& shares = groups_->shares();
  std::fill(whole_.begin(), whole_.end(), 0.0);
  const PetscInt n = static_cast<PetscInt>(shares.start.size()) - 1;
  for (PetscInt i = 0; i < n; ++i) {
    const double *f = r + i * d, *x = point(i);
    Four force = {}, moment = {};
    for (int c = 0; c < d; ++c) force[c] = f[c];
    if constexpr (d == 2) moment[2] = x[0] * f[1] - x[1] * f[0];
    if constexpr (d == 3) {
      moment[0] = x[1] * f[2] - x[2] * f[1];
      moment[1] = x[2] * f[0] - x[0] * f[2];
      moment[2] = x[0] * f[1] - x[1] * f[0];
    }
    for (PetscInt k = shares.start[i]; k < shares.start[i + 1]; ++k) {
      double* to = whole_.data() + static_cast<std::size_t>(shares.group[k]) * 8;
      const double s = static_cast<double>(shares.share[k]);
      const Four share = {s, s, s, s};
      Four sum;
      std::memcpy(&sum, to, sizeof sum);
      sum += share * force;
      std::memcpy(to, &sum, sizeof sum);
      if constexpr (d > 1) {
        std::memcpy(&sum, to + 4, sizeof sum);
        sum += share * moment;
        std::memcpy(to + 4, &sum, sizeof sum);
      }
    }
  }
  for (PetscInt a = 0; a < groups_->count(); ++a) {
    const double *f = whole_.data() + a * 8, *m = f + 4, *q = axes(first_ + a), *c = centre(first_ + a);
    double* to = coarse + (first_ + a) * width;
    std::copy_n(f, d, to);
    if constexpr (d == 2) to[2] = q[0] * (m[2] - (c[0] * f[1] - c[1] * f[0]));
    if constexpr (d == 3) {
      const double about[3] = {m[0] - (c[1] * f[2] - c[2] * f[1]), m[1] - (c[2] * f[0] - c[0] * f[2]), m[2] - (c[0] * f[1] - c[1] * f[0])};
      for (int k = 0; k < 3; ++k) to[3 + k] = q[3 * k] * about[0] + q[3 * k + 1] * about[1] + q[3 * k + 2] * about[2];
    }
  }
}

// velocity at the origin T - w x c and spin w, summed over the groups of a point
template <int d>
void RigidMotions::prolong_of(const double* coarse, double* z) const {
  typedef typename lanes::Register<double, 4>::type Four;
  constexpr int width = rigid_width(d);
  const Shares& shares = groups_->shares();
  for (PetscInt a = 0; a < groups_->count(); ++a) {
    const double *from = coarse + (first_ + a) * width, *q = axes(first_ + a), *c = centre(first_ + a);
    double *v = whole_.data() + a * 8, *w = v + 4;
    std::copy_n(from, d, v);
    if constexpr (d == 2) {
      w[2] = q[0] * from[2];
      v[0] += w[2] * c[1];
      v[1] -= w[2] * c[0];
    }
    if constexpr (d == 3) {
      for (int k = 0; k < 3; ++k) w[k] = q[k] * from[3] + q[3 + k] * from[4] + q[6 + k] * from[5];
      v[0] -= w[1] * c[2] - w[2] * c[1];
      v[1] -= w[2] * c[0] - w[0] * c[2];
      v[2] -= w[0] * c[1] - w[1] * c[0];
    }
  }
  const PetscInt n = static_cast<PetscInt>(shares.start.size()) - 1;
  for (PetscInt i = 0; i < n; ++i) {
    Four v = {}, w = {};
    for (PetscInt k = shares.start[i]; k < shares.start[i + 1]; ++k) {
      const double *from = whole_.data() + static_cast<std::size_t>(shares.group[k]) * 8, s = static_cast<double>(shares.share[k]);
      const Four share = {s, s, s, s};
      Four part;
      std::memcpy(&part, from, sizeof part);
      v += share * part;
      if constexpr (d > 1) {
        std::memcpy(&part, from + 4, sizeof part);
        w += share * part;
      }
    }
    double* to = z + i * d;
    const double* x = point(i);
    if constexpr (d == 1) to[0] += v[0];
    if constexpr (d == 2) {
      to[0] += v[0] - w[2] * x[1];
      to[1] += v[1] + w[2] * x[0];
    }
    if constexpr (d == 3) {
      to[0] += v[0] + w[1] * x[2] - w[2] * x[1];
      to[1] += v[1] + w[2] * x[0] - w[0] * x[2];
      to[2] += v[2] + w[0] * x[1] - w[1] * x[0];
    }
  }
}

void RigidMotions::restrict_to(const double* r, double* coarse) const {
  with_dimension(dim_, [&](auto d) { restrict_of<d>(r, coarse); });
}

void RigidMotions::prolong(const double* coarse, double* z) const {
  with_dimension(dim_, [&](auto d) { prolong_of<d>(coarse, z); });
}

}  // namespace bs
