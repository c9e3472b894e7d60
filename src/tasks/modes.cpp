#include "tasks/modes.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "systems/frame_rows.hpp"
#include "tasks/matrices.hpp"
#include "tasks/statics/box_stress.hpp"
#include "tasks/statics/statics.hpp"
#include "tasks/unused_options.hpp"

namespace bs {
namespace {

struct ModeOptions {
  ModeRequest request;
  int about = 0;  ///< -bs_modes_about: 0 the start, 1 the equilibrium
};

/// Why the free vibrations of `model` cannot be had; empty where they can.
std::string fault_of_modes(Model& model) {
  Mechanics* mechanics = model.mechanics();
  if (!mechanics)
    return std::string("option -bs_task modes: a ") + model.name() + " system has no masses: give -bs_model particles, or -bs_task dynamics";
  if (mechanics->couples_all())
    return "option -bs_task modes: forces that couple all particles have no sparse matrix: leave them out, or give -bs_task dynamics";
  return {};
}

}  // namespace

PetscErrorCode read_mode_options(MPI_Comm comm) {
  ModeRequest& request = held_by<ModeOptions>(comm).request;
  int& about = held_by<ModeOptions>(comm).about;
  std::int64_t count = 10;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Modes", [&](Section& o) {
    o.integer("-bs_modes", "number K of modes of free vibration to compute, with -bs_task modes", count, Range::positive);
    o.choice("-bs_modes_which",
             "which of the squares omega^2 of the circular frequencies: the K smallest, the K largest, or the K nearest to "
             "-bs_modes_target; written in ascending order",
             {"smallest", "largest", "target"}, request.which);
    const bool near = o.real("-bs_modes_target", "square omega^2 of a circular frequency near which modes are sought [1/s^2]", request.near);
    int rigid = 0;
    o.choice("-bs_modes_rigid",
             "modes with omega^2 = 0, motions as a rigid body and mechanisms: drop: counted, but not among the K; keep: among "
             "the K",
             {"drop", "keep"}, rigid);
    request.keep_rigid = rigid == 1;
    o.choice("-bs_modes_solver",
             "auto: by size; dense: LAPACK, all modes; direct: Krylov-Schur with shift and invert by MUMPS, whose factors count what "
             "belongs in the list; iterative: generalised Davidson, which searches without a count, and not far inside the spectrum, "
             "with block factors and a coarse grid (-eps_... and -st_... tune them)",
             {"auto", "dense", "direct", "iterative"}, request.method);
    o.choice("-bs_modes_about",
             "state that the system vibrates about: start, or equilibrium under the full loads, which -bs_task statics would find "
             "(its options -bs_load_... apply)",
             {"start", "equilibrium"}, about);
    if (near && request.which != ModeRequest::target) o.fail("option -bs_modes_target: give -bs_modes_which target with it");
    if (!near && request.which == ModeRequest::target) o.fail("option -bs_modes_which target: say with -bs_modes_target near which omega^2 [1/s^2]");
    if (count > PETSC_MAX_INT) o.fail(format("option -bs_modes: %lld is too large", static_cast<long long>(count)));
  }));
  request.count = static_cast<PetscInt>(count);
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::linearise() {
  Mechanics& mechanics = *model_.mechanics();
  std::string fault;
  PetscFunctionBegin;
  PetscCall(model_.foresee(time_, time_, &fault));
  if (!fault.empty()) PetscCall(fail(model_.comm(), Exit::input, fault));
  PetscCall(measure_forces());
  PetscCall(mechanics.linearisation().linearise(time_, y_));
  PetscCall(form_.create(mechanics.linearisation()));
  if (form_.unknowns() == 0)
    PetscCall(fail(model_.comm(), Exit::input, "option -bs_task modes: no particle can move: leave some free (particles/fixed, -bs_lattice_fixed)"));
  PetscCall(detect_damping());
  PetscFunctionReturn(0);
}

