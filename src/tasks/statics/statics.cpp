#include "tasks/statics/statics.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "tasks/matrices.hpp"
#include "tasks/statics/static_solver.hpp"

namespace bs {

PetscErrorCode solve_statics(std::unique_ptr<Model> model, Analyses analyses, bool keep_input, StaticSolver* solver, int* exit_code) {
  RunOptions options;
  StaticsSettings loads;
  VecHandle rest;
  PetscFunctionBegin;
  MPI_Comm comm = model->comm();
  PetscCall(read_statics_settings(comm, analyses, &loads));
  PetscCall(refuse_options_of_dynamics(comm));
  if (loads.arc) PetscCall(refuse_checkpoints(comm));
  if (loads.arc && model->breaks())
    PetscCall(fail(comm, Exit::input, "-bs_load_control arc: springs that break are for load steps: leave the option out, or the limits of springs"));
  PetscCall(read_run_options(comm, Steps::loads, &options));
  options.keep_input = options.keep_input || keep_input;
  PetscCall(solver->create(std::move(model), loads, options));
  PetscCall(solver->analyse(analyses == Analyses::moduli));
  PetscCall(solver->run(exit_code));
  if (!solver->last() || *exit_code != 0) PetscFunctionReturn(0);  // a run that was stopped has not come to the last equilibrium
  PetscCall(at_rest(solver->last(), rest.out()));
  PetscCall(write_matrices(solver->equilibrium(), solver->equilibrium().factor(1), rest, options.output.trajectory.overwrite));
  PetscFunctionReturn(0);
}

PetscErrorCode find_equilibrium(std::unique_ptr<Model> model, const RunOptions& given, FoundEquilibrium* out, int* exit_code) {
  RunOptions options = given;
  StaticsSettings loads;
  StaticSolver solver;
  PetscFunctionBegin;
  MPI_Comm comm = model->comm();
  PetscCall(read_statics_settings(comm, Analyses::none, &loads));
  PetscCall(refuse_options_of_dynamics(comm));
  options.output.trajectory.file.clear();
  options.output.report.clear();
  options.keep_input = true;
  PetscCall(solver.create(std::move(model), loads, options));
  PetscErrorCode code = solver.run(exit_code);
  *out = std::move(solver.found());
  const double load = solver.equilibrium().factor(out->factor), full = loads.arc ? loads.end : 1.0;
  if (code == 0 && out->outcome == "ok" && std::abs(load - full) > 1e-9 * std::max(1.0, std::abs(full))) {
    out->outcome = "failed";
    out->why =
        format("no equilibrium under the full loads was come to: the load factor is %.10g of %g: give more steps (-ts_max_steps, -bs_arc_steps)",
               load, full);
    code = fail(comm, Exit::solve, out->why);
  }
  if (code != 0 && (code != ERR_FAILED || out->outcome.empty())) PetscFunctionReturn(code);
  PetscCall(at_rest(solver.last() ? solver.last() : solver.equilibrium().initial_state(), out->y.out()));
  out->factor = out->outcome == "ok" || out->outcome.empty() ? full : load;
  out->model = solver.let_go();
  PetscFunctionReturn(code);
}

PetscErrorCode return_to_equilibrium(std::unique_ptr<Model> model, const SavedState& found, FoundEquilibrium* out) {
  RunOptions options;
  StaticsSettings loads;
  StaticSolver solver;
  VecHandle y;
  PetscFunctionBegin;
  PetscCall(read_statics_settings(model->comm(), Analyses::none, &loads));
  PetscCall(refuse_options_of_dynamics(model->comm()));
  PetscCall(solver.create(std::move(model), loads, options));
  Equilibrium& there = solver.equilibrium();
  PetscCall(copy_into(&y, there.initial_state()));
  PetscCall(put_state(there, found, y));
  PetscCall(at_rest(y, out->y.out()));
  PetscCall(there.observe(found.time, out->y, &out->observables));  // which applies the loads of that factor
  out->factor = found.time;
  out->model = solver.let_go();
  PetscFunctionReturn(0);
}

}  // namespace bs
