// Numbers of springs, particles and interactions that are given anew while the system lives.
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/hash.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/particles/lattice_tables.hpp"
#include "systems/particles/particle_model.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {
namespace {

/// The number of that name that the law of link e takes beyond stiffness and rest length; null: it takes none.
double* law_number(Links* links, std::size_t e, const std::string& name) {
  if (links->law.empty()) return nullptr;
  const std::vector<SpringParameter>& parameters = spring_laws()[links->law[e]].parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k)
    if (name == parameters[k].name) return &links->more[e * static_cast<std::size_t>(links->width) + k];
  return nullptr;
}

/// Every link knows its spring's row: nothing travels. A broken spring stays what it is.
void give_links(const std::string& name, const std::vector<double>& all, Links* links) {
  HugeVector<double>* const column = name == "stiffness" ? &links->stiffness : name == "rest_length" ? &links->rest_length : nullptr;
  const bool damping = name == "damping";
  for (std::size_t e = 0; e < links->spring.size(); ++e) {
    if (links->spring[e] < 0 || links->is_broken(static_cast<PetscInt>(e))) continue;
    double* const at = column                               ? &(*column)[e]
                       : damping && !links->damping.empty() ? &links->damping[e]
                       : damping                            ? nullptr
                                                            : law_number(links, e, name);
    if (at) *at = all[static_cast<std::size_t>(links->spring[e])];
  }
}

}  // namespace

/// Once: matrices keep the blocks that they have at first.
void ParticleModel::find_roomless() {
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt e = net_.links.start[i]; e < net_.links.start[i + 1]; ++e)
      if (net_.links.spring[e] >= 0 && !net_.fixed[net_.links.other[e]] && !has_block(net_, e)) roomless_.push_back(e);
}

PetscErrorCode ParticleModel::lacks_pattern(const std::string& name, const std::vector<double>& all, bool* yes) {
  PetscFunctionBegin;
  const bool springs = name != "mass" && interaction_number(name).kind < 0;
  const bool rates = springs && name != "rest_length" && static_cast<std::int64_t>(all.size()) == net_.springs_total;
  const auto acts = [&](PetscInt e) { return all[static_cast<std::size_t>(net_.links.spring[e])] != 0; };
  PetscCall(on_some_rank(net_.comm, rates && std::any_of(roomless_.begin(), roomless_.end(), acts), yes));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::set_numbers(const std::string& name, const std::vector<double>& all) {
  double dissipated = 0;
  PetscFunctionBegin;
  PetscCall(terms_->dissipated(&dissipated));
  const InteractionNumber of = interaction_number(name);
  const std::size_t kind = static_cast<std::size_t>(of.kind);
  InteractionTable* const table = of.kind < 0 || kind >= net_.interactions.size() ? nullptr : &net_.interactions[kind];
  if (static_cast<std::int64_t>(all.size()) != (table ? table->total : name == "mass" ? net_.total : net_.springs_total))
    PetscCall(fail(net_.comm, Exit::input,
                   "options have changed the lattice's springs or particles: numbers of the lattice as it was given are not theirs"));
  if (name == "mass") {
    if (coupling_.active())
      PetscCall(fail(net_.comm, Exit::input, "masses beside a force that couples all particles by them cannot be changed: make another lattice"));
    for (PetscInt i = 0; i < net_.n; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      net_.mass[k] = net_.inertia[k] = all[static_cast<std::size_t>(net_.row[k])];
    }
    add_mass();
  } else if (table) {
    const std::size_t width = table->row.empty() ? 0 : table->parameter.size() / table->row.size();
    for (std::size_t k = 0; k < table->row.size(); ++k) table->parameter[k * width + of.place] = all[static_cast<std::size_t>(table->row[k])];
  } else {
    give_links(name, all, &net_.links);
  }
  PetscCall(note_numbers(name, all));
  PetscCall(terms_->keep_dissipated(dissipated));
  terms_->renew();
  rates_ = terms_->rates();
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::numbers(const std::string& name, std::vector<double>* all) {
  const NumberColumn column = changeable_numbers(&lattice_, name);
  PetscFunctionBegin;
  PetscCall(gather_all(net_.comm, column ? column.values() : std::vector<double>(), all));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::force_changes(const std::string& name, double t, Vec y, Vec lambda, std::vector<double>* rows) {
  LocalState direction;
  PetscFunctionBegin;
  PetscCall(gather(t, y));
  PetscCall(direction.create(net_, y));
  PetscCall(direction.gather_direction(lambda));
  rows->clear();
  for (Term* term : *terms_) PetscCall(term->force_changes(name, state_, direction, rows));
  PetscFunctionReturn(0);
}

/// In what is kept of the input, and in the fingerprint, which is a sum over tables.
PetscErrorCode ParticleModel::note_numbers(const std::string& name, const std::vector<double>& all) {
  const NumberColumn column = changeable_numbers(&lattice_, name);
  const Rows& rows = column.kind >= 0 ? lattice_.interactions[static_cast<std::size_t>(column.kind)].rows
                     : name == "mass" ? lattice_.particles
                                      : lattice_.springs;
  RowSum before, after;
  PetscFunctionBegin;
  if (column && column.size() == static_cast<std::size_t>(rows.count)) {
    const int width = static_cast<int>(column.width);
    before.add(numbers_table(name), rows.first, width, *column.table);
    column.assign({all.begin() + rows.first, all.begin() + rows.first + rows.count});
    after.add(numbers_table(name), rows.first, width, *column.table);
  }
  std::uint64_t change = after.value() - before.value();
  PetscCall(sum_over_ranks(net_.comm, &change));
  fingerprint_ += change;
  PetscFunctionReturn(0);
}

}  // namespace bs
