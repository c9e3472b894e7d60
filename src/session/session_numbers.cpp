// Numbers of a session's lattice that are given anew, and equilibria that follow them.
#include <algorithm>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/handle.hpp"
#include "base/text.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"
#include "session/session_impl.hpp"
#include "systems/client.hpp"
#include "systems/mechanics.hpp"
#include "tasks/statics/statics.hpp"

namespace bs {

std::vector<double> Session::numbers(const std::string& name) const {
  const NumberColumn column = impl_->given ? changeable_numbers(impl_->given.get(), name) : NumberColumn();
  return column ? column.values() : std::vector<double>();
}

void Session::Impl::drop_statics() {
  if (!statics) return;
  const Inside inside(comm, *analysis_options);
  statics.reset();
}

/// Equilibria alone are kept, from which follow() goes on, where all went well.
PetscErrorCode Session::Impl::solve_statics(Analyses analyses, Result* out, int* exit_code) {
  std::unique_ptr<Model> fresh;
  PetscFunctionBegin;
  PetscCall(make_model(&fresh));
  statics = std::make_unique<StaticSolver>();
  loading = true;
  PetscErrorCode code = bs::solve_statics(std::move(fresh), analyses, out != nullptr, statics.get(), exit_code);
  loading = false;
  const PetscErrorCode copied = out ? statics->copy_to(out) : 0;
  if (!code) code = copied;
  if (!out || code || *exit_code || analyses != Analyses::compliance || !statics->last()) statics.reset();
  current = true;
  PetscFunctionReturn(code);
}

PetscErrorCode Session::Impl::follow(Result* out) {
  PetscFunctionBegin;
  *out = {};
  if (!statics) PetscCall(fail(comm, Exit::input, "there is no equilibrium to follow: solve for one first (solve_statics)"));
  const PetscErrorCode code = statics->follow();
  PetscCall(statics->copy_to(out));
  current = !code;
  PetscFunctionReturn(code);
}

PetscErrorCode Session::Impl::sensitivities(const std::vector<double>& slope, std::map<std::string, std::vector<double>>* out) {
  std::vector<StatePart> parts;
  std::vector<std::string> names;
  std::vector<std::vector<double>> found;
  PetscInt size = 0, first = 0, end = 0;
  PetscFunctionBegin;
  out->clear();
  if (!statics || !current) PetscCall(fail(comm, Exit::input, "there is no equilibrium of the numbers of now: solve for one first"));
  PetscCall(require_given());
  PetscCall(statics->equilibrium().gather_state(statics->last(), &parts));
  PetscCall(VecGetSize(parts[0].vec, &size));
  PetscCall(VecGetOwnershipRange(parts[0].vec, &first, &end));
  if (slope.size() != static_cast<std::size_t>(size))
    PetscCall(fail(comm, Exit::input, format("%zu slopes for %lld components of positions", slope.size(), static_cast<long long>(size))));
  names = {"stiffness", "rest_length"};
  for (const SpringParameter& one : spring_parameters())
    if (changeable_numbers(given.get(), one.name)) names.emplace_back(one.name);
  for (const std::string& name : interaction_numbers(*given)) names.push_back(name);
  PetscCall(statics->sensitivities({slope.begin() + first, slope.begin() + end}, names, &found));
  for (std::size_t k = 0; k < names.size(); ++k)
    for (const std::int64_t row : removed)  // they exert nothing, whatever their numbers
      if (interaction_number(names[k]).kind < 0 && static_cast<std::size_t>(row) < found[k].size()) found[k][static_cast<std::size_t>(row)] = 0;
  for (std::size_t k = 0; k < names.size(); ++k)
    if (found[k].size() == changeable_numbers(given.get(), names[k]).size()) (*out)[names[k]] = std::move(found[k]);  // else the law does not say
  PetscFunctionReturn(0);
}

/// The run ends where it is; the next one begins there.
PetscErrorCode Session::Impl::hold_state() {
  Vec y;
  PetscFunctionBegin;
  PetscCall(require_particles());
  PetscCall(refuse_files());
  resumed.reset();
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

/// Systems whose matrices lack a spring that these numbers let exert something: the one that is stepped is made anew, at the state that it has.
PetscErrorCode Session::Impl::make_room(const std::string& name, const std::vector<double>& all) {
  bool lacks = false;
  State now;
  PetscFunctionBegin;
  if (statics) PetscCall(statics->equilibrium().mechanics()->lacks_pattern(name, all, &lacks));
  if (lacks) drop_statics();
  if (!model) PetscFunctionReturn(0);
  PetscCall(model->mechanics()->lacks_pattern(name, all, &lacks));
  if (!lacks) PetscFunctionReturn(0);
  PetscCall(save(&now));
  run.reset();
  given_state.reset();
  resumed.reset();
  viewed = false;
  held_by<Client>(comm).changes_numbers = true;
  PetscCall(make_model(&model));
  PetscCall(restore(now));
  PetscFunctionReturn(0);
}

/// To what is stepped and to what follow() goes on from.
PetscErrorCode Session::Impl::pass_on(const std::string& name, const std::vector<double>& all) {
  PetscFunctionBegin;
  if (model) {
    std::vector<double> before;
    PetscCall(hold_state());
    if (!original.count(name)) PetscCall(model->mechanics()->numbers(name, &before));
    PetscCall(model->mechanics()->set_numbers(name, all));
    original.emplace(name, std::make_shared<const std::vector<double>>(std::move(before)));
    changed[name] = std::make_shared<const std::vector<double>>(all);
  }
  current = false;
  if (statics) PetscCall(statics->equilibrium().mechanics()->set_numbers(name, all));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::set_numbers(const std::string& name, const std::vector<double>& all) {
  Error error;
  std::string why;
  PetscFunctionBegin;
  PetscCall(require_given());
  if (model) PetscCall(refuse_files());
  const NumberColumn column = changeable_numbers(given.get(), name);
  const std::vector<double> before = column ? column.values() : std::vector<double>();
  const std::vector<std::string> gone = numbers_of_removed();
  std::vector<double> now = all;
  if (now.size() == before.size() && std::count(gone.begin(), gone.end(), name))
    for (const std::int64_t row : removed) {
      double& own = now[static_cast<std::size_t>(row)];
      if (usable(own) && (own > 0 || (name != "stiffness" && name != "damping"))) own = 0;  // others are refused, as of any spring
    }
  if (!change_numbers(given.get(), name, now, &why)) error.note(0, why);
  PetscCall(fail_if_any(comm, error));
  now = column.values();
  column.assign(before);  // room is made for the system as it was
  PetscCall(make_room(name, now));
  column.assign(now);
  const PetscErrorCode code = pass_on(name, now);
  if (code) column.assign(before);
  PetscFunctionReturn(code);
}

/// Those that are 0 of a spring that is removed.
std::vector<std::string> Session::Impl::numbers_of_removed() const {
  std::vector<std::string> names = {"stiffness", "damping"};
  for (const SpringParameter& one : spring_parameters())
    if (!one.positive && changeable_numbers(given.get(), one.name)) names.emplace_back(one.name);
  return names;
}

PetscErrorCode Session::Impl::remove_springs(const std::vector<std::int64_t>& rows) {
  Error error;
  PetscErrorCode code = 0;
  PetscFunctionBegin;
  PetscCall(require_given());
  const std::int64_t springs = given->springs.total;
  for (const std::int64_t row : rows)
    if (row < 0 || row >= springs)
      error.note(row, format("spring %lld: there are %lld springs, from 0", static_cast<long long>(row), static_cast<long long>(springs)));
  PetscCall(fail_if_any(comm, error));
  const std::set<std::int64_t> before = removed;
  removed.insert(rows.begin(), rows.end());
  for (const std::string& name : numbers_of_removed())
    if (!code) code = set_numbers(name, changeable_numbers(given.get(), name).values());
  if (code) removed = before;
  PetscFunctionReturn(code);
}

/// Those of a state: of all that were ever changed, for springs that were broken until now have what they had when they broke.
NumberTable Session::Impl::numbers_of(const State& state) const {
  NumberTable then = original;
  for (const auto& [name, numbers] : state.changed) then[name] = numbers;
  return then;
}

PetscErrorCode Session::Impl::restore_numbers(const State& state) {
  PetscFunctionBegin;
  removed = state.removed;
  for (const auto& [name, numbers] : numbers_of(state)) {
    changeable_numbers(given.get(), name).assign(*numbers);
    PetscCall(pass_on(name, *numbers));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
