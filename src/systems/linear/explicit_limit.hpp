// The largest step of an explicit method on x' = A x, by its stability polynomial and the eigenvalues of A.
#pragma once
#include <petscvec.h>
#include <complex>
#include <functional>
#include <vector>

namespace bs {

/// R(z): a step of h takes x' = lambda x to R(h lambda) x. Coefficients of 1, z, z^2, ...
using StabilityPolynomial = std::vector<double>;

std::complex<double> value(const StabilityPolynomial& R, std::complex<double> z);

/// Whether lambda lies on the imaginary axis, to rounding: an oscillation without damping.
bool undamped(std::complex<double> lambda);

/// The largest h with |R(h' lambda)| <= 1 for all 0 < h' <= h; 0 where no step is stable, infinity where no unstable step was found (lambda = 0). For
/// Re lambda <= 0 only: solutions that grow have no such limit.
double largest_step(const StabilityPolynomial& R, std::complex<double> lambda);

/// Collective. Eigenvalues of A, given by its product with a vector, by Arnoldi's method from a start that does not depend on the number of ranks:
/// all eigenvalues of systems of up to 100 unknowns, of larger ones the outer eigenvalues that are accurate to 5 %. `like` has A's layout.
PetscErrorCode outer_eigenvalues(Vec like, const std::function<PetscErrorCode(Vec, Vec)>& product, std::vector<std::complex<double>>* out);

}  // namespace bs
