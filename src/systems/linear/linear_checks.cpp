// What is to be known of a linear system with the method that is to step it, before the first step.
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "systems/linear/direct.hpp"
#include "systems/linear/linear_model.hpp"
#include "systems/linear/system.hpp"

namespace bs {

namespace {

/// What a method does to a violated algebraic equation, and what to give instead.
std::string what_becomes_of_it(const Plan& plan, std::int64_t startup) {
  const bool sign = plan.type == "cn" || plan.type == "theta";
  std::string text = startup > 0         ? "the first step, by backward Euler, jumps"
                     : plan.type == "cn" ? "the first steps jump, and cn keeps the violation with changing sign"
                     : plan.type == "theta"
                         ? "the first steps jump, and theta carries the violation on with changing sign, by (theta - 1)/theta a step"
                         : "the first step jumps";
  text += "; give -bs_linear_dc or a consistent -bs_linear_x0";
  return sign && startup == 0 ? text + ", or -bs_linear_be_steps 1" : text;
}

}  // namespace

/// Where C has empty rows these are algebraic: G x = B u must hold in them at the start.
PetscErrorCode LinearModel::warn_inconsistent(const Plan& plan) {
  PetscInt first, last;
  const PetscScalar* ar;
  PetscFunctionBegin;
  if (zero_rows_ == 0) PetscFunctionReturn(0);
  VecHandle r;
  PetscReal size;
  PetscCall(VecDuplicate(system_.x0, r.out()));
  PetscCall(MatMult(system_.G, system_.x0, r));
  PetscCall(VecNorm(system_.x0, NORM_INFINITY, &size));
  double scale = norm_G_ * size;
  PetscCall(add_sources(start_, -1, r));
  if (system_.B) {
    PetscCall(VecNorm(Bu_, NORM_INFINITY, &size));
    scale = std::max(scale, size);
  }
  PetscCall(VecGetOwnershipRange(r, &first, &last));
  PetscCall(VecGetArrayRead(r, &ar));
  struct {
    double size;
    int row;
  } worst = {0, 0};
  for (PetscInt i = first; i < last; ++i) {
    PetscInt n;
    const PetscScalar* values;
    bool empty = true;
    PetscCall(MatGetRow(system_.C, i, &n, nullptr, &values));
    for (PetscInt k = 0; k < n; ++k) empty = empty && values[k] == 0;
    PetscCall(MatRestoreRow(system_.C, i, &n, nullptr, &values));
    if (empty && std::abs(ar[i - first]) > worst.size) worst = {std::abs(ar[i - first]), static_cast<int>(i + 1)};
  }
  PetscCall(VecRestoreArrayRead(r, &ar));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, comm_));
  if (worst.size > 1e-10 * scale)
    PetscCall(
        warn(comm_, format("the initial state violates algebraic row %d by %g: ", worst.row, worst.size) + what_becomes_of_it(plan, startup_steps_)));
  PetscFunctionReturn(0);
}

/// The largest |lambda| of C^-1 G by power iterations.
PetscErrorCode LinearModel::warn_unstable(const Plan& plan) {
  PetscRandom random;
  PetscReal size = 0;
  PetscFunctionBegin;
  VecHandle x, y;
  PetscCall(VecDuplicate(system_.x0, x.out()));
  PetscCall(VecDuplicate(system_.x0, y.out()));
  PetscCall(PetscRandomCreate(comm_, &random));
  PetscCall(VecSetRandom(x, random));
  PetscCall(PetscRandomDestroy(&random));
  double product = 0;
  constexpr int ITERATIONS = 40, COUNTED = 20;
  for (int k = 0; k < ITERATIONS; ++k) {
    PetscCall(VecNormalize(x, &size));
    if (k >= ITERATIONS - COUNTED && size > 0) product += std::log(size) / COUNTED;
    PetscCall(MatMult(system_.G, x, y));
    PetscCall(apply_inverse_C(y));
    PetscCall(VecCopy(y, x));
  }
  const double largest = size > 0 ? std::exp(product) : 0.0;
  if (plan.step * largest > plan.real_stability)
    PetscCall(warn(comm_, format("the step %g s is beyond the stability limit of forward Euler, about %g s (largest eigenvalue of C^-1 G: about "
                                 "%g 1/s): the solution will grow without bound; lower -ts_dt or take -ts_type beuler",
                                 plan.step, plan.real_stability / largest, largest)));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::prepare(const Plan& plan) {
  PetscFunctionBegin;
  const bool velocity = plan.implicit && plan.form == Form::velocity;
  if (!plan.implicit || velocity || !plan.descriptor) PetscCall(invert_C(plan));
  if (velocity && !diagonal_) PetscCall(fail(comm_, Exit::input, plan.method + " needs a diagonal C here: use bdf, cn or theta"));
  if (!plan.implicit && plan.real_stability > 0) PetscCall(warn_unstable(plan));
  PetscCall(warn_inconsistent(plan));
  type_ = plan.type;
  may_grow_ = !plan.any_step;
  PetscFunctionReturn(0);
}

/// Index 2 or more: parts of x are derivatives of u, which no method here was made for.
PetscErrorCode LinearModel::warn_index() {
  PencilIndex index;
  PetscFunctionBegin;
  PetscCall(find_index(system_.G, system_.C, &index));
  if (!index.higher) PetscFunctionReturn(0);
  std::string where;
  for (std::size_t k = 0; k < index.rows.size(); ++k)
    where += (k == 0                       ? index.rows.size() > 1 ? ", rows " : ", row "
              : k + 1 == index.rows.size() ? " and "
                                           : ", ") +
             std::to_string(static_cast<long long>(index.rows[k]) + 1);
  const bool serves = type_ == "beuler" || type_ == "bdf";
  PetscCall(warn(comm_, "the system is of index 2 or more: some algebraic equations do not determine their unknowns" + where +
                            " (a cut-set of inductors, or a loop of capacitors and voltage sources?), which are then derivatives of the sources; " +
                            (serves ? type_ + " needs a constant step for these, and its first steps are wrong in them"
                                    : type_ + " loses its order in these, or rings: take beuler or bdf at a constant step") +
                            ", or reduce the index, by a small resistance in the loop or across the cut-set"));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::check_solver(KSP ksp) {
  bool singular = false;
  PetscFunctionBegin;
  if (ksp) PetscCall(is_singular(ksp, &singular));
  if (singular)
    PetscCall(fail(comm_, Exit::input,
                   system_.origin + ": sigma C + G is singular to working precision at this step: the pencil (G, C) determines no solution "
                                    "(a floating node, a loop of sources, a duplicate equation?), or -ts_dt meets one of its eigenvalues"));
  if (ksp) PetscCall(require_solver(ksp, ""));
  PetscCall(warn_index());
  PetscFunctionReturn(0);
}

}  // namespace bs
