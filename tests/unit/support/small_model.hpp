// A model of a few equations, the same on every rank, for tests of what steps and solves.
#pragma once
#include <petscmat.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "base/handle.hpp"
#include "systems/model.hpp"

namespace bs {

/// y' = G(t, y) of n numbers; F = y' - G in both forms. The Jacobian of G is found by differences unless slopes() is overridden.
class SmallModel : public Model {
 public:
  explicit SmallModel(const std::vector<double>& start, PetscInt block = 1) : n_(start.size()) {
    REQUIRE(VecCreateMPI(PETSC_COMM_WORLD, static_cast<PetscInt>(n_), PETSC_DETERMINE, start_.out()) == 0);
    REQUIRE(VecSetBlockSize(start_, block) == 0);
    set(start_, start);
  }
  static void set(Vec y, const std::vector<double>& values) {
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArray(y, &a) == 0);
    std::copy(values.begin(), values.end(), a);
    REQUIRE(VecRestoreArray(y, &a) == 0);
  }
  static std::vector<double> get(Vec y) {
    const PetscScalar* a = nullptr;
    PetscInt n = 0;
    REQUIRE(VecGetLocalSize(y, &n) == 0);
    REQUIRE(VecGetArrayRead(y, &a) == 0);
    std::vector<double> values(a, a + n);
    REQUIRE(VecRestoreArrayRead(y, &a) == 0);
    return values;
  }
  std::size_t size() const { return n_; }

  /// G(t, y)
  virtual std::vector<double> rates(double t, const std::vector<double>& y) const = 0;
  /// (n, n) dG/dy
  virtual std::vector<double> slopes(double t, const std::vector<double>& y) const {
    std::vector<double> J(n_ * n_);
    for (std::size_t c = 0; c < n_; ++c) {
      const double h = 1e-6 * std::max(1.0, std::abs(y[c]));
      std::vector<double> low = y, high = y;
      low[c] -= h, high[c] += h;
      const std::vector<double> a = rates(t, low), b = rates(t, high);
      for (std::size_t r = 0; r < n_; ++r) J[r * n_ + c] = (b[r] - a[r]) / (2 * h);
    }
    return J;
  }

  PetscErrorCode residual(double t, Vec y, Vec ydot, Form, Vec F) override {
    PetscFunctionBegin;
    PetscCall(VecCopy(ydot, F));
    std::vector<double> f = get(F);
    const std::vector<double> g = rates(t, get(y));
    for (std::size_t k = 0; k < n_; ++k) f[k] -= g[k];
    set(F, f);
    PetscFunctionReturn(0);
  }
  PetscErrorCode jacobian(double t, Vec y, Vec, double sigma, Form, Mat P) override {
    PetscInt first = 0;
    PetscFunctionBegin;
    const std::vector<double> J = slopes(t, get(y));
    PetscCall(MatGetOwnershipRange(P, &first, nullptr));
    for (std::size_t r = 0; r < n_; ++r)
      for (std::size_t c = 0; c < n_; ++c)
        PetscCall(
            MatSetValue(P, first + static_cast<PetscInt>(r), first + static_cast<PetscInt>(c), (r == c ? sigma : 0) - J[r * n_ + c], INSERT_VALUES));
    PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
    PetscFunctionReturn(0);
  }
  PetscErrorCode rhs(double t, Vec y, Vec G) override {
    PetscFunctionBegin;
    set(G, rates(t, get(y)));
    PetscFunctionReturn(0);
  }
  PetscErrorCode create_matrix(Mat* P) override {
    const PetscInt n = static_cast<PetscInt>(n_);
    PetscFunctionBegin;
    PetscCall(MatCreateAIJ(comm(), n, n, PETSC_DETERMINE, PETSC_DETERMINE, n, nullptr, 0, nullptr, P));
    PetscCall(jacobian(0, start_, start_, 1, Form::velocity, *P));
    PetscFunctionReturn(0);
  }
  PetscErrorCode create_operator(Mat P, Form, Mat* A) override {
    PetscFunctionBegin;
    PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(P)));
    *A = P;
    PetscFunctionReturn(0);
  }
  PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) override {
    PetscFunctionBegin;
    PetscCall(VecNorm(F, NORM_2, norms->data()));
    (*norms)[1] = 0;
    PetscFunctionReturn(0);
  }
  PetscErrorCode residual_floor(double, Vec, double, Form, ResidualNorms* floor) override {
    *floor = {1e-15, 0};
    return 0;
  }

  const char* name() const override { return "small"; }
  MPI_Comm comm() const override { return PETSC_COMM_WORLD; }
  Vec initial_state() const override { return start_; }
  std::vector<std::string> describe() const override { return {}; }
  PetscErrorCode observe(double, Vec, std::vector<Observable>*) override { return 0; }
  PetscErrorCode fields(double, Vec, std::vector<Field>*) override { return 0; }
  PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) override {
    PetscFunctionBegin;
    if (!gathered_) PetscCall(VecDuplicate(start_, gathered_.out()));
    PetscCall(VecCopy(y, gathered_));
    *parts = {{"y", gathered_}};
    PetscFunctionReturn(0);
  }
  PetscErrorCode scatter_state(Vec y) override {
    PetscFunctionBegin;
    PetscCall(VecCopy(gathered_, y));
    PetscFunctionReturn(0);
  }
  PetscErrorCode fingerprint(std::uint64_t* value) override {
    *value = n_;
    return 0;
  }
  PetscErrorCode take_constants(std::vector<Dataset>*) override { return 0; }
  PetscErrorCode covers(double, double) override { return 0; }
  PetscErrorCode last_fault(std::string* text) override {
    text->clear();
    return 0;
  }

 protected:
  std::size_t n_;
  VecHandle start_, gathered_;
};

}  // namespace bs
