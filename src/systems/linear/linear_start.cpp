// The state that a linear system starts from: its operating point, or what a netlist says of capacitors and inductors.
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "systems/linear/linear_model.hpp"

namespace bs {

/// `fault`: where A is singular.
PetscErrorCode LinearModel::create_start_solver(Mat A, const std::string& fault, KSP* ksp) {
  bool singular = false;
  PetscFunctionBegin;
  PetscCall(create_direct(comm_, A, "linear_dc_", ksp));
  PetscCall(is_singular(*ksp, &singular));
  if (singular) PetscCall(fail(comm_, Exit::input, fault));
  PetscCall(require_solver(*ksp, "linear_dc_"));
  PetscCall(KSPSetErrorIfNotConverged(*ksp, PETSC_TRUE));
  PetscFunctionReturn(0);
}

/// A start after a jump is not SPICE's.
PetscErrorCode LinearModel::warn_of_jump() {
  PetscFunctionBegin;
  for (std::size_t k = 0; k < sources_.count(); ++k) {
    const double before = sources_.before(k, start_), after = sources_.at(k, start_);
    if (before == after || !sources_.as_spice(k)) continue;
    PetscCall(warn(comm_, "jump_at_start",
                   format("source %zu jumps from %g to %g at the start, which is taken after the jump; SPICE takes it before: let the pulse begin "
                          "later (TD) or rise in some time (TR)",
                          k + 1, before, after)));
    break;
  }
  PetscFunctionReturn(0);
}

// G x = B u(start)
PetscErrorCode LinearModel::operating_point() {
  KSPHandle ksp;
  PetscFunctionBegin;
  PetscCall(warn_of_jump());
  PetscCall(create_start_solver(
      system_.G, "option -bs_linear_dc: G is singular, there is no operating point: give -bs_linear_x0 or -bs_linear_dc false instead", ksp.out()));
  PetscCall(VecZeroEntries(work_));
  PetscCall(add_sources(start_, 1, work_));
  PetscCall(KSPSolve(ksp, work_, system_.x0));
  PetscFunctionReturn(0);
}

// G z = B u(start) + b of the circuit at the start; x0 are the first of z
PetscErrorCode LinearModel::start_from_conditions() {
  StartSystem& start = system_.start;
  KSPHandle ksp;
  VecHandle z, part;
  ISHandle rows;
  ScatterHandle scatter;
  PetscInt first, last;
  PetscFunctionBegin;
  PetscCall(warn_of_jump());
  PetscCall(create_start_solver(
      start.G,
      system_.origin + ": IC, .ic and UIC leave the circuit undetermined at the start: give -bs_linear_x0, or -bs_linear_dc for the operating point",
      ksp.out()));
  PetscCall(VecDuplicate(start.b, z.out()));
  if (start.B) {
    PetscCall(set_sources(start_));
    PetscCall(MatMultAdd(start.B, u_, start.b, start.b));
  }
  PetscCall(KSPSolve(ksp, start.b, z));
  PetscCall(VecGetOwnershipRange(system_.x0, &first, &last));
  PetscCall(ISCreateStride(comm_, last - first, first, 1, rows.out()));
  PetscCall(VecScatterCreate(z, rows, system_.x0, rows, scatter.out()));
  PetscCall(scatter_all(scatter, z, system_.x0));
  PetscCall(check_start(z));
  start = {};
  PetscFunctionReturn(0);
}

/// What has no equation at the start must hold all the same.
PetscErrorCode LinearModel::check_start(Vec z) {
  const std::vector<StartSystem::Check>& checks = system_.start.checks;
  VecHandle all;
  ScatterHandle scatter;
  PetscFunctionBegin;
  if (checks.empty()) PetscFunctionReturn(0);
  PetscCall(VecScatterCreateToAll(z, scatter.out(), all.out()));
  PetscCall(scatter_all(scatter, z, all));
  std::string fault;
  {
    const ReadArray v(all);
    const auto at = [&](PetscInt k) { return k < 0 ? 0.0 : v[k]; };
    for (const StartSystem::Check& check : checks) {
      const double size = std::max({std::abs(at(check.a)), std::abs(at(check.b)), std::abs(check.value)});
      if (fault.empty() && std::abs(at(check.a) - at(check.b) - check.value) > 1e-9 * size) fault = check.fault;
    }
  }
  if (!fault.empty()) PetscCall(fail(comm_, Exit::input, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