/// Whether forces have values here, and how far from equilibrium this is.
PetscErrorCode ModesRun::measure_forces() {
  Mechanics& mechanics = *model_.mechanics();
  const Layout& at = mechanics.layout();
  const double* f = nullptr;
  std::string fault;
  double most[2] = {0, 0};
  PetscFunctionBegin;
  PetscCall(mechanics.force(time_, y_, &f));
  for (PetscInt k = 0; k < at.particles * at.dim; ++k) most[0] = std::max(most[0], std::abs(f[k]));
  PetscCall(model_.last_fault(&fault));
  if (!fault.empty()) PetscCall(fail(model_.comm(), Exit::input, "option -bs_task modes: this state has no stiffness: " + fault));
  std::vector<double> size(static_cast<std::size_t>(at.particles * at.dim), 0.0);
  PetscCall(mechanics.force_magnitudes(time_, y_, 0, size.data()));
  for (const double s : size) most[1] = std::max(most[1], s);
  PetscCall(max_over_ranks(model_.comm(), most, 2));
  largest_force_ = most[0];
  force_size_ = most[1];
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::detect_damping() {
  const Layout& at = model_.mechanics()->layout();
  std::vector<double> w(static_cast<std::size_t>(at.particles * at.dim)), f(w.size(), 0.0);
  PetscFunctionBegin;
  for (std::size_t k = 0; k < w.size(); ++k) w[k] = static_cast<double>((7 * k + 3) % 11) - 5.0;
  PetscCall(model_.mechanics()->linearisation().damping_force(w.data(), f.data()));
  const bool some = std::any_of(f.begin(), f.end(), [](double value) { return value != 0; });
  PetscCall(on_some_rank(model_.comm(), some, &damped_));
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::print_header(const std::string& method) {
  PetscFunctionBegin;
  std::vector<std::string> lines = model_.describe();
  lines.insert(lines.begin(), program_line(model_.comm()));
  lines.push_back(format("modes: the %lld %s omega^2 of -K q = omega^2 M q about the %s, %s", static_cast<long long>(request_.count),
                         request_.which == ModeRequest::smallest  ? "smallest"
                         : request_.which == ModeRequest::largest ? "largest"
                                                                  : format("(nearest to %g)", request_.near).c_str(),
                         held_by<ModeOptions>(model_.comm()).about == 1 ? "equilibrium" : "start", how_many(form_.unknowns(), "unknown").c_str()));
  lines.push_back("eigensolver: " + method);
  if (!model_.mechanics()->linearisation().complete())
    lines.push_back("forces that are computed outside give no tangent: the modes are those without what they change by");
  if (damped_) lines.push_back("damping is left out: the modes are those of M and K alone");
  constexpr double REST = 1e-6;
  if (largest_force_ > REST * force_size_)
    lines.push_back(
        format("this state is no equilibrium: forces up to %g N are left, and the modes are those of its K all the same", largest_force_));
  if (options_.output.trajectory.file.empty()) lines.push_back("the modes are not written: give -bs_output F.h5md to write them");
  progress_.header(lines);
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::run() {
  std::string method, why;
  PetscFunctionBegin;
  PetscCall(linearise());
  ModeSolver solver(form_, request_);
  PetscCall(refuse_foreign_options(model_.comm()));
  PetscCall(solver.create(&method));
  if (is_given("-help")) PetscFunctionReturn(0);
  PetscCall(print_header(method));
  PetscCall(remove_earlier_results(model_.comm()));
  PetscCall(write_matrices(model_, time_, y_, options_.output.trajectory.overwrite));
  PetscCall(warn_unused_options(model_.comm(), {"dynamics", "particles"}));
  PetscCall(open_file());
  set_phase(model_.comm(), Exit::solve);
  PetscCall(solver.solve(&modes_, &why));
  solver.release();
  modes_.method = method;
  if (!why.empty()) modes_.completeness = Completeness::unknown;
  PetscCall(find_effective_masses());
  PetscCall(write());
  PetscCall(conclude(why));
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::give_up(const std::string& outcome, const std::string& why) {
  Linearisation& lin = model_.mechanics()->linearisation();
  PetscFunctionBegin;
  PetscCall(lin.linearise(time_, y_));
  PetscCall(form_.create(lin));
  PetscCall(open_file());
  PetscCall(find_effective_masses());
  PetscCall(write());
  PetscCall(report(outcome, why));
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::copy_results(Result* out) {
  Vec q;
  std::vector<double> rows, all;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < modes_.mode.size(); ++k) {
    out->omega_squared.push_back(modes_.mode[k].omega_squared);
    out->residual.push_back(modes_.mode[k].residual);
    PetscCall(page(k, &q));
    PetscCall(own_numbers(q, &rows));
    PetscCall(gather_all(model_.comm(), rows, &all));
    out->shapes.insert(out->shapes.end(), all.begin(), all.end());
  }
  out->zero_modes = modes_.zero_exact ? modes_.zero : -1;
  out->frame.time = time_;
  PetscCall(model_.observe(time_, y_, &out->frame.observables));
  PetscCall(read_tables(model_, time_, y_, &out->frame.tables));
  PetscFunctionReturn(0);
}

PetscErrorCode run_modes(std::unique_ptr<Model> model, const SavedState* equilibrium, Result* result, int* exit_code) {
  RunOptions options;
  OutputLocks locks;  // given up when the files are closed
  PetscFunctionBegin;
  *exit_code = 0;
  PetscCall(read_mode_options(model->comm()));
  const auto& [request, about] = held_by<ModeOptions>(model->comm());
  if (is_given("-bs_checkpoint") || is_given("-bs_restart"))
    PetscCall(fail(model->comm(), Exit::input, "options -bs_checkpoint and -bs_restart: -bs_task modes has no steps to save: leave them out"));
  PetscCall(read_run_options(model->comm(), about == 1 ? Steps::loads : Steps::none, &options));
  const std::string why = fault_of_modes(*model);
  if (!why.empty()) PetscCall(fail(model->comm(), Exit::input, why));
  PetscCall(lock_outputs(model->comm(), options, &locks));
  std::unique_ptr<Model> there;
  VecHandle y;
  Facts warnings;
  double time = 0;
  if (about == 1) {
    FoundEquilibrium found;
    const PetscErrorCode code =
        equilibrium ? return_to_equilibrium(std::move(model), *equilibrium, &found) : find_equilibrium(std::move(model), options, &found, exit_code);
    if (code != 0 || *exit_code != 0) {
      if (!found.y) PetscFunctionReturn(code);
      ModesRun run(*found.model, options, request, found.factor, found.y, found.warnings);
      PetscCall(run.give_up(found.outcome, found.why));
      PetscFunctionReturn(code);
    }
    there = std::move(found.model);
    y = std::move(found.y);
    warnings = std::move(found.warnings);
    time = found.factor;
  } else {
    PetscCall(refuse_box_stress(*model, "-bs_modes_about start"));
    there = std::move(model);
    Loads still;  // what is driven, and a box that is strained, has its place at the start and no velocity, which would act on dampers
    still.at_rest = true;
    there->mechanics()->set_loads(still);
    PetscCall(read_start_time(&time));
    PetscCall(at_rest(there->initial_state(), y.out()));
  }
  PetscBool others = PETSC_FALSE;  // another run of this task is under way, as when this one only lists its options
  PetscCall(SlepcInitialized(&others));
  PetscCall(SlepcInitialize(nullptr, nullptr, nullptr, nullptr));
  {
    ModesRun run(*there, options, request, time, y, warnings);
    PetscCall(run.run());
    if (result) PetscCall(run.copy_results(result));
  }
  if (!others) PetscCall(SlepcFinalize());
  PetscFunctionReturn(0);
}

}  // namespace bs
