#include "systems/particles/terms.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/dimension.hpp"
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "systems/particles/coupling.hpp"
#include "systems/particles/interactions/kinds.hpp"

namespace bs {

Terms::Terms(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern, Coupling* coupling)
    : net_(net), pairs_(with_dimension(net.dim, [&](auto d) { return create_pair_forces_of<d>(net, laws, motion, pattern); })), terms_{pairs_.get()} {
  if (coupling) add(*coupling);
  for (std::size_t kind = 0; kind < net.interactions.size() && net.dim > 1; ++kind) {
    const InteractionTable& table = net.interactions[kind];
    const InteractionMaker& maker = interaction_makers()[kind];
    if (table.total > 0) interactions_.push_back(net.dim == 2 ? maker.plane(net, table) : maker.space(net, table));
  }
  for (const std::unique_ptr<Term>& term : interactions_) add(*term);
}

PetscErrorCode Terms::remember(Network& net, const Lattice& lattice, const BreakRules& rules) {
  PetscFunctionBegin;
  rules_ = rules;
  breaking_.create(net.comm, rules.worst, rules.with_springs);
  for (Term* term : terms_) {
    PetscCall(term->remember(net, lattice, rules));
    if (Breakable* kind = term->breakable()) breaking_.add(*kind);
  }
  PetscFunctionReturn(0);
}

bool Terms::remembers() const {
  return std::any_of(terms_.begin(), terms_.end(), [](const Term* term) { return term->remembers(); });
}

PetscErrorCode Terms::gather_history(std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  parts->clear();
  for (Term* term : terms_) PetscCall(term->gather_history(parts));
  PetscCall(breaking_.gather(parts));
  PetscFunctionReturn(0);
}

PetscErrorCode Terms::begin_step(const Step& step, const LocalState& state) {
  PetscFunctionBegin;
  for (Term* term : terms_) PetscCall(term->begin_step(step, state));
  renew();
  PetscFunctionReturn(0);
}

PetscErrorCode Terms::accept(const Step& step, const LocalState& state) {
  PetscFunctionBegin;
  for (Term* term : terms_) PetscCall(term->accept(step, state));
  if (remembers()) renew();
  PetscFunctionReturn(0);
}

PetscErrorCode Terms::recall() {
  PetscFunctionBegin;
  renew();
  for (Term* term : terms_) PetscCall(term->recall());
  PetscCall(breaking_.recall());
  PetscFunctionReturn(0);
}

PetscErrorCode Terms::history_fields(std::vector<Field>* out) {
  PetscFunctionBegin;
  for (Term* term : terms_) PetscCall(term->history_fields(out));
  PetscCall(breaking_.fields(out));
  PetscFunctionReturn(0);
}

void Terms::keep(const Keeper& keep) {
  for (Term* term : terms_) term->keep(keep);
  breaking_.keep(keep);
  if (remembers()) keep("dissipated_before", dissipated_before_);
}

PetscErrorCode Terms::dissipated(double* energy) const {
  PetscFunctionBegin;
  *energy = 0;
  for (const Term* term : terms_) *energy += term->dissipated();
  PetscCall(sum_over_ranks(net_.comm, energy));
  *energy += breaking_.dissipated() + dissipated_before_;
  PetscFunctionReturn(0);
}

PetscErrorCode Terms::keep_dissipated(double before) {
  double now = 0;
  PetscFunctionBegin;
  if (!remembers()) PetscFunctionReturn(0);
  PetscCall(dissipated(&now));
  dissipated_before_ += before - now;
  PetscFunctionReturn(0);
}

PetscErrorCode Terms::gather(const LocalState& state) {
  PetscFunctionBegin;
  for (Term* term : terms_) PetscCall(term->gather(state));
  PetscFunctionReturn(0);
}

void Terms::forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const {
  for (const Term* term : terms_) term->forces(part, t, state, f, fault, sum);
}

Energies Terms::energies(double t, const LocalState& state) const {
  Energies sum;
  for (const Term* term : terms_) term->energies(t, state, &sum);
  return sum;
}

/// -b D - c K of what no pair of linked particles has into `blocks`, which are laid out at first use; `rows`: without what comes by rows. False:
/// there is no such term.
bool Terms::fill(double t, const LocalState& state, bool positive, bool rows, const Coefficients& abc, SparseBlocks* blocks) const {
  if (!blocks->created()) {
    std::vector<std::pair<PetscInt, PetscInt>> joins;
    for (const Term* term : terms_) term->join(&joins);
    if (interactions_.empty() && joins.empty()) return false;
    blocks->create(net_.n, net_.dim, joins);
  }
  blocks->zero();
  for (const Term* term : terms_)
    if (!(rows && term->by_rows())) term->add_blocks(t, state, positive, abc, blocks);
  return true;
}

PetscErrorCode Terms::jacobian(double t, const LocalState& state, double sigma, bool momentum, RowWriter* writer) const {
  PetscFunctionBegin;
  if (fill(t, state, false, true, {0, 0, 1}, &blocks_)) {
    if (!momentum) {
      std::vector<double> scale = net_.inertia;
      for (double& m : scale) m = 1 / m;
      blocks_.scale_rows(scale);
    }
    writer->add(&blocks_);
  }
  PetscCall(pairs_->jacobian(t, state, terms_, sigma, momentum, writer));
  PetscFunctionReturn(0);
}

// S = a M - b D - c K
void Terms::condense_springs(double t, const LocalState& state, const Coefficients& abc, bool positive, PairMatrix* S) const {
  pairs_->condense_springs(t, state, abc, positive, S);
  fill(t, state, positive, false, abc, &S->remainder());
}

PetscErrorCode Terms::condense_rows(double t, const LocalState& state, const Coefficients& abc, bool positive, RowWriter* writer) const {
  PetscFunctionBegin;
  if (fill(t, state, positive, false, abc, &blocks_)) writer->add(&blocks_);
  PetscCall(pairs_->condense_rows(t, state, abc, positive, writer));
  PetscFunctionReturn(0);
}

PotentialChange Terms::beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma) const {
  PotentialChange sum;
  for (const Term* term : terms_) term->beyond_slope(t, state, line, lambda, sigma, &sum);
  return sum;
}

