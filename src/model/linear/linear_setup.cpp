// Reading a linear system, and what is to be known of it before the first step.
#include <cmath>
#include "base/fault.hpp"
#include "base/options.hpp"
#include "model/linear/direct.hpp"
#include "model/linear/linear_model.hpp"

namespace bs {

PetscErrorCode LinearModel::create(MPI_Comm comm, std::unique_ptr<Model>* out) {
  PetscFunctionBegin;
  auto model = std::make_unique<LinearModel>();
  PetscCall(model->read(comm));
  *out = std::move(model);
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::read(MPI_Comm comm) {
  SystemOptions options;
  PetscInt columns = 0;
  PetscBool help = PETSC_FALSE;
  PetscFunctionBegin;
  comm_ = comm;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-help", &help));
  PetscCall(read_section(comm, "Linear system G x + C x' = B u(t)", [&](Section& o) {
    options.read(o, help);
    sources_.options(o);
    o.flag("-bs_linear_dc", "start from the operating point: solve G x = B u at the start", dc_);
    o.integer("-bs_linear_be_steps", "steps at the start by backward Euler, before cn or theta: damps the ringing after a jump",
              startup_steps_, Range::nonnegative);
    if (dc_ && !options.x0.empty()) o.fail("options -bs_linear_dc and -bs_linear_x0: give one of them");
  }));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-ts_init_time", &start_, nullptr));
  PetscCall(load_system(comm, options, &system_));
  if (system_.B) PetscCall(MatGetSize(system_.B, nullptr, &columns));
  PetscCall(sources_.read(comm, columns, system_.source));
  if (system_.B) PetscCall(MatCreateVecs(system_.B, u_.out(), Bu_.out()));
  PetscCall(VecDuplicate(system_.x0, work_.out()));
  PetscCall(MatNorm(system_.G, NORM_INFINITY, &norm_G_));
  PetscCall(MatNorm(system_.C, NORM_INFINITY, &norm_C_));
  PetscCall(inspect_C());
  if (dc_) PetscCall(operating_point());
  PetscFunctionReturn(0);
}

/// Is C diagonal, is it symmetric, how many of its rows are empty?
PetscErrorCode LinearModel::inspect_C() {
  PetscInt first, last;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(system_.x0, diagonal_C_.out()));
  PetscCall(MatGetDiagonal(system_.C, diagonal_C_));
  PetscCall(MatGetOwnershipRange(system_.C, &first, &last));
  std::int64_t count[2] = {0, 0};  // entries off the diagonal, empty rows
  for (PetscInt i = first; i < last; ++i) {
    PetscInt n;
    const PetscInt* columns;
    const PetscScalar* values;
    bool empty = true;
    PetscCall(MatGetRow(system_.C, i, &n, &columns, &values));
    for (PetscInt k = 0; k < n; ++k) {
      if (values[k] != 0) empty = false;
      if (values[k] != 0 && columns[k] != i) ++count[0];
    }
    PetscCall(MatRestoreRow(system_.C, i, &n, &columns, &values));
    count[1] += empty;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPI_INT64_T, MPI_SUM, comm_));
  diagonal_ = symmetric_ = count[0] == 0;
  zero_rows_ = count[1];
  if (diagonal_) PetscFunctionReturn(0);
  // x'C y = y'C x for two vectors that share no direction with anything
  PetscRandom random;
  VecHandle x, y;
  PetscScalar a, b;
  PetscReal size;
  PetscCall(PetscRandomCreate(comm_, &random));
  PetscCall(VecDuplicate(system_.x0, x.out()));
  PetscCall(VecDuplicate(system_.x0, y.out()));
  PetscCall(VecSetRandom(x, random));
  PetscCall(VecSetRandom(y, random));
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(MatMult(system_.C, y, work_));
  PetscCall(VecDot(work_, x, &a));
  PetscCall(VecNorm(work_, NORM_2, &size));
  PetscCall(MatMult(system_.C, x, work_));
  PetscCall(VecDot(work_, y, &b));
  PetscReal length;
  PetscCall(VecNorm(x, NORM_2, &length));
  symmetric_ = std::abs(a - b) <= 1e-12 * size * length;
  PetscFunctionReturn(0);
}

// G x = B u(start)
PetscErrorCode LinearModel::operating_point() {
  KSPHandle ksp;
  bool singular = false;
  PetscFunctionBegin;
  PetscCall(create_direct(comm_, system_.G, "linear_dc_", ksp.out()));
  PetscCall(is_singular(ksp, &singular));
  if (singular)
    PetscCall(tell(comm_, Exit::input, "option -bs_linear_dc: G is singular, there is no operating point: give -bs_linear_x0 instead"));
  PetscCall(VecZeroEntries(work_));
  PetscCall(add_sources(start_, 1, work_));
  PetscCall(KSPSolve(ksp, work_, system_.x0));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::invert_C() {
  bool singular = false;
  PetscFunctionBegin;
  if (diagonal_ && zero_rows_ == 0) PetscFunctionReturn(0);
  if (zero_rows_ == 0) {
    PetscCall(create_direct(comm_, system_.C, "linear_c_", C_solver_.out()));
    PetscCall(is_singular(C_solver_, &singular));
  }
  if (zero_rows_ > 0 || singular)
    PetscCall(tell(comm_, Exit::input, "C is singular" + (zero_rows_ > 0 ? format(" (%lld empty rows)", static_cast<long long>(zero_rows_)) : std::string()) +
                   ": explicit types and arkimex need C^-1; use -ts_type beuler, cn, theta or bdf"));
  PetscFunctionReturn(0);
}

/// Where C has empty rows these are algebraic: G x = B u must hold in them at the start.
PetscErrorCode LinearModel::warn_inconsistent() {
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
  struct { double size; int row; } worst = {0, 0};
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
    PetscCall(warn(comm_, format("the initial state violates algebraic row %d by %g: the first steps jump, and cn keeps the violation with "
                                 "changing sign; give -bs_linear_dc, a consistent -bs_linear_x0, or -bs_linear_be_steps 1", worst.row, worst.size)));
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
                                 "%g 1/s): the solution will grow without bound; lower -ts_dt or take -ts_type beuler", plan.step,
                                 plan.real_stability / largest, largest)));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::prepare(const Plan& plan) {
  PetscFunctionBegin;
  const bool velocity = plan.implicit && plan.form == Form::velocity;
  if (!plan.implicit || velocity) PetscCall(invert_C());
  if (velocity && !diagonal_) PetscCall(tell(comm_, Exit::input, "-ts_type arkimex needs a diagonal C here: use bdf, cn or theta"));
  if (!plan.implicit && plan.real_stability > 0) PetscCall(warn_unstable(plan));
  if (plan.autonomous && !sources_.constant())
    PetscCall(warn(comm_, "this -ts_type loses its order where sources depend on time: its error may be larger than it says; use bdf or cn"));
  PetscCall(warn_inconsistent());
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::check_solver(KSP ksp) {
  bool singular = false;
  PetscFunctionBegin;
  PetscCall(is_singular(ksp, &singular));
  if (singular)
    PetscCall(tell(comm_, Exit::input, system_.origin + ": sigma C + G is singular to working precision at this step: the pencil (G, C) determines no solution "
                   "(a floating node, a loop of sources, an equation given twice?), or -ts_dt meets one of its eigenvalues"));
  PetscFunctionReturn(0);
}

}  // namespace bs
