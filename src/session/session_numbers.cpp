// Numbers of a session's lattice that are given anew, and equilibria that follow them.
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/text.hpp"
#include "lattice/numbers.hpp"
#include "lattice/spring_laws.hpp"
#include "session/session_impl.hpp"
#include "systems/mechanics.hpp"
#include "tasks/statics/statics.hpp"

namespace bs {

std::vector<double> Session::numbers(const std::string& name) const {
  const std::vector<double>* column = impl_->given ? changeable_numbers(impl_->given.get(), name) : nullptr;
  return column ? *column : std::vector<double>();
}

void Session::Impl::drop_statics() {
  if (!statics) return;
  const Inside inside(comm, *analysis_options);
  statics.reset();
}

/// Equilibria alone are kept, from which follow() goes on, where all went well.
PetscErrorCode Session::Impl::solve_statics(Analyses analyses, Result* out) {
  int exit_code = 0;
  std::unique_ptr<Model> fresh;
  PetscFunctionBegin;
  *out = {};
  PetscCall(make_model(&fresh));
  statics = std::make_unique<StaticSolver>();
  loading = true;
  PetscErrorCode code = bs::solve_statics(std::move(fresh), analyses, true, statics.get(), &exit_code);
  loading = false;
  const PetscErrorCode copied = statics->copy_to(out);
  if (!code) code = copied;
  if (!code) code = stopped(exit_code > 128 ? exit_code - 128 : 0);
  if (code || analyses != Analyses::compliance || !statics->last()) statics.reset();
  PetscFunctionReturn(code);
}

PetscErrorCode Session::Impl::follow(Result* out) {
  PetscFunctionBegin;
  *out = {};
  if (!statics) PetscCall(fail(comm, Exit::input, "there is no equilibrium to follow: solve for one first (solve_statics)"));
  const PetscErrorCode code = statics->follow();
  PetscCall(statics->copy_to(out));
  PetscFunctionReturn(code);
}

/// The run ends where it is; the next one begins there.
PetscErrorCode Session::Impl::hold_state() {
  Vec y;
  PetscFunctionBegin;
  PetscCall(require_particles());
  PetscCall(refuse_files());
  if (given_state) PetscFunctionReturn(0);
  PetscCall(begin());
  PetscCall(run->state_vector(&y));
  PetscCall(copy_into(&given_state, y));
  PetscCall(start_anew(run->time(), steps_so_far()));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::require_given() {
  PetscFunctionBegin;
  if (!given)
    PetscCall(
        fail(comm, Exit::input, "the settings name the session's lattice, whose numbers cannot be changed: create it of arrays (read_lattice)"));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::set_numbers(const std::string& name, const std::vector<double>& all) {
  Error error;
  std::string why;
  PetscFunctionBegin;
  PetscCall(require_given());
  if (model) PetscCall(refuse_files());
  if (!change_numbers(given.get(), name, all, &why)) error.note(0, why);
  PetscCall(fail_if_any(comm, error));
  if (model) PetscCall(hold_state());
  if (model) PetscCall(model->mechanics()->set_numbers(name, all));
  if (statics) PetscCall(statics->equilibrium().mechanics()->set_numbers(name, all));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::remove_springs(const std::vector<std::int64_t>& rows) {
  Error error;
  std::vector<std::string> names = {"stiffness", "damping"};
  PetscFunctionBegin;
  PetscCall(require_given());
  for (const SpringParameter& one : spring_parameters())
    if (!one.positive && changeable_numbers(given.get(), one.name)) names.emplace_back(one.name);
  const std::int64_t springs = given->springs.total;
  for (const std::int64_t row : rows)
    if (row < 0 || row >= springs)
      error.note(row, format("spring %lld: there are %lld springs, from 0", static_cast<long long>(row), static_cast<long long>(springs)));
  PetscCall(fail_if_any(comm, error));
  for (const std::string& name : names) {
    std::vector<double> numbers = *changeable_numbers(given.get(), name);
    for (const std::int64_t row : rows) numbers[static_cast<std::size_t>(row)] = 0;
    PetscCall(set_numbers(name, numbers));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
