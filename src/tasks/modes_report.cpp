// What becomes of computed modes: participation, datasets, summary and report.
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "base/vec_array.hpp"
#include "output/report.hpp"
#include "output/tables.hpp"
#include "systems/frame_rows.hpp"
#include "systems/system.hpp"
#include "tasks/modes.hpp"

namespace bs {

namespace {

const char* completeness_name(Completeness completeness) {
  const char* const names[] = {"unknown", "searched", "counted"};
  return names[static_cast<int>(completeness)];
}

/// "46", or ">=13" where there may be more.
std::string count_text(PetscInt count, bool exact) { return format("%s%lld", exact ? "" : ">=", static_cast<long long>(count)); }

}  // namespace

/// Effective masses: (sum over particles of m q_c)^2, which over all modes adds up to the mass that can move.
PetscErrorCode ModesRun::find_effective_masses() {
  const Pencil& lin = form_.linearised();
  const Layout& at = model_.mechanics()->layout();
  const std::vector<double>& m = lin.masses();
  PetscFunctionBegin;
  PetscCall(form_.create_full(shape_.out()));
  for (PetscInt i = 0; i < at.particles; ++i) {
    PetscInt ways = 0;
    for (PetscInt c = 0; c < at.dim; ++c) ways += lin.moves(i, c) ? 1 : 0;
    mass_ += ways > 0 ? m[static_cast<std::size_t>(i)] : 0.0;
    motions_ += ways;
  }
  PetscCall(sum_over_ranks(model_.comm(), &mass_));
  PetscCall(sum_over_ranks(model_.comm(), &motions_));
  participation_.assign(modes_.mode.size() * static_cast<std::size_t>(at.dim), 0.0);
  for (std::size_t k = 0; k < modes_.mode.size(); ++k) {
    PetscCall(form_.shape(modes_.mode[k].u, shape_));
    const ReadArray q(shape_);
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) participation_[k * at.dim + c] += m[static_cast<std::size_t>(i)] * q[i * at.dim + c];
  }
  const PetscMPIInt count = static_cast<PetscMPIInt>(participation_.size());
  PetscCall(sum_over_ranks(model_.comm(), participation_.data(), count));
  for (double& value : participation_) value *= value;
  PetscFunctionReturn(0);
}

/// Mode k in the input's order, its largest component (the first of those as large) positive; 0 where there is none; borrowed.
PetscErrorCode ModesRun::page(std::size_t k, Vec* out) {
  constexpr double AS_LARGE = 1 - 1e-6;
  std::vector<StatePart> parts;
  const PetscScalar* q = nullptr;
  PetscReal most = 0;
  PetscInt first = 0, n = 0;
  PetscFunctionBegin;
  if (!state_) PetscCall(VecDuplicate(y_, state_.out()));
  if (k < modes_.mode.size()) PetscCall(form_.shape(modes_.mode[k].u, shape_));
  else PetscCall(VecZeroEntries(shape_));
  PetscCall(VecZeroEntries(state_));
  set_half(state_, StateHalf::position, ReadArray(shape_));
  PetscCall(model_.gather_state(state_, &parts));
  *out = parts[0].vec;
  PetscCall(VecNorm(*out, NORM_INFINITY, &most));
  PetscCall(VecGetOwnershipRange(*out, &first, nullptr));
  PetscCall(VecGetLocalSize(*out, &n));
  PetscCall(VecGetArrayRead(*out, &q));
  PetscInt place[2] = {PETSC_MAX_INT, PETSC_MAX_INT};  // of the first such component; the same if it is negative
  for (PetscInt i = 0; i < n && place[0] == PETSC_MAX_INT; ++i)
    if (std::abs(q[i]) >= AS_LARGE * most) {
      place[0] = first + i;
      if (q[i] < 0) place[1] = first + i;
    }
  PetscCall(VecRestoreArrayRead(*out, &q));
  PetscCall(min_over_ranks(model_.comm(), place, 2));
  if (place[0] == place[1]) PetscCall(VecScale(*out, -1.0));
  PetscFunctionReturn(0);
}

/// sum over the modes of |q_i|^2/omega^2: the mean square of particle i's displacement at kT = 1 J, as far as these modes go.
PetscErrorCode ModesRun::fluctuations(std::vector<Dataset>* constants) {
  const PetscInt d = form_.linearised().dim();
  std::vector<double> sum;
  std::int64_t first = 0, total = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k == 0 || k < modes_.mode.size(); ++k) {
    Vec q;
    PetscInt n = 0, at = 0, all = 0;
    PetscCall(page(k, &q));
    PetscCall(VecGetLocalSize(q, &n));
    PetscCall(VecGetSize(q, &all));
    PetscCall(VecGetOwnershipRange(q, &at, nullptr));
    first = at / d;
    total = all / d;
    sum.resize(static_cast<std::size_t>(n / d), 0.0);
    if (modes_.mode.empty()) continue;
    const Mode& mode = modes_.mode[k];
    if (mode.zero || mode.omega_squared <= 0) continue;
    const ReadArray a(q);
    for (PetscInt i = 0; i < n; ++i) sum[static_cast<std::size_t>(i / d)] += a[i] * a[i] / mode.omega_squared;
  }
  constants->push_back(
      {"/modes/fluctuation", first, total, 0, std::move(sum), {{"meaning", "mean square displacement at kT = 1 J by these modes"}}, {-1, 0, 2}});
  PetscFunctionReturn(0);
}

