#include "systems/particles/breaking/spring_breaks.hpp"
#include <algorithm>
#include <cmath>
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

}  // namespace bs
