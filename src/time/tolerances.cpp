#include "time/tolerances.hpp"
#include <cmath>
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/options.hpp"
#include "systems/layout.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

/// x for every position, v for every velocity.
PetscErrorCode fill(Vec vec, double x, double v) {
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(vec, &a));
  layout_of(vec).for_each([&](PetscInt position, PetscInt velocity) {
    a[position] = x;
    a[velocity] = v;
  });
  PetscCall(VecRestoreArrayWrite(vec, &a));
  PetscFunctionReturn(0);
}

/// Tolerances that are no tolerances; where steps follow an error estimate, those that leave a part of the state without.
PetscErrorCode check(const Tolerances& t, bool adaptive, double atol, double rtol, MPI_Comm comm) {
  std::string fault;
  PetscFunctionBegin;
  if (!(atol >= 0) || !std::isfinite(atol)) fault = format("option -ts_atol: %g: give a finite number >= 0", atol);
  else if (!(rtol >= 0 && rtol < 1)) fault = format("option -ts_rtol: %g: give a number >= 0 and below 1", rtol);
  else if (t.rtol_x >= 1 || t.rtol_v >= 1)
    fault = format("option -bs_rtol_%s: %g: give a number below 1", t.rtol_x >= 1 ? "x" : "v", t.rtol_x >= 1 ? t.rtol_x : t.rtol_v);
  else if (adaptive && atol + rtol == 0 && !(t.atol_x + t.rtol_x > 0 && t.atol_v + t.rtol_v > 0))
    fault =
        "options -ts_atol and -ts_rtol: both 0 leave the steps without error control: give one of them, e.g. -ts_rtol 1e-6, "
        "or a fixed step by -ts_adapt_type none";
  if (!fault.empty()) PetscCall(fail(comm, Exit::input, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_tolerances(MPI_Comm comm, Tolerances* out) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Error control", [&](Section& o) {
    o.real("-bs_atol_x", "error-controlled steps: absolute tolerance of positions; 0: -ts_atol [m]", out->atol_x, Range::nonnegative);
    o.real("-bs_atol_v", "error-controlled steps: absolute tolerance of velocities; 0: -ts_atol [m/s]", out->atol_v, Range::nonnegative);
    o.real("-bs_rtol_x", "error-controlled steps: relative tolerance of positions; 0: -ts_rtol", out->rtol_x, Range::nonnegative);
    o.real("-bs_rtol_v", "error-controlled steps: relative tolerance of velocities; 0: -ts_rtol", out->rtol_v, Range::nonnegative);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode set_tolerances(const Tolerances& t, const Model& model, TS ts) {
  PetscReal atol, rtol;
  VecHandle vatol, vrtol;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(is_adaptive(ts, &adaptive));
  PetscCall(TSGetTolerances(ts, &atol, nullptr, &rtol, nullptr));
  PetscCall(check(t, adaptive, atol, rtol, model.comm()));
  if (!t.given()) PetscFunctionReturn(0);
  if (model.dim() == 0)
    PetscCall(fail(model.comm(), Exit::input,
                   "options -bs_atol_x, -bs_atol_v, -bs_rtol_x, -bs_rtol_v apply to particles only: give -ts_atol and -ts_rtol"));
  PetscCall(VecDuplicate(model.initial_state(), vatol.out()));
  PetscCall(VecDuplicate(model.initial_state(), vrtol.out()));
  PetscCall(fill(vatol, t.atol_x > 0 ? t.atol_x : atol, t.atol_v > 0 ? t.atol_v : atol));
  PetscCall(fill(vrtol, t.rtol_x > 0 ? t.rtol_x : rtol, t.rtol_v > 0 ? t.rtol_v : rtol));
  PetscCall(TSSetTolerances(ts, atol, vatol, rtol, vrtol));
  PetscFunctionReturn(0);
}

}  // namespace bs
