#include "systems/particles/breaking/spring_breaks.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/particles/breaking/breaking.hpp"
#include "systems/particles/physics.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

const BreakWords& SpringBreaks::words() const {
  static const BreakWords words{"spring", "spring", "broken", "broken_springs", "break_", "strain"};
  return words;
}

double SpringBreaks::limit(std::size_t k, int which) const {
  const double own = column_[which].empty() ? rules_.limit[which] : column_[which][k];
  return factor_.empty() ? own : own * factor_[k];
}

// s/s_c, |T|/T_c and sqrt(e/e_c), the largest: 1 at the limit, 0 on the side that is not asked for
double SpringBreaks::excess_of(std::size_t k, const LinkMeasures& m) const {
  const double rest = net_->links.rest_length[judged_[k].link];
  const auto sided = [&](double value) {
    return rules_.side == BreakRules::tension       ? std::max(value, 0.0)
           : rules_.side == BreakRules::compression ? std::max(-value, 0.0)
                                                    : std::abs(value);
  };
  double excess = 0;
  if (rest > 0) excess = sided(m.length - rest) / rest / limit(k, BREAK_STRAIN);
  excess = std::max(excess, sided(m.tension) / limit(k, BREAK_FORCE));
  if (sided(m.tension) > 0) excess = std::max(excess, std::sqrt(std::max(m.energy, 0.0) / limit(k, BREAK_ENERGY)));
  return excess;
}

void SpringBreaks::judge(const LocalState& state, std::vector<PastLimit>* found) const {
  const Links& links = net_->links;
  for (std::size_t k = 0; k < judged_.size(); ++k) {
    const auto [i, e] = judged_[k];
    if (links.broken[static_cast<std::size_t>(e)] || !exists(*net_, e)) continue;
    const LinkMeasures m = pairs_->measure(state, i, e);
    const double excess = excess_of(k, m), rest = links.rest_length[e];
    if (!(excess >= 1 - BREAK_TIE)) continue;
    Broken one;
    one.row = links.spring[e];
    const std::int64_t a = end_row_[static_cast<std::size_t>(i)], b = end_row_[static_cast<std::size_t>(links.other[e])];
    one.ends[0] = std::min(a, b);
    one.ends[1] = std::max(a, b);
    one.strain = rest > 0 ? (m.length - rest) / rest : NAN;
    one.energy = m.energy;
    found->push_back({excess, m.dissipated, one});
  }
}

/// Its numbers become 0, not its history: what a law has lost so far is counted apart from here on.
void SpringBreaks::cut_link(PetscInt e) {
  Links& links = net_->links;
  const std::size_t at = static_cast<std::size_t>(e);
  if (links.broken[at]) return;
  const std::size_t count = links.law.empty() ? 0 : spring_laws()[links.law[at]].parameters.size();
  double* const parameter = links.more.data() + at * static_cast<std::size_t>(links.width);
  cuts_.push_back({e, links.stiffness[at], links.damping.empty() ? 0.0 : links.damping[at], {parameter, parameter + count}});
  links.broken[at] = 1;
  links.stiffness[at] = 0;
  if (!links.damping.empty()) links.damping[at] = 0;
  std::fill_n(parameter, count, 0.0);
}

void SpringBreaks::cut(std::int64_t row) {
  for (auto k = std::lower_bound(links_by_row_.begin(), links_by_row_.end(), std::pair<std::int64_t, PetscInt>{row, 0});
       k != links_by_row_.end() && k->first == row; ++k)
    cut_link(k->second);
}

void SpringBreaks::mark() {
  marked_ = cuts_.size();
  marked_more_ = net_->links.more;
}

void SpringBreaks::revert() {
  mend_from(marked_);
  net_->links.more = marked_more_;
}

/// Of links that were cut from that one on.
void SpringBreaks::mend_from(std::size_t cut) {
  Links& links = net_->links;
  for (std::size_t k = cut; k < cuts_.size(); ++k) {
    const Cut& was = cuts_[k];
    const std::size_t at = static_cast<std::size_t>(was.link);
    links.broken[at] = 0;
    links.stiffness[at] = was.stiffness;
    if (!links.damping.empty()) links.damping[at] = was.damping;
    std::copy(was.parameters.begin(), was.parameters.end(), links.more.data() + at * static_cast<std::size_t>(links.width));
  }
  cuts_.resize(cut);
}

PetscErrorCode SpringBreaks::flags(Vec* out) {
  PetscFunctionBegin;
  PetscCall(table_.gather([&](PetscInt, PetscInt e) { return net_->links.is_broken(e) ? 1.0 : 0.0; }, &flags_));
  *out = flags_;
  PetscFunctionReturn(0);
}

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
  end_row_ = net.local_rows();
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
