#include "systems/particles/breaking/interaction_breaks.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "input/remote.hpp"
#include "systems/particles/breaking/breaking.hpp"

namespace bs {

PetscErrorCode InteractionBreaks::create(Network& net, const Lattice& lattice, const BreakRules& rules, std::size_t kind, Measure measure,
                                         std::unique_ptr<InteractionBreaks>* out) {
  const InteractionSchema& schema = interaction_schemas()[kind];
  PetscFunctionBegin;
  out->reset();
  if (!rules.active(lattice, kind)) PetscFunctionReturn(0);
  auto one = std::make_unique<InteractionBreaks>();
  const std::string group = schema.group;
  one->net_ = &net;
  one->table_ = &net.interactions[kind];
  one->measure_ = std::move(measure);
  one->words_ = {schema.title, group, "broken_" + group + "s", "broken_" + group + "s", "break_" + group + "_", "change", schema.ends};
  one->rows_ = lattice.interactions[kind].rows;
  one->table_->broken.assign(one->table_->row.size(), 0);
  one->end_row_ = net.local_rows();
  PetscCall(one->give_limits(lattice, rules, kind));
  if (rules.with_springs) one->find_sides(schema);
  PetscCall(one->cut_given(lattice, rules, kind));
  *out = std::move(one);
  PetscFunctionReturn(0);
}

/// What this rank judges, with the limits of each.
PetscErrorCode InteractionBreaks::give_limits(const Lattice& lattice, const BreakRules& rules, std::size_t kind) {
  const std::vector<std::uint8_t> spared = rules.spared_particles(*net_);
  std::vector<std::int64_t> row;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < table_->row.size(); ++k) {
    spared_.push_back(std::any_of(ends(k), ends(k) + words_.ends, [&](PetscInt i) { return spared[static_cast<std::size_t>(i)] != 0; }));
    if (ends(k)[0] >= net_->n || spared_.back()) continue;
    judged_.push_back(k);
    row.push_back(table_->row[k]);
  }
  for (int c = 0; c < TURN_LIMITS; ++c) {
    limit_[c].assign(row.size(), rules.turn_limit[kind][static_cast<std::size_t>(c)]);
    if (const Column* own = find_column(lattice.interactions[kind].break_columns, turn_limits[c].name))
      PetscCall(fetch_rows(net_->comm, rows_, own->value, 1, row, &limit_[c]));
    for (std::size_t k = 0; k < row.size(); ++k) limit_[c][k] *= rules.factor(row[k], static_cast<std::int64_t>(kind) + 1);
  }
  PetscFunctionReturn(0);
}

/// Those that the lattice calls broken, and those along springs that are broken already.
PetscErrorCode InteractionBreaks::cut_given(const Lattice& lattice, const BreakRules& rules, std::size_t kind) {
  const Links& links = net_->links;
  PetscFunctionBegin;
  if (const Column* broken = find_column(lattice.interactions[kind].break_columns, BROKEN)) {
    std::vector<double> flag;
    PetscCall(fetch_rows(net_->comm, rows_, broken->value, 1, table_->row, &flag));
    for (std::size_t k = 0; k < flag.size(); ++k) table_->broken[k] = flag[k] != 0;
    given_broken_ = true;
  }
  if (!rules.with_springs) PetscFunctionReturn(0);
  std::vector<std::int64_t> springs, rows;
  for (std::size_t e = 0; e < links.broken.size(); ++e)
    if (links.broken[e]) springs.push_back(links.spring[e]);
  std::sort(springs.begin(), springs.end());
  PetscCall(rows_along(springs, &rows));
  for (std::size_t k = 0; k < table_->row.size(); ++k)
    if (!spared_[k] && std::binary_search(rows.begin(), rows.end(), table_->row[k])) table_->broken[k] = 1;
  given_broken_ = given_broken_ || !rows.empty();
  PetscFunctionReturn(0);
}

