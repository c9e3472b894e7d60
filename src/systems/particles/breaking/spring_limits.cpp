// What of springs may break: limits of those that this rank judges, and those that are broken from the start.
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "network/ghost_copies.hpp"
#include "systems/particles/breaking/spring_breaks.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

PetscErrorCode SpringBreaks::create(Network& net, const Lattice& lattice, const BreakRules& rules, const PairForces& pairs) {
  PetscFunctionBegin;
  net_ = &net;
  pairs_ = &pairs;
  rules_ = rules;
  PetscCall(table_.create(net, lattice.springs));
  net.links.broken.assign(net.links.spring.size(), 0);
  for (std::size_t e = 0; e < net.links.spring.size(); ++e)
    if (net.links.spring[e] >= 0) links_by_row_.emplace_back(net.links.spring[e], static_cast<PetscInt>(e));
  std::sort(links_by_row_.begin(), links_by_row_.end());
  PetscCall(rows_with_ghosts(net, &end_row_));
  PetscCall(give_limits(lattice));
  if (rules_.notched) PetscCall(cut_notch());
  cuts_.clear();  // these are broken for good
  PetscFunctionReturn(0);
}

/// What this rank judges, with the limits of each spring; springs that were broken before are cut.
PetscErrorCode SpringBreaks::give_limits(const Lattice& lattice) {
  const Links& links = net_->links;
  const std::vector<std::uint8_t> spared = rules_.spared_particles(*net_);
  Error fault;
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e)
      if (links.spring[e] >= 0 && net_->global[i] <= net_->global[links.other[e]] && !spared[i] && !spared[links.other[e]] &&
          (net_->room || exists(*net_, e)))
        judged_.push_back({i, e});
  if (rules_.scatter != BreakRules::none)
    for (const Judged& one : judged_) factor_.push_back(rules_.factor(links.spring[one.link]));
  std::vector<double> by_link(links.spring.size(), 0.0);
  for (const Column& column : lattice.break_columns) {
    VecHandle rows;
    PetscCall(VecCreateMPIWithArray(net_->comm, 1, static_cast<PetscInt>(column.value.size()), PETSC_DETERMINE, column.value.data(), rows.out()));
    PetscCall(table_.spread(rows, [&](PetscInt e, double value) { by_link[static_cast<std::size_t>(e)] = value; }));
    if (column.name == BROKEN) {
      for (std::size_t e = 0; e < by_link.size(); ++e)
        if (by_link[e] != 0) cut_link(static_cast<PetscInt>(e));
      given_broken_ = true;
    }
    for (int c = 0; c < BREAK_LIMITS; ++c)
      if (column.name == break_limits[c].name)
        for (const Judged& one : judged_) column_[c].push_back(by_link[static_cast<std::size_t>(one.link)]);
  }
  for (std::size_t k = 0; k < judged_.size() && !fault; ++k)
    if (links.rest_length[judged_[k].link] == 0 && std::isfinite(limit(k, BREAK_STRAIN)))
      fault.note(links.spring[judged_[k].link],
                 format("%s: spring %lld has the rest length 0, so that it has no strain: give -bs_break_force or -bs_break_energy in the place of a "
                        "critical strain",
                        lattice.source.c_str(), static_cast<long long>(links.spring[judged_[k].link])));
  PetscCall(fail_if_any(net_->comm, fault));
  PetscFunctionReturn(0);
}

// The ends of either line lie on both sides of the other. Ends are taken by their global numbers, so that both ranks of a cut spring agree.
PetscErrorCode SpringBreaks::cut_notch() {
  const Links& links = net_->links;
  const double *a = rules_.notch, *b = rules_.notch + 2;
  const auto side = [](const double* p, const double* q, const double* r) { return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]); };
  std::int64_t count = 0;
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      const PetscInt j = links.other[e];
      if (links.spring[e] < 0 || !exists(*net_, e)) continue;
      const bool first = net_->global[i] < net_->global[j];
      const double *p = net_->held.data() + 2 * static_cast<std::size_t>(first ? i : j),
                   *q = net_->held.data() + 2 * static_cast<std::size_t>(first ? j : i);
      if ((side(a, b, p) < 0) == (side(a, b, q) < 0) || (side(p, q, a) < 0) == (side(p, q, b) < 0)) continue;
      cut_link(e);
      ++count;
    }
  PetscCall(sum_over_ranks(net_->comm, &count));
  if (count == 0) PetscCall(fail(net_->comm, Exit::input, "option -bs_break_notch: no spring crosses that line: give a line through the lattice"));
  given_broken_ = true;
  PetscFunctionReturn(0);
}

namespace {

/// Limit times factor of every row of a kind.
void put_threshold(const BreakRules& rules, const BreakLimit& one, double limit, const std::vector<Column>& columns, const Rows& rows,
                   std::int64_t of, const std::string& path, std::vector<Dataset>* out) {
  const Column* own = find_column(columns, one.name);
  if (!own && !std::isfinite(limit)) return;
  std::vector<double> value = own ? own->value : std::vector<double>(static_cast<std::size_t>(rows.count), limit);
  for (std::size_t k = 0; k < value.size(); ++k) value[k] *= rules.factor(rows.first + static_cast<std::int64_t>(k), of);
  out->push_back({path + one.threshold, rows.first, rows.total, 0, std::move(value), {}, one.powers, true});
}

}  // namespace

void put_thresholds(const BreakRules& rules, const Lattice& lattice, std::vector<Dataset>* out) {
  if (rules.scatter == BreakRules::none) return;
  for (int c = 0; c < BREAK_LIMITS && lattice.springs.total > 0; ++c)
    put_threshold(rules, break_limits[c], rules.limit[c], lattice.break_columns, lattice.springs, 0, "/connectivity/bonds_", out);
  for (std::size_t kind = 0; kind < lattice.interactions.size(); ++kind) {
    const InteractionRows& from = lattice.interactions[kind];
    for (std::size_t c = 0; c < TURN_LIMITS && from.rows.total > 0; ++c)
      put_threshold(rules, turn_limits[c], rules.turn_limit[kind][c], from.break_columns, from.rows, static_cast<std::int64_t>(kind) + 1,
                    std::string("/connectivity/") + interaction_schemas()[kind].group + "s_", out);
  }
}

}  // namespace bs
