// Whether the steps of an explicit method are stable on a linear system.
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/error.hpp"
#include "systems/linear/explicit_limit.hpp"
#include "systems/linear/linear_model.hpp"

namespace bs {

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
    PetscCall(warn(comm_, "no step of " + plan.method + " is stable on this system, which oscillates without damping" + of +
                              "an implicit type such as -ts_type cn, or -ts_type rk -ts_rk_type 4"));
  else
    PetscCall(
        warn(comm_, format("the step %g s is beyond the stability limit of %s on this system, about %.3g s", plan.step, plan.method.c_str(), least) +
                        of + format("-ts_dt %.2g, or an implicit type such as -ts_type beuler", 0.9 * least)));
  PetscFunctionReturn(0);
}

}  // namespace bs
