// Limits of explicit methods along rays, against closed forms; eigenvalues by Arnoldi's method against those that matrices were made of.
#include "systems/linear/explicit_limit.hpp"
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/vec_array.hpp"

using namespace bs;

namespace {

const StabilityPolynomial EULER = {1, 1}, RK2 = {1, 1, 0.5}, RK3 = {1, 1, 0.5, 1.0 / 6}, RK4 = {1, 1, 0.5, 1.0 / 6, 1.0 / 24};

/// Blocks of two rows [[a, b], [-b, a]], eigenvalues a +- i b, block k with a_k, b_k.
struct Spirals {
  std::vector<double> a, b;
  PetscErrorCode operator()(Vec x, Vec y) const {
    PetscInt first, last;
    PetscFunctionBegin;
    PetscCall(VecGetOwnershipRange(x, &first, &last));
    const ReadArray from(x);
    const WriteArray to(y);
    for (PetscInt i = 0; i < last - first; i += 2) {
      const std::size_t k = static_cast<std::size_t>((first + i) / 2);
      to[i] = a[k] * from[i] + b[k] * from[i + 1];
      to[i + 1] = a[k] * from[i + 1] - b[k] * from[i];
    }
    PetscFunctionReturn(0);
  }
};

/// A vector whose ranks hold whole blocks.
VecHandle blocks(std::size_t count) {
  VecHandle x;
  PetscInt mine = PETSC_DECIDE, total = static_cast<PetscInt>(count);
  REQUIRE(PetscSplitOwnership(PETSC_COMM_WORLD, &mine, &total) == 0);
  REQUIRE(VecCreate(PETSC_COMM_WORLD, x.out()) == 0);
  REQUIRE(VecSetSizes(x, 2 * mine, 2 * total) == 0);
  REQUIRE(VecSetType(x, VECSTANDARD) == 0);
  return x;
}

}  // namespace

TEST_CASE("forward Euler along rays: h = -2 Re(lambda)/|lambda|^2, and none on the imaginary axis") {
  for (const double size : {1e-3, 1.0, 4e7})
    for (const double angle : {M_PI, 0.75 * M_PI, 0.6 * M_PI, 0.5001 * M_PI, -0.75 * M_PI}) {
      const std::complex<double> lambda = std::polar(size, angle);
      REQUIRE(largest_step(EULER, lambda) == Approx(-2 * lambda.real() / std::norm(lambda)).epsilon(1e-6));
    }
  REQUIRE(largest_step(EULER, {0, 3}) == 0);
  REQUIRE(largest_step(EULER, {-1e-12, 3}) == 0);
  REQUIRE(std::isinf(largest_step(EULER, 0)));
}

TEST_CASE("Runge-Kutta polynomials on the axes") {
  REQUIRE(largest_step(RK4, {0, 2}) == Approx(std::sqrt(2.0)).epsilon(1e-9));   // |R(iy)|^2 = 1 - y^6/72 + y^8/576
  REQUIRE(largest_step(RK3, {0, -1}) == Approx(std::sqrt(3.0)).epsilon(1e-9));  // |R(iy)|^2 = 1 - y^4/12 + y^6/36
  REQUIRE(largest_step(RK2, {0, 1}) == 0);                                      // |R(iy)|^2 = 1 + y^4/4
  REQUIRE(largest_step(RK2, -1) == Approx(2).epsilon(1e-9));
  REQUIRE(largest_step(RK3, -1) == Approx(2.5127453266).epsilon(1e-9));
  REQUIRE(largest_step(RK4, -10) == Approx(0.27852935634).epsilon(1e-9));
}

TEST_CASE("the step on any ray is where the region ends") {
  for (const StabilityPolynomial& R : {EULER, RK2, RK3, RK4})
    for (int k = 1; k < 20; ++k) {
      const std::complex<double> lambda = std::polar(5.0, M_PI / 2 + k * M_PI / 40);
      const double h = largest_step(R, lambda);
      REQUIRE(std::abs(value(R, 0.999 * h * lambda)) < 1);
      REQUIRE(std::abs(value(R, 1.001 * h * lambda)) > 1);
    }
}

TEST_CASE("eigenvalues by Arnoldi's method") {
  Spirals A;
  for (int k = 0; k < 20; ++k) {
    A.a.push_back(-0.1 * k);
    A.b.push_back(1 + k);
  }
  std::vector<std::complex<double>> found;
  REQUIRE(outer_eigenvalues(blocks(20), A, &found) == 0);
  REQUIRE(found.size() == 40);
  for (std::size_t k = 0; k < 20; ++k)
    for (const double sign : {-1.0, 1.0})
      REQUIRE(std::any_of(found.begin(), found.end(),
                          [&](std::complex<double> v) { return std::abs(v - std::complex<double>(A.a[k], sign * A.b[k])) < 1e-8; }));
  A = {};  // more than are kept: the outermost pair lies apart
  for (int k = 0; k < 400; ++k) {
    A.a.push_back(k == 399 ? -50 : -1 - 0.01 * k);
    A.b.push_back(k == 399 ? 60 : 0.01 * k);
  }
  REQUIRE(outer_eigenvalues(blocks(400), A, &found) == 0);
  REQUIRE(std::any_of(found.begin(), found.end(), [](std::complex<double> v) { return std::abs(v - std::complex<double>(-50, 60)) < 1e-6; }));
  for (const std::complex<double>& v : found) {
    double off = 1e9;
    for (std::size_t k = 0; k < 400; ++k) off = std::min(off, std::abs(v - std::complex<double>(A.a[k], std::copysign(A.b[k], v.imag()))));
    REQUIRE(off <= 0.05 * std::abs(v));
  }
}

TEST_CASE("eigenvalues of a system whose start is soon exhausted") {
  Spirals A{std::vector<double>(30, -2.0), std::vector<double>(30, 0.0)};  // -2 I
  std::vector<std::complex<double>> found;
  REQUIRE(outer_eigenvalues(blocks(30), A, &found) == 0);
  REQUIRE(found.size() == 1);
  REQUIRE(std::abs(found[0] + 2.0) < 1e-12);
  A.a.assign(30, 0.0);  // nothing moves
  REQUIRE(outer_eigenvalues(blocks(30), A, &found) == 0);
  REQUIRE((found.size() == 1 && found[0] == 0.0));
}
