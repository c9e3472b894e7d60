#include "systems/particles/breaking/breaking.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

namespace {
constexpr double TIE = 1e-9;  ///< excesses that differ by less are equal, so that rounding does not decide which spring breaks
}

double Breaking::limit(std::size_t k, int which) const {
  const double own = column_[which].empty() ? rules_.limit[which] : column_[which][k];
  return factor_.empty() ? own : own * factor_[k];
}

// s/s_c, |T|/T_c and sqrt(e/e_c), the largest: 1 at the limit, 0 on the side that is not asked for
double Breaking::excess_of(std::size_t k, const LinkMeasures& m) const {
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

void Breaking::judge(double t, double load, const LocalState& state, const Terms& terms, std::vector<Found>* found) const {
  const Links& links = net_->links;
  for (std::size_t k = 0; k < judged_.size(); ++k) {
    const auto [i, e] = judged_[k];
    if (links.broken[static_cast<std::size_t>(e)]) continue;
    const LinkMeasures m = terms.pairs().measure(state, i, e);
    const double excess = excess_of(k, m), rest = links.rest_length[e];
    if (!(excess >= 1 - TIE)) continue;
    BrokenSpring one;
    one.row = links.spring[e];
    const std::int64_t a = end_row_[static_cast<std::size_t>(i)], b = end_row_[static_cast<std::size_t>(links.other[e])];
    one.ends[0] = std::min(a, b);
    one.ends[1] = std::max(a, b);
    one.time = t + sums_.motion;
    one.load = load;
    one.strain = rest > 0 ? (m.length - rest) / rest : NAN;
    one.energy = m.energy;
    found->push_back({excess, m.dissipated, one});
  }
}

/// Of all ranks' springs the one of the largest excess, the first in the input among equals.
PetscErrorCode Breaking::keep_worst(std::vector<Found>* found) const {
  double most = 0;
  std::int64_t row = std::numeric_limits<std::int64_t>::max();
  PetscFunctionBegin;
  for (const Found& one : *found) most = std::max(most, one.excess);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, net_->comm));
  for (const Found& one : *found)
    if (one.excess >= most * (1 - TIE)) row = std::min(row, one.spring.row);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &row, 1, MPI_INT64_T, MPI_MIN, net_->comm));
  found->erase(std::remove_if(found->begin(), found->end(), [row](const Found& one) { return one.spring.row != row; }), found->end());
  PetscFunctionReturn(0);
}

/// Every rank gets the springs of all, by row and each once.
PetscErrorCode Breaking::share(std::vector<Found>* found) const {
  PetscFunctionBegin;
  PetscCall(gather_all(net_->comm, *found, found));
  // a spring between a particle and its own image is judged at both its links
  std::sort(found->begin(), found->end(), [](const Found& a, const Found& b) { return a.spring.row < b.spring.row; });
  found->erase(std::unique(found->begin(), found->end(), [](const Found& a, const Found& b) { return a.spring.row == b.spring.row; }), found->end());
  PetscFunctionReturn(0);
}

PetscErrorCode Breaking::break_springs(double t, double load, bool loads, const LocalState& state, const Terms& terms) {
  std::vector<Found> found;
  int some;
  PetscFunctionBegin;
  broke_ = 0;
  if (!active_) PetscFunctionReturn(0);
  judge(t, load, state, terms, &found);
  some = !found.empty();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &some, 1, MPI_INT, MPI_MAX, net_->comm));
  const bool goes_on = loads ? sums_.last == t : sums_.running != 0;
  sums_.running = some;
  if (!some) PetscFunctionReturn(0);
  if (rules_.worst) PetscCall(keep_worst(&found));
  PetscCall(share(&found));
  if (!goes_on) ++sums_.avalanches, sums_.size = 0;
  for (Found& one : found) {
    cut_row(one.spring.row);
    one.spring.number = sums_.broken++;
    one.spring.avalanche = sums_.avalanches - 1;
    sums_.energy += one.spring.energy;
    sums_.dissipated += one.dissipated;
    list_.push_back(one.spring);
  }
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(net_->comm, &rank));
  if (rank != 0) list_.clear();
  sums_.last = t;
  broke_ = static_cast<std::int64_t>(found.size());
  sums_.size += broke_;
  sums_.largest = std::max(sums_.largest, sums_.size);
  PetscFunctionReturn(0);
}

/// Its numbers become 0, not its history: what a law has lost so far is counted apart from here on.
void Breaking::cut(PetscInt e) {
  Links& links = net_->links;
  const std::size_t at = static_cast<std::size_t>(e);
  if (links.broken[at]) return;
  cuts_.push_back({e, links.stiffness[at], links.damping.empty() ? 0.0 : links.damping[at]});
  links.broken[at] = 1;
  links.stiffness[at] = 0;
  if (!links.damping.empty()) links.damping[at] = 0;
  if (!links.law.empty()) {
    const std::size_t count = spring_laws()[links.law[at]].parameters.size();
    std::fill_n(links.more.data() + at * static_cast<std::size_t>(links.width), count, 0.0);
  }
}

void Breaking::cut_row(std::int64_t row) {
  for (auto k = std::lower_bound(links_by_row_.begin(), links_by_row_.end(), std::pair<std::int64_t, PetscInt>{row, 0});
       k != links_by_row_.end() && k->first == row; ++k)
    cut(k->second);
}

void Breaking::mark() {
  cuts_.clear();
  marked_list_ = list_.size();
  marked_more_ = net_->links.more;
}

void Breaking::revert() {
  Links& links = net_->links;
  for (const Cut& was : cuts_) {
    const std::size_t at = static_cast<std::size_t>(was.link);
    links.broken[at] = 0;
    links.stiffness[at] = was.stiffness;
    if (!links.damping.empty()) links.damping[at] = was.damping;
  }
  cuts_.clear();
  links.more = marked_more_;
  list_.resize(marked_list_);
}

}  // namespace bs