/// The file with the state and what it holds of the lattice, which the search for modes then has the memory of. It takes the place of an earlier
/// run's before the search begins, which may fail.
PetscErrorCode ModesRun::open_file() {
  TrajectoryOptions options = options_.output.trajectory;
  std::vector<Dataset> constants;
  PetscFunctionBegin;
  options.boundary = model_.boundary();
  if (!options.file.empty()) {
    set_phase(model_.comm(), Exit::io);
    PetscCall(model_.take_constants(&constants));
    PetscCall(Trajectory::create(model_.comm(), options, model_.dim(), std::numeric_limits<std::int64_t>::max(), constants, &file_));
    PetscCall(write_state());
  }
  model_.release_input();
  PetscFunctionReturn(0);
}

/// The one frame.
PetscErrorCode ModesRun::write_state() {
  std::vector<Field> fields;
  std::vector<Observable> observables;
  std::string what;
  PetscFunctionBegin;
  PetscCall(model_.observe(time_, y_, &observables));
  PetscCall(model_.fields(time_, y_, &fields));
  PetscCall(find_not_finite(model_.comm(), fields, observables, &what));
  if (!what.empty()) PetscCall(fail(model_.comm(), Exit::input, "the state is not finite: " + what + ": give smaller numbers"));
  PetscCall(file_->write_frame(0, time_, fields, observables));
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::write() {
  const std::int64_t count = static_cast<std::int64_t>(modes_.mode.size());
  const int d = static_cast<int>(form_.linearised().dim());
  std::vector<Dataset> tables;
  std::vector<double> squared, residual;
  PetscFunctionBegin;
  if (!file_) PetscFunctionReturn(0);
  const PetscMPIInt rank = rank_of(model_.comm());
  PetscCall(fluctuations(&tables));
  if (model_.breaks()) PetscCall(model_.breaks()->tables(&tables));
  for (const Mode& mode : modes_.mode) {
    squared.push_back(mode.omega_squared);
    residual.push_back(mode.residual);
  }
  std::vector<std::int64_t> motions{motions_};
  if (rank != 0) {  // each row is written by one rank
    motions.clear();
    squared.clear();
    residual.clear();
    participation_.clear();
  }
  tables.push_back({"/modes/omega_squared", 0, count, 0, squared, omega_attributes(), {0, 0, -2}});
  tables.push_back({"/modes/residual", 0, count, 0, residual, {{"meaning", "bound of the error of omega_squared"}}, {0, 0, -2}});
  tables.push_back({"/modes/participation", 0, count, d, participation_, {{"meaning", "effective mass in each direction"}}, {1, 0, 0}});
  tables.push_back({"/modes/motions", 0, 1, 0, motions, {{"meaning", "components of particles that can move: there are as many modes"}}});
  set_phase(model_.comm(), Exit::io);
  for (const Dataset& table : tables) PetscCall(file_->write_table(table));
  PetscCall(file_->write_pages("/modes/shape", count, [this](std::int64_t k, Vec* out) { return page(static_cast<std::size_t>(k), out); }));
  PetscCall(file_->close());
  set_phase(model_.comm(), Exit::solve);
  PetscFunctionReturn(0);
}

/// What the list of omega^2 is known to hold.
std::vector<std::pair<std::string, std::string>> ModesRun::omega_attributes() const {
  return {{"meaning", "eigenvalues of -K q = omega^2 M q"},
          {"completeness", completeness_name(modes_.completeness)},
          {"zero_modes", count_text(modes_.zero, modes_.zero_exact)},
          {"unstable_modes", count_text(modes_.unstable, modes_.unstable_exact)}};
}

std::vector<std::string> ModesRun::lines() const {
  std::vector<std::string> all;
  constexpr std::size_t SHOWN = 12;
  for (std::size_t k = 0; k < modes_.mode.size() && k < SHOWN; ++k) {
    const Mode& mode = modes_.mode[k];
    const double w = mode.omega_squared;
    all.push_back(format("mode %zu: omega^2 = %.10g 1/s^2, %s, residual %.1e", k, w,
                         mode.zero ? "omega = 0"
                         : w < 0   ? format("grows as exp(%.6g t)", std::sqrt(-w)).c_str()
                                   : format("f = %.6g Hz", std::sqrt(w) / (2 * M_PI)).c_str(),
                         mode.residual));
  }
  if (modes_.mode.size() > SHOWN) all.push_back(format("... and %zu more", modes_.mode.size() - SHOWN));
  if (modes_.zero > 0)
    all.push_back(format("%s%s omega^2 = 0, %s of the whole as a rigid body%s", modes_.zero_exact ? "" : "at least ",
                         how_many(modes_.zero, "mode{ has|s have}").c_str(), how_many(modes_.rigid, "of them {a motion|motions}").c_str(),
                         request_.keep_rigid ? "" : "; they are not among the modes above"));
  const char* const complete[] = {"copies of a multiple omega^2 may be missing among them: -bs_modes_solver direct counts them",
                                  "another search beside them found none that is missing among them; -bs_modes_solver direct counts them",
                                  "no mode is missing among them"};
  all.push_back(complete[static_cast<int>(modes_.completeness)]);
  return all;
}

PetscErrorCode ModesRun::report(const std::string& outcome, const std::string& why) {
  PetscFunctionBegin;
  if (options_.output.report.empty()) PetscFunctionReturn(0);
  const PetscMPIInt size = size_of(model_.comm());
  Report report;
  double worst = 0;
  std::vector<double> squared;
  for (const Mode& mode : modes_.mode) {
    squared.push_back(mode.omega_squared);
    worst = std::max(worst, mode.residual);
  }
  report.set("outcome", outcome);
  report.set("reason", why);
  report.set("task", "modes");
  report.set("model", std::string(model_.name()));
  report.set("ranks", static_cast<std::int64_t>(size));
  report.set("method", modes_.method);
  report.set("modes", static_cast<std::int64_t>(modes_.mode.size()));
  report.set("omega_squared", squared);
  report.set("largest_residual", worst);
  report.set("zero_modes", static_cast<std::int64_t>(modes_.zero));
  report.set("rigid_motions", static_cast<std::int64_t>(modes_.rigid));
  report.set("unstable_modes", static_cast<std::int64_t>(modes_.unstable));
  report.set("zero_modes_exact", modes_.zero_exact);
  report.set("unstable_modes_exact", modes_.unstable_exact);
  report.set("completeness", completeness_name(modes_.completeness));
  report.set("iterations", static_cast<std::int64_t>(modes_.iterations));
  report.set("moving_mass", mass_);
  report.set("largest_force", largest_force_);
  report.set("frames", static_cast<std::int64_t>(options_.output.trajectory.file.empty() ? 0 : 1));
  report.set("wall", progress_.wall());
  report.set("warnings", warnings_.keys());
  PetscCall(report.write(model_.comm(), options_.output.report, options_.output.trajectory.overwrite));
  PetscFunctionReturn(0);
}

PetscErrorCode ModesRun::conclude(const std::string& why) {
  PetscFunctionBegin;
  const long long found = static_cast<long long>(modes_.mode.size()), asked = static_cast<long long>(request_.count);
  if (why.empty() && found < asked && is_given("-bs_modes"))
    PetscCall(warnings_.add("fewer_modes", format("the system has %s%s, fewer than the %lld of -bs_modes: all of them are given",
                                                  how_many(found, "mode").c_str(), request_.keep_rigid ? "" : " with omega^2 other than 0", asked)));
  if (modes_.unstable > 0)
    PetscCall(warnings_.add("unstable", format("%s%s omega^2 < 0: the start is unstable, and small motions along them grow",
                                               modes_.unstable_exact ? "" : "at least ", how_many(modes_.unstable, "mode{ has|s have}").c_str())));
  if (modes_.completeness == Completeness::unknown)
    PetscCall(warnings_.add("incomplete", "copies of a multiple omega^2 may be missing among the modes: -bs_modes_solver direct counts them"));
  PetscCall(report(why.empty() ? "ok" : "failed", why));
  std::vector<std::string> said = why.empty() ? lines() : std::vector<std::string>{};
  said.push_back(format("backspring: %s modes=%lld completeness=%s zero=%s unstable=%s iterations=%lld wall=%.3f%s", why.empty() ? "ok" : "failed",
                        found, completeness_name(modes_.completeness), count_text(modes_.zero, modes_.zero_exact).c_str(),
                        count_text(modes_.unstable, modes_.unstable_exact).c_str(), static_cast<long long>(modes_.iterations), progress_.wall(),
                        counted(warnings_.keys().size()).c_str()));
  progress_.header(said);
  if (!why.empty()) PetscCall(fail(model_.comm(), Exit::solve, why));
  PetscFunctionReturn(0);
}

}  // namespace bs
