#include "systems/linear/explicit_limit.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/hash.hpp"
#include "base/vec_array.hpp"
#include "systems/linear/linear_model.hpp"

namespace bs {

namespace {

constexpr double rounding = 1e-14;

/// On the imaginary axis: whether |R(i y)|^2 - 1 = sum of c_k y^(2k) begins with a positive term.
bool grows_at_once(const StabilityPolynomial& R) {
  const std::size_t n = R.size();
  for (std::size_t power = 2; power <= 2 * (n - 1); power += 2) {
    double c = 0;
    for (std::size_t j = power >= n ? power - n + 1 : 0; j <= std::min(power, n - 1); ++j) {
      const std::size_t k = power - j;  // (i y)^j (-i y)^k = i^(j - k) y^(j + k), j - k even
      c += ((j + 4 * n - k) / 2 % 2 == 0 ? 1.0 : -1.0) * R[j] * R[k];
    }
    if (std::abs(c) > 1e-9) return c > 0;
  }
  return false;
}

/// Eigenvalues of the (m, m) Hessenberg matrix H, by columns of `rows` numbers, and by `last` |the last component| of their normed vectors.
PetscErrorCode eigenvalues_of(const std::vector<double>& H, int rows, int m, std::vector<std::complex<double>>* values, std::vector<double>* last) {
  const std::size_t n = static_cast<std::size_t>(m);
  std::vector<double> a(n * n), re(n), im(n), right(n * n), work(8 * n);
  PetscBLASInt order = m, room = 8 * m, info = 0, one = 1;
  double none = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < n; ++k)
    std::copy_n(H.begin() + static_cast<std::ptrdiff_t>(k) * rows, n, a.begin() + static_cast<std::ptrdiff_t>(k * n));
  PetscCallBLAS("LAPACKgeev",
                LAPACKgeev_("N", "V", &order, a.data(), &order, re.data(), im.data(), &none, &one, right.data(), &order, work.data(), &room, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's geev failed");
  for (std::size_t k = 0; k < n; ++k) {
    const bool first = im[k] > 0;  // of a pair: its vector is v_k + i v_{k+1}
    values->emplace_back(re[k], im[k]);
    const std::size_t j = im[k] < 0 ? k - 1 : k;
    last->push_back(im[k] == 0 && !first ? std::abs(right[k * n + n - 1]) : std::hypot(right[j * n + n - 1], right[(j + 1) * n + n - 1]));
  }
  PetscFunctionReturn(0);
}

/// Numbers between -1 and 1 by the rows of the whole.
PetscErrorCode fill_start(Vec x) {
  PetscInt first, last;
  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(x, &first, &last));
  const WriteArray to(x);
  for (PetscInt i = first; i < last; ++i) to[i - first] = 2 * hash_uniform(0, Stream::start, i, 0) - 1;
  PetscFunctionReturn(0);
}

}  // namespace

std::complex<double> value(const StabilityPolynomial& R, std::complex<double> z) {
  std::complex<double> sum = 0;
  for (auto c = R.rbegin(); c != R.rend(); ++c) sum = *c + z * sum;
  return sum;
}

bool undamped(std::complex<double> lambda) { return std::abs(lambda.real()) <= 1e-8 * std::abs(lambda); }

double largest_step(const StabilityPolynomial& R, std::complex<double> lambda) {
  constexpr double STEP = 1e-3, FAR = 100;  // of |h lambda|
  const double size = std::abs(lambda);
  if (!(size > 0)) return std::numeric_limits<double>::infinity();
  const std::complex<double> way = undamped(lambda) ? std::complex<double>(0, std::copysign(1, lambda.imag())) : lambda / size;
  if (undamped(lambda) && grows_at_once(R)) return 0;
  const auto stable = [&](double z) { return std::abs(value(R, z * way)) <= 1 + rounding; };
  double in = 0, out = STEP;
  while (in < FAR && stable(out)) {
    in = out;
    out += STEP;
  }
  if (in >= FAR) return std::numeric_limits<double>::infinity();
  for (int k = 0; k < 60; ++k) (stable(0.5 * (in + out)) ? in : out) = 0.5 * (in + out);
  return in / size;
}

PetscErrorCode outer_eigenvalues(Vec like, const std::function<PetscErrorCode(Vec, Vec)>& product, std::vector<std::complex<double>>* out) {
  constexpr PetscInt MOST = 100;
  constexpr double FOUND = 0.05, NUMBERS = 2e7;  // of the basis
  PetscInt n;
  PetscReal size;
  PetscFunctionBegin;
  out->clear();
  PetscCall(VecGetSize(like, &n));
  const PetscInt most = std::min({n, MOST, std::max<PetscInt>(30, static_cast<PetscInt>(NUMBERS / static_cast<double>(n)))}), rows = most + 1;
  std::vector<VecHandle> basis(1);
  std::vector<double> H(static_cast<std::size_t>(rows * most), 0.0);
  VecHandle w;
  PetscCall(VecDuplicate(like, w.out()));
  PetscCall(VecDuplicate(like, basis[0].out()));
  PetscCall(fill_start(basis[0]));
  PetscCall(VecNormalize(basis[0], &size));
  PetscInt m = 0;
  double left = 0;  // what H lacks: |w| behind the last column
  for (bool on = true; on && m < most; ++m) {
    PetscCall(product(basis[static_cast<std::size_t>(m)], w));
    PetscCall(VecNorm(w, NORM_2, &size));
    const double whole = size;
    for (int twice = 0; twice < 2; ++twice)
      for (PetscInt k = 0; k <= m; ++k) {
        PetscScalar part;
        PetscCall(VecDot(w, basis[static_cast<std::size_t>(k)], &part));
        PetscCall(VecAXPY(w, -part, basis[static_cast<std::size_t>(k)]));
        H[static_cast<std::size_t>(m * rows + k)] += part;
      }
    PetscCall(VecNorm(w, NORM_2, &left));
    on = left > 1e-13 * whole && m + 1 < most;
    if (m + 1 == n || !(left > 1e-13 * whole)) left = 0;  // the basis holds all that the start has a part of
    if (!on) continue;
    H[static_cast<std::size_t>(m * rows + m + 1)] = left;
    basis.emplace_back();
    PetscCall(VecDuplicate(like, basis.back().out()));
    PetscCall(VecCopy(w, basis.back()));
    PetscCall(VecScale(basis.back(), 1 / left));
  }
  std::vector<std::complex<double>> values;
  std::vector<double> last;
  PetscCall(eigenvalues_of(H, static_cast<int>(rows), static_cast<int>(m), &values, &last));
  for (std::size_t k = 0; k < values.size(); ++k)
    if (left * last[k] <= FOUND * std::abs(values[k])) out->push_back(values[k]);
  PetscFunctionReturn(0);
}

/// Eigenvalues in words: "-200 1/s", "-3 +- 40i 1/s".
static std::string in_words(std::complex<double> lambda) {
  if (std::abs(lambda.imag()) <= 1e-8 * std::abs(lambda)) return format("%.3g 1/s", lambda.real());
  return (undamped(lambda) ? std::string() : format("%.3g ", lambda.real())) + format("+- %.3gi 1/s", std::abs(lambda.imag()));
}

/// An explicit type by the eigenvalues lambda of -C^-1 G that do not grow by themselves: the one of which h is furthest out of the region |R(h
/// lambda)| <= 1.
PetscErrorCode LinearModel::warn_unstable(const Plan& plan) {
  constexpr double HARMLESS = 0.01;  // growth over the whole run
  std::vector<std::complex<double>> eigenvalues;
  std::complex<double> worst = 0;
  double growth = 0, least = std::numeric_limits<double>::infinity();
  PetscFunctionBegin;
  PetscCall(outer_eigenvalues(
      system_.x0,
      [this](Vec x, Vec y) {
        PetscFunctionBegin;
        PetscCall(MatMult(system_.G, x, y));
        PetscCall(apply_inverse_C(y));
        PetscCall(VecScale(y, -1));
        PetscFunctionReturn(0);
      },
      &eigenvalues));
  for (const std::complex<double>& lambda : eigenvalues) {
    if (lambda.real() > 0 && !undamped(lambda)) continue;
    const double by = plan.steps * std::log(std::abs(value(plan.polynomial, plan.step * lambda)));
    if (by > HARMLESS) least = std::min(least, largest_step(plan.polynomial, lambda));
    if (by > std::max(growth, HARMLESS)) {
      growth = by;
      worst = lambda;
    }
  }
  if (growth == 0) PetscFunctionReturn(0);
  const std::string of = " (eigenvalue of -C^-1 G: about " + in_words(worst) + "): the solution will grow without bound; take ";
  if (least == 0)
    PetscCall(warn(comm_, "step_limit",
                   "no step of " + plan.method + " is stable on this system, which oscillates without damping" + of +
                       "an implicit type such as -ts_type cn, or -ts_type rk -ts_rk_type 4"));
  else
    PetscCall(warn(comm_, "step_limit",
                   format("the step %g s is beyond the stability limit of %s on this system, about %.3g s", plan.step, plan.method.c_str(), least) +
                       of + format("-ts_dt %.2g, or an implicit type such as -ts_type beuler", 0.9 * least)));
  PetscFunctionReturn(0);
}

}  // namespace bs
