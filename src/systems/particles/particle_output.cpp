// What a particle system shows: header lines, observables, fields of a frame, constant data.
#include <algorithm>
#include "base/arrays.hpp"
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "base/options.hpp"
#include "base/text.hpp"
#include "network/migrate.hpp"
#include "systems/particles/lattice_tables.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

/// Name and formula of every law that some spring obeys, and of the anchors' where that is another one.
std::string ParticleModel::spring_laws_in_words() const {
  const auto words = [](std::size_t law) { return std::string(spring_laws()[law].name) + " " + spring_laws()[law].title; };
  const std::size_t own = static_cast<std::size_t>(lattice_.spring_law), anchors = static_cast<std::size_t>(anchor_law(lattice_));
  std::string text;
  for (std::size_t law = 0; law < net_.laws.size(); ++law)
    if (net_.laws[law]) text += (text.empty() ? "" : "; ") + words(law);
  if (text.empty()) text = words(own) + (lattice_.spring_law_given ? "" : " (assumed)");
  if (net_.mixed && net_.anchors_total > 0 && text != words(anchors)) text += "; anchors: " + words(anchors);
  return text;
}

std::vector<std::string> ParticleModel::describe() const {
  std::vector<std::string> lines;
  lines.push_back(how_many(net_.total, "particle") +
                  format(" (%lld fixed%s) in ", static_cast<long long>(net_.fixed_total), constraints_.drives() ? " or driven" : "") +
                  how_many(net_.dim, "dimension") + ", " + how_many(net_.springs_total, "spring") + ", " + how_many(net_.anchors_total, "anchor") +
                  count_text(net_) + ", from " + net_.source);
  if (net_.springs_total + net_.anchors_total > 0)
    lines.push_back("springs: " + spring_laws_in_words() + ", damping: " + damper_laws()[static_cast<std::size_t>(net_.damping_law)].first + " " +
                    damper_laws()[static_cast<std::size_t>(net_.damping_law)].second + (lattice_.damping_law_given ? "" : " (assumed)"));
  for_each_law(laws_, [&](const auto& law) {
    if (law.active()) lines.push_back("law: " + law.describe());
  });
  if (const DisplacedFluid& fluid = std::get<UniformGravity>(laws_).fluid; fluid.active()) lines.push_back("law: " + fluid.describe());
  if (terms_->breaking().active()) lines.push_back(terms_->break_rules().describe(lattice_));
  for (const std::string& line : constraints_.describe()) lines.push_back(line);
  for (const std::string& line : forces_.describe()) lines.push_back(line);
  if (coupling_.active()) lines.push_back("law: " + coupling_.describe());
  lines.push_back("divided among ranks by " + net_.partition);
  return lines;
}

PetscErrorCode ParticleModel::observe(double t, Vec y, std::vector<Observable>* out) {
  const PetscInt d = net_.dim;
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::energies, y);
  PetscCall(gather(t, y));
  const Energies e = energies_at(t, y);
  double sums[9] = {e.kinetic, e.elastic, e.field};
  std::copy_n(e.momentum, 3, sums + 3);
  std::copy_n(e.angular_momentum, 3, sums + 6);
  PetscCall(sum_over_ranks(net_.comm, sums, 9));
  out->clear();
  out->push_back({"kinetic_energy", {sums[0]}});
  out->push_back({"elastic_energy", {sums[1]}});
  out->push_back({"potential_energy", {sums[1] + sums[2]}});
  out->push_back({"total_energy", {sums[0] + sums[1] + sums[2]}});
  if (terms_->remembers()) {
    double lost = 0;
    PetscCall(terms_->dissipated(&lost));
    out->push_back({"dissipated_energy", {lost}});
  }
  terms_->breaking().observe(out);
  out->push_back({"momentum", std::vector<double>(sums + 3, sums + 3 + d)});
  out->push_back({"angular_momentum", std::vector<double>(sums + 6, sums + 9)});
  if (reactions_.reports() || reactions_.works()) {
    reactions_.begin(t, state_);
    PetscCall(reactions_.observe(t, state_, out));
  }
  if (forces_.active()) PetscCall(forces_.observe(t, state_, out));
  if (constraints_.box().active()) PetscCall(observe_box(t, out));
  PetscCall(stress_.observe(*terms_, t, state_, out));
  PetscFunctionReturn(0);
}

/// For the first frame that is written.
PetscErrorCode ParticleModel::make_order() {
  PetscFunctionBegin;
  if (!order_.created()) PetscCall(order_.create(net_, static_cast<PetscInt>(lattice_.particles.count), y0_));
  PetscFunctionReturn(0);
}

/// order_ from y.
PetscErrorCode ParticleModel::fill_output(Vec y) {
  PetscFunctionBegin;
  PetscCall(make_order());
  PetscCall(order_.from_state(y));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::fields(double t, Vec y, std::vector<Field>* out) {
  Vec shown;
  PetscFunctionBegin;
  PetscCall(constraints_.show(t, y, &shown));
  PetscCall(make_order());
  std::pair<RowSource, RowSource> sources;
  if (order_.has_all()) sources = order_.sources(shown);
  else PetscCall(order_.from_state(shown));
  *out = {{"/particles/trajectory/position", order_.position(), false, sources.first},
          {"/particles/trajectory/velocity", order_.velocity(), false, sources.second}};
  PetscCall(terms_->history_fields(out));
  if (Breakable* springs = terms_->pairs().breakable()) {
    Vec broken;
    PetscCall(springs->flags(&broken));
    PetscCall(draw_broken(broken));
    out->push_back({"/backspring/drawn", drawn_, false, {}, false, true});
  }
  if (springs_.active() || stress_.in_frames()) PetscCall(gather(t, y));
  if (stress_.in_frames()) {
    Vec stresses;
    PetscCall(stress_.field(*terms_, t, state_, static_cast<PetscInt>(lattice_.particles.count), &stresses));
    out->push_back({"/particles/trajectory/stress_volume", stresses});
  }
  PetscCall(springs_.fields(*terms_, state_, out));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::take_constants(std::vector<Dataset>* out) {
  PetscFunctionBegin;
  out->clear();
  if (lattice_.springs.total > 0) PetscCall(add_drawn("/connectivity/bonds", out));
  put_thresholds(terms_->break_rules(), lattice_, out);
  PetscCall(take_tables(net_.comm, hdf5_layout(true), &lattice_, out));
  PetscFunctionReturn(0);
}

/// What the run needs of the chunk lives on in the network; counts and shares of rows stay.
void ParticleModel::release_input() {
  for (std::vector<double>* table :
       {&lattice_.position, &lattice_.velocity, &lattice_.mass, &lattice_.stiffness, &lattice_.rest_length, &lattice_.damping})
    release(*table);
  release(lattice_.particle_columns);
  release(lattice_.break_columns);
  release(lattice_.id);
  release(lattice_.pairs);
}

}  // namespace bs
