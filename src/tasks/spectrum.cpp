#include "tasks/spectrum.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/hash.hpp"
#include "systems/mechanics.hpp"

namespace bs {
namespace {

using Values = std::vector<double>;

/// The symmetric operators M^-1/2 K M^-1/2 and M^-1/2 D M^-1/2, by differences of forces about one state.
class Operators {
 public:
  enum Kind { stiffness = 0, damping = 1 };
  explicit Operators(Mechanics& mechanics) : mechanics_(mechanics), at_(mechanics.layout()) {}
  /// Collective. Masses and forces at y; y must outlive the object.
  PetscErrorCode create(double t, Vec y);
  /// Collective. w = A q; both of length rows().
  PetscErrorCode apply(Kind kind, const Values& q, Values* w);
  PetscErrorCode dot(const Values& a, const Values& b, double* sum) const;
  /// M^1/2 times the velocity.
  Values motion() const;
  /// A vector of random directions that depends on where the particles are, not on their numbers or ranks.
  Values start() const;
  std::size_t rows() const { return force_.size(); }
  int evaluations() const { return evaluations_; }
  /// Collective. That the quickest evaluation took, on the slowest rank [s].
  PetscErrorCode quickest(double* seconds) const;
  /// Velocities are varied on the scale of `omega` times the lengths.
  void set_rate(double omega) { rate_ = omega; }

 private:
  PetscErrorCode forces(Vec y, Values* f);
  PetscErrorCode largest(const Values& a, double* size) const;

  Mechanics& mechanics_;
  const Layout at_;
  double t_ = 0, length_ = 1, speed_ = 0, rate_ = 1;
  Vec y_ = nullptr;
  VecHandle trial_;
  Values force_, root_;  ///< (n, d) forces at y; (n, d) sqrt(m)
  Values position_, velocity_;
  int evaluations_ = 0;
  double seconds_ = std::numeric_limits<double>::max();
};

PetscErrorCode Operators::largest(const Values& a, double* size) const {
  PetscFunctionBegin;
  *size = 0;
  for (double value : a) *size = std::max(*size, std::abs(value));
  PetscCall(max_over_ranks(mechanics_.comm(), size));
  PetscFunctionReturn(0);
}

PetscErrorCode Operators::forces(Vec y, Values* f) {
  const double* force = nullptr;
  const double start = MPI_Wtime();
  PetscFunctionBegin;
  PetscCall(mechanics_.force(t_, y, &force));
  seconds_ = std::min(seconds_, MPI_Wtime() - start);
  ++evaluations_;
  f->assign(force, force + rows());
  PetscFunctionReturn(0);
}

PetscErrorCode Operators::create(double t, Vec y) {
  const PetscScalar* ay = nullptr;
  PetscFunctionBegin;
  t_ = t;
  y_ = y;
  for (Values* v : {&force_, &root_, &position_, &velocity_}) v->assign(static_cast<std::size_t>(at_.particles * at_.dim), 0.0);
  PetscCall(VecDuplicate(y, trial_.out()));
  PetscCall(VecGetArrayRead(y, &ay));
  for (PetscInt i = 0, k = 0; i < at_.particles; ++i)
    for (PetscInt c = 0; c < at_.dim; ++c, ++k) {
      position_[k] = ay[at_.x(i, c)];
      velocity_[k] = ay[at_.v(i, c)];
      root_[k] = std::sqrt(mechanics_.masses()[i]);
    }
  PetscCall(VecRestoreArrayRead(y, &ay));
  PetscCall(forces(y, &force_));
  PetscCall(largest(position_, &length_));
  PetscCall(largest(velocity_, &speed_));
  if (length_ == 0) length_ = 1;
  PetscFunctionReturn(0);
}

// A q = -M^-1/2 (f(y + e p) - f(y)) / e with p = M^-1/2 q among the positions or the velocities. The largest entry of
// e p is 1e-7 of the lengths (speeds): rounding and curvature then both stay below 1e-4 of the product.
PetscErrorCode Operators::apply(Kind kind, const Values& q, Values* w) {
  constexpr double SMALL = 1e-7;
  PetscScalar* a = nullptr;
  double size = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < q.size(); ++k) (*w)[k] = root_[k] > 0 ? q[k] / root_[k] : 0.0;
  PetscCall(largest(*w, &size));
  const double scale = kind == stiffness ? length_ : std::max(speed_, rate_ * length_);
  const double e = size > 0 ? SMALL * scale / size : 0.0;
  PetscCall(VecCopy(y_, trial_));
  PetscCall(VecGetArray(trial_, &a));
  for (PetscInt i = 0, k = 0; i < at_.particles; ++i)
    for (PetscInt c = 0; c < at_.dim; ++c, ++k) a[kind == stiffness ? at_.x(i, c) : at_.v(i, c)] += e * (*w)[k];
  PetscCall(VecRestoreArray(trial_, &a));
  PetscCall(forces(trial_, w));
  for (std::size_t k = 0; k < q.size(); ++k) (*w)[k] = root_[k] > 0 && e > 0 ? (force_[k] - (*w)[k]) / (e * root_[k]) : 0.0;
  PetscFunctionReturn(0);
}

PetscErrorCode Operators::quickest(double* seconds) const {
  PetscFunctionBegin;
  *seconds = seconds_;
  PetscCall(max_over_ranks(mechanics_.comm(), seconds));
  PetscFunctionReturn(0);
}

PetscErrorCode Operators::dot(const Values& a, const Values& b, double* sum) const {
  PetscFunctionBegin;
  *sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) *sum += a[k] * b[k];
  PetscCall(sum_over_ranks(mechanics_.comm(), sum));
  PetscFunctionReturn(0);
}

