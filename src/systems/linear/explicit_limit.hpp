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

/// Whether lambda lies on the imaginary axis but for rounding: an oscillation without damping.
bool undamped(std::complex<double> lambda);

/// The largest h up to which |R(h lambda)| <= 1; 0: no step is stable, infinity: none was found that is not (lambda = 0). Not of growth, Re lambda >
/// 0.
double largest_step(const StabilityPolynomial& R, std::complex<double> lambda);

/// Collective. Eigenvalues of A, given by its product, by Arnoldi's method from a start that does not depend on the ranks: all of small systems (100
/// unknowns), of others the outer ones that it has found to 5 %. `like` has A's layout.
PetscErrorCode outer_eigenvalues(Vec like, const std::function<PetscErrorCode(Vec, Vec)>& product, std::vector<std::complex<double>>* out);

}  // namespace bs
