#include "systems/particles/breaking/breaking.hpp"
#include <algorithm>
#include <cmath>
#include "base/fault.hpp"
#include "physics/pair/springs/registry.hpp"

namespace bs {

namespace {
constexpr double TIE = 1e-9;  ///< excesses that differ by less are equal, so that rounding does not decide which spring breaks
}

PetscErrorCode Breaking::read(MPI_Comm comm, const Lattice& lattice) {
  PetscFunctionBegin;
  PetscCall(rules_.read(comm, lattice));
  PetscCall(check_break_limits(comm, lattice));
  active_ = rules_.active(lattice);
  PetscFunctionReturn(0);
}

PetscErrorCode Breaking::create(Network& net, const Lattice& lattice) {
  PetscFunctionBegin;
  net_ = &net;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(table_.create(net, lattice.springs));
  net.links.broken.assign(net.links.spring.size(), 0);
  for (std::size_t e = 0; e < net.links.spring.size(); ++e)
    if (net.links.spring[e] >= 0) links_by_row_.emplace_back(net.links.spring[e], static_cast<PetscInt>(e));
  std::sort(links_by_row_.begin(), links_by_row_.end());
  PetscCall(name_ends());
  PetscCall(give_limits(lattice));
  if (rules_.notched) PetscCall(cut_notch());
  mark();
  PetscFunctionReturn(0);
}

/// end_row_: of owned particles and, by one exchange, of ghosts.
PetscErrorCode Breaking::name_ends() {
  VecHandle owned, ghosts;
  ISHandle from;
  ScatterHandle scatter;
  PetscScalar* a = nullptr;
  const PetscScalar* b = nullptr;
  PetscFunctionBegin;
  PetscCall(VecCreateMPI(net_->comm, net_->n, PETSC_DETERMINE, owned.out()));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, net_->ghosts, ghosts.out()));
  PetscCall(ISCreateGeneral(net_->comm, net_->ghosts, net_->global.data() + net_->n, PETSC_COPY_VALUES, from.out()));
  PetscCall(VecScatterCreate(owned, from, ghosts, nullptr, scatter.out()));
  PetscCall(VecGetArrayWrite(owned, &a));
  for (PetscInt i = 0; i < net_->n; ++i) a[i] = static_cast<double>(net_->row[i]);
  PetscCall(VecRestoreArrayWrite(owned, &a));
  PetscCall(VecScatterBegin(scatter, owned, ghosts, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, owned, ghosts, INSERT_VALUES, SCATTER_FORWARD));
  end_row_.assign(net_->row.begin(), net_->row.end());
  PetscCall(VecGetArrayRead(ghosts, &b));
  for (PetscInt g = 0; g < net_->ghosts; ++g) end_row_.push_back(static_cast<std::int64_t>(b[g]));
  PetscCall(VecRestoreArrayRead(ghosts, &b));
  PetscFunctionReturn(0);
}

/// What this rank judges, with the limits of each spring; springs that were broken before are cut.
PetscErrorCode Breaking::give_limits(const Lattice& lattice) {
  const Links& links = net_->links;
  std::vector<std::uint8_t> spared(static_cast<std::size_t>(net_->n + net_->ghosts), 0);
  Fault fault;
  PetscFunctionBegin;
  for (const NetworkGroup& group : net_->groups)
    if (std::find(rules_.spared.begin(), rules_.spared.end(), group.name) != rules_.spared.end())
      for (const PetscInt i : group.member) spared[static_cast<std::size_t>(i)] = 1;
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e)
      if (links.spring[e] >= 0 && net_->global[i] <= net_->global[links.other[e]] && !spared[i] && !spared[links.other[e]]) judged_.push_back({i, e});
  if (rules_.scatter != BreakRules::none)
    for (const Judged& one : judged_) factor_.push_back(rules_.factor(links.spring[one.link]));
  std::vector<double> by_link(links.spring.size(), 0.0);
  for (const Column& column : lattice.break_columns) {
    VecHandle rows;
    PetscCall(VecCreateMPIWithArray(net_->comm, 1, static_cast<PetscInt>(column.value.size()), PETSC_DETERMINE, column.value.data(), rows.out()));
    PetscCall(table_.spread(rows, [&](PetscInt e, double value) { by_link[static_cast<std::size_t>(e)] = value; }));
    if (column.name == BROKEN) {
      for (std::size_t e = 0; e < by_link.size(); ++e)
        if (by_link[e] != 0) cut(static_cast<PetscInt>(e));
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
  PetscCall(agree(net_->comm, fault));
  PetscFunctionReturn(0);
}

// The ends of either line lie on both sides of the other. Ends are taken by their global numbers, so that both ranks of a cut spring agree.
PetscErrorCode Breaking::cut_notch() {
  const Links& links = net_->links;
  const double *a = rules_.notch, *b = rules_.notch + 2;
  const auto side = [](const double* p, const double* q, const double* r) { return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]); };
  std::int64_t count = 0;
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      const PetscInt j = links.other[e];
      if (links.spring[e] < 0) continue;
      const bool first = net_->global[i] < net_->global[j];
      const double *p = net_->held.data() + 2 * static_cast<std::size_t>(first ? i : j),
                   *q = net_->held.data() + 2 * static_cast<std::size_t>(first ? j : i);
      if ((side(a, b, p) < 0) == (side(a, b, q) < 0) || (side(p, q, a) < 0) == (side(p, q, b) < 0)) continue;
      cut(e);
      ++count;
    }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT64_T, MPI_SUM, net_->comm));
  if (count == 0) PetscCall(tell(net_->comm, Exit::input, "option -bs_break_notch: no spring crosses that line: give a line through the lattice"));
  given_broken_ = true;
  PetscFunctionReturn(0);
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