Values Operators::motion() const {
  Values q(rows());
  for (std::size_t k = 0; k < q.size(); ++k) q[k] = root_[k] * velocity_[k];
  return q;
}

Values Operators::start() const {
  Values q(rows());
  for (std::size_t i = 0; i < rows(); i += static_cast<std::size_t>(at_.dim)) {
    std::uint64_t bits = 0, z = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(at_.dim); ++c) {
      std::memcpy(&bits, &position_[i + c], sizeof bits);
      z = splitmix64(z + bits);
    }
    for (std::size_t c = 0; c < static_cast<std::size_t>(at_.dim); ++c) {
      z = splitmix64(z);
      q[i + c] = static_cast<double>(z >> 11) * 0x1p-52 - 1;
    }
  }
  return q;
}

/// Largest eigenvalue of the Lanczos process' tridiagonal matrix, and the last entry of its eigenvector.
PetscErrorCode top_of_tridiagonal(const Values& diagonal, const Values& beside, double* value, double* last) {
  Values d = diagonal, e = beside, z(d.size() * d.size()), work(2 * d.size() + 2);
  PetscBLASInt n = static_cast<PetscBLASInt>(d.size()), info = 0;
  PetscFunctionBegin;
  PetscCallBLAS("LAPACKsteqr", LAPACKsteqr_("I", &n, d.data(), e.data(), z.data(), &n, work.data(), &info));
  *value = info == 0 ? d.back() : 0.0;
  *last = std::abs(z.back());
  PetscFunctionReturn(0);
}

/// Lanczos: the largest eigenvalue from below, and a bound of its error. `q` is the start, overwritten.
PetscErrorCode largest_eigenvalue(Operators& A, Operators::Kind kind, int steps, Values q, double* ritz, double* error) {
  constexpr double CLOSE = 1e-3;
  Values before(q.size()), w(q.size()), alpha, beta;
  double norm = 0;
  PetscFunctionBegin;
  *ritz = *error = 0;
  PetscCall(A.dot(q, q, &norm));
  if (!(norm > 0)) PetscFunctionReturn(0);
  norm = std::sqrt(norm);
  for (double& value : q) value /= norm;
  for (int k = 0; k < steps; ++k) {
    double a = 0, b = 0, last = 0;
    PetscCall(A.apply(kind, q, &w));
    PetscCall(A.dot(q, w, &a));
    for (std::size_t i = 0; i < q.size(); ++i) w[i] -= a * q[i] + (k > 0 ? beta.back() * before[i] : 0.0);
    PetscCall(A.dot(w, w, &b));
    b = std::sqrt(b);
    if (!std::isfinite(a) || !std::isfinite(b)) {
      *ritz = *error = 0;
      PetscFunctionReturn(0);
    }
    alpha.push_back(a);
    beta.push_back(b);
    PetscCall(top_of_tridiagonal(alpha, beta, ritz, &last));
    *error = b * last;
    if (*error <= CLOSE * *ritz || b == 0 || (k == 0 && a == 0 && b == 0)) break;
    std::swap(before, q);
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = w[i] / b;
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode estimate_spectrum(Mechanics& mechanics, double t, Vec y, Spectrum* out) {
  constexpr int STIFFNESS = 10, DAMPING = 3;
  constexpr double NOTHING = 1e-6;  // of omega_max: below differences' accuracy
  Operators A(mechanics);
  double ritz = 0, error = 0, norm = 0, product = 0;
  PetscFunctionBegin;
  *out = {};
  PetscCall(A.create(t, y));
  PetscCall(largest_eigenvalue(A, Operators::stiffness, STIFFNESS, A.start(), &ritz, &error));
  out->omega_ritz = std::sqrt(std::max(0.0, ritz));
  if (ritz > 0) out->omega_max = std::sqrt(ritz + error);
  if (out->omega_max > 0) A.set_rate(out->omega_max);
  PetscCall(largest_eigenvalue(A, Operators::damping, DAMPING, A.start(), &ritz, &error));
  if (ritz + error > NOTHING * out->omega_max) out->damping = ritz + error;
  const Values q = A.motion();
  Values w(A.rows());
  PetscCall(A.dot(q, q, &norm));
  if (norm > 0 && out->omega_max > 0) {
    PetscCall(A.apply(Operators::stiffness, q, &w));
    PetscCall(A.dot(q, w, &product));
    if (product > 0) out->motion = std::sqrt(product / norm);
  }
  out->evaluations = A.evaluations();
  PetscCall(A.quickest(&out->seconds));
  PetscFunctionReturn(0);
}

}  // namespace bs
