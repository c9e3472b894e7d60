#include "systems/linear/linear_model.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/memory.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "base/petsc_versions.hpp"
#include "base/rounding.hpp"
#include "systems/linear/system.hpp"

namespace bs {

// B u(t) lives in Bu_ until the next call.
// Where u jumps from u- to u+ at the end of a step of a constant length, methods that count this time alike in both steps keep their order 2 with
// (u- + u+)/2: the trapezoidal rule's errors h (u+ - u-)/4 of the two steps cancel. A run starts after a jump, not within it.
PetscErrorCode LinearModel::set_sources(double t) {
  PetscInt first, last;
  PetscScalar* au;
  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(u_, &first, &last));
  PetscCall(VecGetArrayWrite(u_, &au));
  const Side side = sides_.at(t);
  for (PetscInt k = first; k < last; ++k) {
    const auto column = static_cast<std::size_t>(k);
    au[k - first] = side == Side::left ? sources_.before(column, t) : sources_.at(column, t);
    if (side == Side::mean) au[k - first] = 0.5 * (au[k - first] + sources_.before(column, t));
  }
  PetscCall(VecRestoreArrayWrite(u_, &au));
  PetscCall(MatMult(system_.B, u_, Bu_));
  PetscFunctionReturn(0);
}

/// F += scale B u(t)
PetscErrorCode LinearModel::add_sources(double t, double scale, Vec F) {
  PetscFunctionBegin;
  if (!system_.B) PetscFunctionReturn(0);
  PetscCall(set_sources(t));
  PetscCall(VecAXPY(F, scale, Bu_));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::apply_inverse_C(Vec x) {
  PetscFunctionBegin;
  if (diagonal_) {
    PetscCall(VecPointwiseDivide(x, x, diagonal_C_));
  } else {
    PetscCall(VecCopy(x, work_));
    PetscCall(KSPSolve(C_solver_, work_, x));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::residual(double t, Vec y, Vec ydot, Form form, Vec F) {
  PetscFunctionBegin;
  PetscCall(MatMult(system_.G, y, F));
  PetscCall(add_sources(t, -1, F));
  if (form == Form::momentum) {
    PetscCall(MatMultAdd(system_.C, ydot, F, F));
  } else {
    PetscCall(apply_inverse_C(F));
    PetscCall(VecAXPY(F, 1, ydot));
  }
  PetscFunctionReturn(0);
}

// x' = C^-1 (B u - G x)
PetscErrorCode LinearModel::rhs(double t, Vec y, Vec G) {
  PetscFunctionBegin;
  PetscCall(MatMult(system_.G, y, G));
  PetscCall(VecScale(G, -1));
  PetscCall(add_sources(t, 1, G));
  PetscCall(apply_inverse_C(G));
  PetscFunctionReturn(0);
}

// A run that is continued fills its matrices with the sigma of the checkpoint's, whichever of nearly equal steps came first.
void LinearModel::keep_sums(const Keeper& keep) {
  for (std::size_t k = 0; k < sigmas_.size(); ++k) keep("matrix_sigma_" + std::to_string(k), sigmas_[k]);
}

// The state of an unchanged matrix stays what it was, and so does its factorisation.
PetscErrorCode LinearModel::jacobian(double, Vec, Vec, double sigma, Form form, Mat P) {
  PetscObjectId id;
  PetscObjectState state;
  PetscFunctionBegin;
  PetscCall(PetscObjectGetId(reinterpret_cast<PetscObject>(P), &id));
  PetscCall(PetscObjectStateGet(reinterpret_cast<PetscObject>(P), &state));
  std::size_t k = 0;
  while (k < filled_.size() && filled_[k].id != id) ++k;
  if (k == filled_.size()) filled_.push_back({id, -1, 0});
  Filling& mine = filled_[k];
  double& last = k < sigmas_.size() ? sigmas_[k] : mine.sigma;
  const bool again = std::abs(sigma - last) <= 1e-12 * last;
  if (again) sigma = last;
  last = sigma;
  if (again && mine.state == state && mine.sigma == sigma) PetscFunctionReturn(0);
  PetscCall(MatZeroEntries(P));
  PetscCall(MatAXPY(P, 1, system_.G, SUBSET_NONZERO_PATTERN));
  if (form == Form::momentum) {
    PetscCall(MatAXPY(P, sigma, system_.C, SUBSET_NONZERO_PATTERN));
  } else {
    PetscCall(VecCopy(diagonal_C_, work_));
    PetscCall(VecReciprocal(work_));
    PetscCall(MatDiagonalScale(P, work_, nullptr));
    PetscCall(MatShift(P, sigma));
  }
  PetscCall(PetscObjectStateGet(reinterpret_cast<PetscObject>(P), &state));
  mine = {id, state, sigma};
  if (!again) ++fillings_;  // what a continued run repeats is counted already
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::create_matrix(Mat* P) {
  PetscInt n, local;
  PetscFunctionBegin;
  MatInfo info;
  PetscCall(MatGetInfo(system_.G, MAT_LOCAL, &info));
  PetscCall(reserve_memory(comm_, {"the matrix of a step of " + system_.origin, info.nz_used * (sizeof(PetscScalar) + sizeof(PetscInt)), ""}));
  // the whole diagonal, so that incomplete factorisations find it
  MatHandle diagonal;
  PetscCall(MatGetSize(system_.G, &n, nullptr));
  PetscCall(MatGetLocalSize(system_.G, &local, nullptr));
  VecHandle ones;
  PetscCall(VecDuplicate(system_.x0, ones.out()));
  PetscCall(VecSet(ones, 1));
  PetscCall(MatCreateAIJ(comm_, local, local, n, n, 1, nullptr, 0, nullptr, diagonal.out()));
  PetscCall(MatDiagonalSet(diagonal, ones, INSERT_VALUES));
  PetscCall(MatDuplicate(system_.G, MAT_COPY_VALUES, P));
  PetscCall(MatAXPY(*P, 1, system_.C, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatAXPY(*P, 1, diagonal, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatZeroEntries(*P));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::create_operator(Mat P, Form, Mat* A) {
  PetscFunctionBegin;
  PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(P)));
  *A = P;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::residual_norms(Vec F, ResidualNorms* norms) {
  PetscFunctionBegin;
  *norms = {0, 0};
  PetscCall(VecNorm(F, NORM_2, &(*norms)[0]));
  PetscFunctionReturn(0);
}

// Every product of a row is rounded to eps of its size.
PetscErrorCode LinearModel::residual_floor(double, Vec y, double sigma, Form, ResidualNorms* floor) {
  PetscReal size;
  PetscFunctionBegin;
  PetscCall(VecNorm(y, NORM_2, &size));
  *floor = {PETSC_MACHINE_EPSILON * (norm_G_ + sigma * norm_C_) * size, 0};
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::covers(double, double t_end) {
  PetscFunctionBegin;
  const std::string error = sources_.covers(start_, t_end);
  if (!error.empty()) PetscCall(fail(comm_, Exit::input, error));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::last_fault(std::string* text) {
  PetscFunctionBegin;
  text->clear();
  PetscFunctionReturn(0);
}

// Reading a linear system, and what is to be known of it before the first step.

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
  bool dc_given = false;
  PetscFunctionBegin;
  comm_ = comm;
  PetscCall(read_section(comm, "Linear system G x + C x' = B u(t)", [&](Section& o) {
    options.read(o, is_given("-help"));
    sources_.options(o);
    dc_ = !options.netlist.empty() && options.x0.empty();
    dc_given = o.flag("-bs_linear_dc",
                      "start from the operating point: solve G x = B u at the initial time (as SPICE, so by default with -bs_netlist, unless it says "
                      "IC, .ic or UIC)",
                      dc_);
    o.integer("-bs_linear_be_steps", "number of initial steps by backward Euler, before cn or theta; they damp the ringing after a jump",
              startup_steps_, Range::nonnegative);
    if (dc_ && !options.x0.empty()) o.fail("options -bs_linear_dc and -bs_linear_x0: give one of them");
  }));
  PetscCall(read_start_time(&start_));
  PetscCall(load_system(comm, options, &system_));
  if (system_.B) PetscCall(MatGetSize(system_.B, nullptr, &columns));
  PetscCall(sources_.read(comm, columns, system_.source));
  if (system_.B) PetscCall(MatCreateVecs(system_.B, u_.out(), Bu_.out()));
  PetscCall(VecDuplicate(system_.x0, work_.out()));
  PetscCall(MatNorm(system_.G, NORM_INFINITY, &norm_G_));
  PetscCall(MatNorm(system_.C, NORM_INFINITY, &norm_C_));
  PetscCall(inspect_C());
  conditions_ = system_.start.G && !dc_given && options.x0.empty();
  if (conditions_) {
    dc_ = false;
    PetscCall(start_from_conditions());
  }
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
    bool empty = true;
    PetscCall(each_nonzero(system_.C, i, [&](PetscInt j, double) {
      empty = false;
      if (j != i) ++count[0];
    }));
    count[1] += empty;
  }
  PetscCall(sum_over_ranks(comm_, count, 2));
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

/// Ends the run with exit code 2 if the options make `ksp` a solver that does not solve the system.
PetscErrorCode LinearModel::require_solver(KSP ksp, const char* prefix) {
  std::string refusal;
  PetscFunctionBegin;
  PetscCall(refusal_of(ksp, prefix, &refusal));
  if (!refusal.empty()) PetscCall(fail(comm_, Exit::input, refusal));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::invert_C(const Plan& plan) {
  bool singular = false;
  PetscFunctionBegin;
  if (diagonal_ && zero_rows_ == 0) PetscFunctionReturn(0);
  if (zero_rows_ == 0) {
    PetscCall(create_direct(comm_, system_.C, "linear_c_", C_solver_.out()));
    PetscCall(is_singular(C_solver_, &singular));
    if (!singular) PetscCall(require_solver(C_solver_, "linear_c_"));
    PetscCall(KSPSetErrorIfNotConverged(C_solver_, PETSC_TRUE));
  }
  if (zero_rows_ > 0 || singular)
    PetscCall(fail(comm_, Exit::input,
                   "C is singular" + (zero_rows_ > 0 ? " (" + how_many(zero_rows_, "empty row") + ")" : std::string()) + ": " + plan.method +
                       " needs C^-1: use -ts_type beuler, cn, theta or bdf"));
  PetscFunctionReturn(0);
}

}  // namespace bs
