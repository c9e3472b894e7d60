// The state of a particle system in the input's order, and what tells its lattice from others.
#include <algorithm>
#include <string>
#include "base/collective.hpp"
#include "base/hash.hpp"
#include "base/vec_array.hpp"
#include "systems/particles/lattice_tables.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

std::vector<ParticleGroup> ParticleModel::groups() const {
  std::vector<ParticleGroup> all;
  for (const NetworkGroup& group : net_.groups) {
    const auto ghosts = std::lower_bound(group.member.begin(), group.member.end(), net_.n);
    all.push_back({group.name, group.total, {group.member.begin(), ghosts}});
  }
  return all;
}

PetscErrorCode ParticleModel::gather_state(Vec y, std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  PetscCall(fill_output(y));
  *parts = {{"position", order_.position()}, {"velocity", order_.velocity()}};
  PetscFunctionReturn(0);
}

/// Histories are brought up to the state that was gathered, the end of `step`; no time goes by in load steps.
PetscErrorCode ParticleModel::commit(Step step) {
  PetscFunctionBegin;
  if (loads_) step.h = 0;
  PetscCall(terms_->accept(step, state_));
  PetscFunctionReturn(0);
}

bool ParticleModel::begins_steps() const {
  return std::any_of(terms_->begin(), terms_->end(), [](const Term* term) { return term->begins_steps(); });
}

PetscErrorCode ParticleModel::begin_step(const Step& step, Vec y) {
  PetscFunctionBegin;
  PetscCall(gather(step.t, y));
  PetscCall(terms_->begin_step(step, state_));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::accept(const Step& step, Vec y) {
  const double t = step.t;
  PetscFunctionBegin;
  constraints_.box().keep_strains();
  if (!terms_->remembers() && !reactions_.works() && !breaks()) PetscFunctionReturn(0);
  PetscCall(gather(t, y));
  PetscCall(commit(step));
  PetscCall(reactions_.advance(t, state_));
  PetscCall(terms_->breaking().break_parts(t, loads_ ? t : 1, loads_, state_));
  if (terms_->breaking().broke() > 0) reactions_.renew(t, state_);
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::begin_at(double t, Vec y) {
  PetscFunctionBegin;
  constraints_.box().keep_strains();
  PetscCall(gather(t, y));
  PetscCall(commit({t, 0}));
  reactions_.renew(t, state_);
  PetscFunctionReturn(0);
}

std::string ParticleModel::why_not_by_rows() const {
  if (size_of(net_.comm) > 1) return "particles are divided among several ranks";
  if (constraints_.holds_groups()) return "where groups are held or move as given is no part of it";
  for (PetscInt i = 0; i < net_.n; ++i)
    if (net_.row[static_cast<std::size_t>(i)] != i)
      return "its particles stand in an order that is good for the cache; -bs_ordering rows keeps that of the lattice";
  return {};
}

PetscErrorCode ParticleModel::place_held(double t, Vec y) {
  PetscFunctionBegin;
  constraints_.place(t, 0, net_.n, WriteArray(y));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::reactions(double t, Vec y, std::vector<double>* out) {
  const std::size_t d = static_cast<std::size_t>(net_.dim);
  PetscFunctionBegin;
  PetscCall(gather(t, y));
  const std::vector<double> reaction = reactions_.of_holders(t, state_);
  out->assign(static_cast<std::size_t>(net_.n) * d, 0.0);
  constraints_.for_held([&](std::size_t k, int c) { (*out)[static_cast<std::size_t>(constraints_.holders()[k]) * d + c] = reaction[k * d + c]; });
  PetscFunctionReturn(0);
}

void ParticleModel::keep_sums(const Keeper& keep) {
  reactions_.keep(keep);
  terms_->keep(keep);
  constraints_.box().keep(keep);
}

PetscErrorCode ParticleModel::fingerprint(std::uint64_t* value) {
  PetscFunctionBegin;
  *value = fingerprint_;
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::take_fingerprint(const Lattice& lattice, const std::vector<std::uint8_t>& fixed) {
  PetscFunctionBegin;
  const std::int64_t p = lattice.particles.first, s = lattice.springs.first, a = lattice.anchors.first;
  const int d = lattice.dim;
  RowSum sum;
  sum.add(0, p, d, lattice.position);
  sum.add(1, p, d, lattice.velocity);
  sum.add(numbers_table("mass"), p, 1, lattice.mass);
  sum.add(4, p, 1, fixed);
  sum.add(5, s, 2, lattice.pairs);
  sum.add(numbers_table("stiffness"), s, 1, lattice.stiffness);
  sum.add(numbers_table("rest_length"), s, 1, lattice.rest_length);
  sum.add(numbers_table("damping"), s, 1, lattice.damping);
  sum.add(9, a, 1, lattice.anchor_particle);
  sum.add(10, a, d, lattice.anchor_point);
  sum.add(11, a, 1, lattice.anchor_stiffness);
  sum.add(12, a, 1, lattice.anchor_rest_length);
  sum.add(13, a, 1, lattice.anchor_damping);
  add_to_fingerprint(lattice, &sum);
  sum.add(15, s, 1, lattice.spring_laws);
  sum.add(17, s, d, lattice.shift);
  for (const Column& column : lattice.spring_columns) sum.add(numbers_table(column.name), s, 1, column.value);
  for (const Column& column : lattice.break_columns) sum.add(numbers_table(column.name), s, 1, column.value);
  for (const Column& column : lattice.particle_columns) {
    const ParticleParameter& one = particle_parameters[particle_parameter(column.name)];
    sum.add(one.table ? one.table : (std::uint64_t{1} << 63) + table_of(column.name), p, one.width(d), column.value);
  }
  if (constraints_.holds_groups()) sum.add(16, p, 1, constraints_.take_held_bits());  // the state of a checkpoint says nothing of what was held
  if (p == 0) {
    const std::int64_t laws[3] = {static_cast<std::int64_t>(lattice.spring_law), static_cast<std::int64_t>(lattice.damping_law),
                                  lattice.rest_at_zero_length ? 1 : 0};
    // the first rank's value is used; chunks before the first particle are empty
    if (lattice.particles.count > 0 || lattice.particles.total == 0) sum.add(14, 0, 1, 3, laws);
    if (lattice.particles.count > 0 && lattice.box.active())
      sum.add(18, 0, 1, std::vector<double>(lattice.box.edges.begin(), lattice.box.edges.begin() + static_cast<std::ptrdiff_t>(d) * d));
  }
  fingerprint_ = sum.value();
  PetscCall(sum_over_ranks(net_.comm, &fingerprint_));
  PetscFunctionReturn(0);
}

}  // namespace bs
