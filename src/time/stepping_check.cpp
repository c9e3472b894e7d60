#include "time/stepping_check.hpp"
#include <cmath>
#include <string>
#include "base/fault.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

PetscErrorCode fault_of_times(TS ts, std::string* fault) {
  PetscReal h, start, end;
  PetscInt steps;
  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(TSGetTime(ts, &start));
  PetscCall(TSGetMaxTime(ts, &end));
  PetscCall(TSGetMaxSteps(ts, &steps));
  if (!(h > 0) || !std::isfinite(h)) *fault = format("option -ts_dt: %g: give a time step > 0 [s]", h);
  else if (!std::isfinite(start)) *fault = format("option -ts_init_time: %g: give a finite time [s]", start);
  else if (!std::isfinite(end) || end < start)
    *fault = format("option -ts_max_time: %g: give a finite time at or after the start, t = %g s", end, start);
  else if (steps < 0) *fault = format("option -ts_max_steps: %lld: give a number of steps >= 0", static_cast<long long>(steps));
  PetscFunctionReturn(0);
}

PetscErrorCode fault_of_theta(TS ts, std::string* fault) {
  const Method* method;
  PetscReal value;
  PetscFunctionBegin;
  PetscCall(method_of(ts, &method));
  if (!method->remembers(Memory::theta)) PetscFunctionReturn(0);
  PetscCall(theta_of(ts, &value));
  if (!(value > 0 && value <= 1)) *fault = format("option -ts_theta_theta: %g: give a number above 0 and at most 1", value);
  PetscFunctionReturn(0);
}

PetscErrorCode fault_of_tolerances(TS ts, std::string* fault) {
  SNES snes;
  PetscReal tolerance[3];
  PetscInt most[2];
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetTolerances(snes, &tolerance[0], &tolerance[1], &tolerance[2], &most[0], &most[1]));
  const char* const names[] = {"-snes_atol", "-snes_rtol", "-snes_stol"};
  for (int k = 0; k < 3; ++k)
    if (!(tolerance[k] >= 0) || (k == 1 && tolerance[k] >= 1))
      *fault = format("option %s: %g: give a number >= 0%s", names[k], tolerance[k], k == 1 ? " and below 1" : "");
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode check_stepping(TS ts, bool implicit) {
  std::string fault;
  PetscFunctionBegin;
  PetscCall(fault_of_times(ts, &fault));
  if (fault.empty()) PetscCall(fault_of_theta(ts, &fault));
  if (fault.empty() && implicit) PetscCall(fault_of_tolerances(ts, &fault));
  if (!fault.empty()) PetscCall(tell(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), Exit::input, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