std::string Terms::lacks_potential() const {
  std::string what;
  for (auto term = terms_.rbegin(); term != terms_.rend() && what.empty(); ++term) what = (*term)->lacks_potential();
  return what;
}

bool Terms::symmetric() const {
  return std::all_of(terms_.begin(), terms_.end(), [](const Term* term) { return term->symmetric(); });
}

bool Terms::complete() const {
  return std::all_of(terms_.begin(), terms_.end(), [](const Term* term) { return term->complete(); });
}

std::vector<double> Terms::rates() const {
  std::vector<double> sum(static_cast<std::size_t>(net_.n), 0.0);
  for (const Term* term : terms_) term->add_rates(&sum);
  return sum;
}

/// The lowest rank reports.
PetscErrorCode interaction_fault(MPI_Comm comm, bool mine, const Singularity& fault, std::string* text) {
  Error error;
  PetscFunctionBegin;
  if (mine)
    error.note(0, format("%s %lld met %s: lower -ts_dt, or keep its particles apart", fault.law, static_cast<long long>(fault.row), fault.why));
  PetscCall(first_error(comm, error, text));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticlePotential::create(const Network& net, const Terms& terms, Vec layout, bool coupled) {
  PetscFunctionBegin;
  net_ = &net;
  terms_ = &terms;
  layout_ = layout;
  lacks_ = coupled ? "a force that couples all particles" : terms.lacks_potential();
  PetscCall(first_error(net.comm, {0, lacks_}, &lacks_));  // dampers may be on one rank only, whose answer then holds for all
  PetscFunctionReturn(0);
}

// F_x = M (x' - v)
PetscErrorCode ParticlePotential::add_kinematic(Vec F, Vec y) {
  const Layout at{net_->dim, net_->n};
  PetscFunctionBegin;
  const ReadArray aF(F);
  const WriteArray ay(y);
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) ay[at.v(i, c)] += aF[at.x(i, c)] / net_->inertia[i];
  PetscFunctionReturn(0);
}

PetscErrorCode ParticlePotential::follow(Vec y, Vec z) {
  PetscFunctionBegin;
  if (!state_.created()) {
    PetscCall(state_.create(*net_, layout_));
    PetscCall(line_.create(*net_, layout_));
  }
  PetscCall(state_.gather(0.0, y));  // driven particles: beyond_slope knows the time
  PetscCall(line_.gather_direction(z));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticlePotential::beyond_slope(double t, double sigma, double lambda, PotentialChange* change) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::potential);
  state_.drive_to(t);
  *change = terms_->beyond_slope(t, state_, line_, lambda, sigma);
  double sums[2] = {change->value, change->noise};
  PetscCall(sum_over_ranks(net_->comm, sums, 2));
  *change = {sums[0], sums[1]};
  PetscFunctionReturn(0);
}

bool ParticlePotential::limits_steps() const {
  return std::any_of(terms_->begin(), terms_->end(), [](const Term* term) { return term->limits_steps(); });
}

PetscErrorCode ParticlePotential::largest_lambda(double t, double* lambda) {
  PetscFunctionBegin;
  *lambda = std::numeric_limits<double>::infinity();
  state_.drive_to(t);
  for (const Term* term : *terms_) {
    if (!term->limits_steps()) continue;
    const double most = term->largest_lambda(t, state_, line_);
    *lambda = std::min(*lambda, most > 0 ? most : 0);  // 0, too, where it is no number
  }
  PetscCall(min_over_ranks(net_->comm, lambda));
  PetscFunctionReturn(0);
}

}  // namespace bs