void Breaking::judge(double t, double load, const LocalState& state, const Physics& physics, std::vector<Found>* found) const {
  const Links& links = net_->links;
  for (std::size_t k = 0; k < judged_.size(); ++k) {
    const auto [i, e] = judged_[k];
    if (links.broken[static_cast<std::size_t>(e)]) continue;
    const LinkMeasures m = physics.measure(state, i, e);
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
    found->push_back({excess, one});
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
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(net_->comm, &size));
  if (size > 1) {
    constexpr int UNIT = static_cast<int>(sizeof(Found));
    std::vector<PetscMPIInt> counts(static_cast<std::size_t>(size)), starts(counts.size() + 1, 0);
    const PetscMPIInt mine = static_cast<PetscMPIInt>(found->size());
    MPI_Datatype type;
    PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, net_->comm));
    for (std::size_t r = 0; r < counts.size(); ++r) starts[r + 1] = starts[r] + counts[r];
    std::vector<Found> all(static_cast<std::size_t>(starts.back()));
    PetscCallMPI(MPI_Type_contiguous(UNIT, MPI_BYTE, &type));
    PetscCallMPI(MPI_Type_commit(&type));
    PetscCallMPI(MPI_Allgatherv(found->data(), mine, type, all.data(), counts.data(), starts.data(), type, net_->comm));
    PetscCallMPI(MPI_Type_free(&type));
    *found = std::move(all);
  }
  // a spring between a particle and its own image is judged at both its links
  std::sort(found->begin(), found->end(), [](const Found& a, const Found& b) { return a.spring.row < b.spring.row; });
  found->erase(std::unique(found->begin(), found->end(), [](const Found& a, const Found& b) { return a.spring.row == b.spring.row; }), found->end());
  PetscFunctionReturn(0);
}

PetscErrorCode Breaking::look(double t, double load, bool loads, const LocalState& state, const Physics& physics) {
  std::vector<Found> found;
  int some;
  PetscFunctionBegin;
  broke_ = 0;
  if (!active_) PetscFunctionReturn(0);
  judge(t, load, state, physics, &found);
  some = !found.empty();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &some, 1, MPI_INT, MPI_MAX, net_->comm));
  const bool goes_on = loads ? sums_.last == t : sums_.running != 0;
  sums_.running = some;
  if (!some) PetscFunctionReturn(0);
  if (rules_.worst) PetscCall(keep_worst(&found));
  PetscCall(share(&found));
  if (!goes_on) ++sums_.avalanches, sums_.size = 0;
  double lost = 0;
  for (Found& one : found) {
    const auto at = std::lower_bound(links_by_row_.begin(), links_by_row_.end(), std::pair<std::int64_t, PetscInt>{one.spring.row, 0});
    // the plastic work of a spring at the rank that judges it: at its own image once
    for (auto k = at; k != links_by_row_.end() && k->first == one.spring.row; ++k) {
      const auto i = std::upper_bound(net_->links.start.begin(), net_->links.start.end(), k->second) - net_->links.start.begin() - 1;
      lost += 0.5 * physics.measure(state, static_cast<PetscInt>(i), k->second).dissipated;
    }
    cut_row(one.spring.row);
    one.spring.number = sums_.broken++;
    one.spring.avalanche = sums_.avalanches - 1;
    sums_.energy += one.spring.energy;
    list_.push_back(one.spring);
  }
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(net_->comm, &rank));
  if (rank != 0) list_.clear();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lost, 1, MPI_DOUBLE, MPI_SUM, net_->comm));
  sums_.dissipated += lost;
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
  Cut was{e, links.stiffness[at], links.damping.empty() ? 0.0 : links.damping[at], {}};
  links.broken[at] = 1;
  links.stiffness[at] = 0;
  if (!links.damping.empty()) links.damping[at] = 0;
  if (!links.law.empty()) {
    const std::size_t count = spring_laws()[links.law[at]].parameters.size();
    double* more = links.more.data() + at * static_cast<std::size_t>(links.width);
    was.more.assign(more, more + count);
    std::fill_n(more, count, 0.0);
  }
  cuts_.push_back(std::move(was));
}

void Breaking::cut_row(std::int64_t row) {
  for (auto k = std::lower_bound(links_by_row_.begin(), links_by_row_.end(), std::pair<std::int64_t, PetscInt>{row, 0});
       k != links_by_row_.end() && k->first == row; ++k)
    cut(k->second);
}

void Breaking::mark() {
  cuts_.clear();
  marked_ = sums_;
  marked_list_ = list_.size();
}

void Breaking::revert() {
  Links& links = net_->links;
  for (const Cut& was : cuts_) {
    const std::size_t at = static_cast<std::size_t>(was.link);
    links.broken[at] = 0;
    links.stiffness[at] = was.stiffness;
    if (!links.damping.empty()) links.damping[at] = was.damping;
    if (!was.more.empty()) std::copy(was.more.begin(), was.more.end(), links.more.begin() + static_cast<std::ptrdiff_t>(at) * links.width);
  }
  list_.resize(marked_list_);
  sums_ = marked_;
  mark();
}

}  // namespace bs