/// By the ends that this rank owns, which see the others where they are, in the box of a spring's other end.
void InteractionBreaks::find_sides(const InteractionSchema& schema) {
  const Links& links = net_->links;
  for (std::size_t k = 0; k < table_->row.size(); ++k)
    for (const auto& side : schema.sides)
      for (const auto& [a, b] : {side, std::make_pair(side.second, side.first)}) {
        const PetscInt i = ends(k)[a], j = ends(k)[b];
        for (PetscInt e = i < net_->n ? links.start[i] : 0; i < net_->n && e < links.start[i + 1]; ++e)
          if (links.other[e] == j && links.spring[e] >= 0) side_.emplace_back(links.spring[e], k);
      }
  std::sort(side_.begin(), side_.end());
}

/// Collective. Rows of all that have one of these springs along a side, ascending and the same on every rank.
PetscErrorCode InteractionBreaks::rows_along(const std::vector<std::int64_t>& springs, std::vector<std::int64_t>* rows) const {
  std::vector<std::int64_t> own;
  PetscFunctionBegin;
  for (const auto& [spring, k] : side_)
    if (std::binary_search(springs.begin(), springs.end(), spring)) own.push_back(table_->row[k]);
  PetscCall(gather_all(net_->comm, own, rows));
  std::sort(rows->begin(), rows->end());
  rows->erase(std::unique(rows->begin(), rows->end()), rows->end());
  PetscFunctionReturn(0);
}

PastLimit InteractionBreaks::past(std::size_t k, double excess, const TurnMeasures& m) const {
  Broken one;
  one.row = table_->row[k];
  for (int a = 0; a < words_.ends; ++a) one.ends[a] = end_row_[static_cast<std::size_t>(ends(k)[a])];
  one.strain = m.change;
  one.energy = m.energy;
  return {excess, 0, one};
}

// |theta - theta_0|/c, |M|/M_c and sqrt(E/E_c), the largest: 1 at the limit
void InteractionBreaks::judge(const LocalState& state, std::vector<PastLimit>* found) const {
  for (std::size_t at = 0; at < judged_.size(); ++at) {
    const std::size_t k = judged_[at];
    if (table_->is_broken(k)) continue;
    const TurnMeasures m = measure_(state, k);
    const double excess = std::max({std::abs(m.change) / limit_[TURN_CHANGE][at], std::abs(m.moment) / limit_[TURN_MOMENT][at],
                                    std::sqrt(std::max(m.energy, 0.0) / limit_[TURN_ENERGY][at])});
    if (excess >= 1 - BREAK_TIE) found->push_back(past(k, excess, m));
  }
}

PetscErrorCode InteractionBreaks::follow(const std::vector<std::int64_t>& springs, const LocalState& state, std::vector<PastLimit>* found) const {
  std::vector<std::int64_t> rows;
  PetscFunctionBegin;
  PetscCall(rows_along(springs, &rows));
  for (const std::size_t k : judged_)
    if (!table_->is_broken(k) && std::binary_search(rows.begin(), rows.end(), table_->row[k])) found->push_back(past(k, 0, measure_(state, k)));
  PetscFunctionReturn(0);
}

void InteractionBreaks::cut(std::int64_t row) {
  const std::vector<std::int64_t>& rows = table_->row;
  for (auto at = std::lower_bound(rows.begin(), rows.end(), row); at != rows.end() && *at == row; ++at) {
    const std::size_t k = static_cast<std::size_t>(at - rows.begin());
    if (!table_->broken[k]) cuts_.push_back(k);
    table_->broken[k] = 1;
  }
}

/// Of places that were cut from that one on.
void InteractionBreaks::mend_from(std::size_t cut) {
  for (std::size_t k = cut; k < cuts_.size(); ++k) table_->broken[cuts_[k]] = 0;
  cuts_.resize(cut);
}

PetscErrorCode InteractionBreaks::flags(Vec* out) {
  PetscFunctionBegin;
  if (!flags_) PetscCall(create_vec(net_->comm, static_cast<PetscInt>(rows_.count), 1, flags_.out()));
  PetscCall(VecZeroEntries(flags_));
  for (std::size_t k = 0; k < table_->row.size(); ++k)
    if (ends(k)[0] < net_->n && table_->is_broken(k)) PetscCall(VecSetValue(flags_, static_cast<PetscInt>(table_->row[k]), 1.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(flags_));
  PetscCall(VecAssemblyEnd(flags_));
  *out = flags_;
  PetscFunctionReturn(0);
}

}  // namespace bs
