#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "input/dilution.hpp"
#include "input/remote.hpp"
#include "network/migrate.hpp"

namespace bs {

namespace {

/// A spring as the owner of one of its ends sees it. `way`: from the lower end to the upper one, of either end the same bits.
struct End {
  std::int64_t row, spring, other;
  double way[3];
  friend bool operator<(const End& a, const End& b) { return a.row != b.row ? a.row < b.row : a.spring < b.spring; }
};

/// A spring that is gone, for the owner of its end `row`.
struct Loss {
  std::int64_t row, spring;
};

/// Both ends of all springs at the ranks that hold the particles, by particle.
PetscErrorCode collect_ends(MPI_Comm comm, const Lattice& l, const Chunks& chunks, std::vector<End>* out) {
  const std::size_t d = static_cast<std::size_t>(l.dim), springs = l.stiffness.size();
  std::vector<double> places;
  PetscFunctionBegin;
  PetscCall(fetch_rows(comm, l.particles, l.position, l.dim, l.pairs, &places));
  const auto end = [&](std::size_t k) {
    const std::size_t s = k / 2;
    End one{l.pairs[k], l.springs.first + static_cast<std::int64_t>(s), l.pairs[k ^ 1], {0, 0, 0}};
    for (std::size_t c = 0; c < d; ++c) {
      one.way[c] = places[(2 * s + 1) * d + c] - places[2 * s * d + c];
      for (std::size_t e = 0; e < d && !l.shift.empty(); ++e) one.way[c] += static_cast<double>(l.shift[s * d + e]) * l.box.edges[e * d + c];
    }
    return one;
  };
  PetscCall(exchange(
      comm, 2 * springs, [&](std::size_t k) { return static_cast<std::size_t>(chunks.owner(l.pairs[k])); }, end, out));
  std::sort(out->begin(), out->end());
  PetscFunctionReturn(0);
}

/// Whether the `count` <= d vectors at `ways` are linearly independent: what is left of one across those before it is not next to nothing.
bool independent(const std::vector<const double*>& ways, int d) {
  std::vector<std::array<double, 3>> across;
  if (static_cast<int>(ways.size()) > d) return false;
  for (const double* way : ways) {
    std::array<double, 3> v{way[0], way[1], way[2]};
    const double whole = std::hypot(v[0], v[1], v[2]);
    for (const auto& u : across) {
      const double along = v[0] * u[0] + v[1] * u[1] + v[2] * u[2];
      for (std::size_t k = 0; k < 3; ++k) v[k] -= along * u[k];
    }
    const double rest = std::hypot(v[0], v[1], v[2]);
    if (!(rest > 1e-9 * whole)) return false;
    for (double& c : v) c /= rest;
    across.push_back(v);
  }
  return true;
}

/// The particles of this rank that go, one after the other, and what that tells other ranks.
class Pruning {
 public:
  Pruning(const Lattice& l, PruneRule rule, std::vector<End> ends, std::vector<std::uint8_t> held)
      : rule_(rule), dim_(l.dim), rows_(l.particles), ends_(std::move(ends)), there_(ends_.size(), 1), held_(std::move(held)), gone(held_.size(), 0) {
    for (std::int64_t p = 0; p < rows_.count; ++p) doubtful_.push_back(p);
  }

  /// Takes away what can be judged without other ranks; `losses`: ends on them that have lost their spring.
  void work(std::vector<Loss>* losses) {
    losses->clear();
    while (!doubtful_.empty()) {
      const std::int64_t p = doubtful_.back();
      doubtful_.pop_back();
      if (held_[static_cast<std::size_t>(p)] || gone[static_cast<std::size_t>(p)] || stays(p)) continue;
      gone[static_cast<std::size_t>(p)] = 1;
      for (std::size_t e = first_end(p); e < ends_.size() && ends_[e].row == rows_.first + p; ++e)
        if (there_[e]) {
          there_[e] = 0;
          losses->push_back({ends_[e].other, ends_[e].spring});
          if (here(ends_[e].other)) lose(losses->back()), losses->pop_back();
        }
    }
  }
  void lose(const Loss& loss) {
    const End wanted{loss.row, loss.spring, 0, {0, 0, 0}};
    for (auto e = std::lower_bound(ends_.begin(), ends_.end(), wanted); e != ends_.end() && e->row == loss.row && e->spring == loss.spring; ++e)
      there_[static_cast<std::size_t>(e - ends_.begin())] = 0;
    doubtful_.push_back(loss.row - rows_.first);
  }

 private:
  bool here(std::int64_t row) const { return row >= rows_.first && row - rows_.first < rows_.count; }
  std::size_t first_end(std::int64_t p) const {
    return static_cast<std::size_t>(std::lower_bound(ends_.begin(), ends_.end(), End{rows_.first + p, -1, 0, {0, 0, 0}}) - ends_.begin());
  }
  bool stays(std::int64_t p) const {
    std::vector<const double*> ways;
    for (std::size_t e = first_end(p); e < ends_.size() && ends_[e].row == rows_.first + p; ++e)
      if (there_[e]) ways.push_back(ends_[e].way);
    return rule_ == PruneRule::dangling ? ways.size() > 1 : !independent(ways, dim_);
  }

  PruneRule rule_;
  int dim_;
  Rows rows_;
  std::vector<End> ends_;
  std::vector<std::uint8_t> there_, held_;
  std::vector<std::int64_t> doubtful_;  ///< of this rank, counted from its first

 public:
  std::vector<std::uint8_t> gone;
};

/// gone[p]: whether particle p of this rank goes. What goes does not depend on the order: a particle that can go still can when others have gone.
PetscErrorCode find_gone(MPI_Comm comm, PruneRule rule, const Lattice& l, std::vector<std::uint8_t>* gone) {
  Chunks chunks;
  std::vector<End> ends;
  std::vector<Loss> losses, received;
  PetscFunctionBegin;
  PetscCall(gather_chunks(comm, l, &chunks));
  PetscCall(collect_ends(comm, l, chunks, &ends));
  std::vector<std::uint8_t> held = l.fixed;
  for (const Group& group : l.groups)
    for (std::size_t p = 0; p < held.size(); ++p) held[p] = held[p] || group.member[p];
  Pruning pruning(l, rule, std::move(ends), std::move(held));
  std::int64_t count = 1;
  while (count > 0) {
    pruning.work(&losses);
    PetscCall(exchange(
        comm, losses.size(), [&](std::size_t k) { return static_cast<std::size_t>(chunks.owner(losses[k].row)); },
        [&](std::size_t k) { return losses[k]; }, &received));
    for (const Loss& one : received) pruning.lose(one);
    count = static_cast<std::int64_t>(received.size());
    PetscCall(sum_over_ranks(comm, &count));
  }
  *gone = std::move(pruning.gone);
  PetscFunctionReturn(0);
}

/// The rows `from` of `old` rows of any kind of numbers in the place of them.
template <class T>
PetscErrorCode take_rows(MPI_Comm comm, const Rows& old, const std::vector<std::int64_t>& from, int width, std::vector<T>* values) {
  std::vector<double> taken;
  PetscFunctionBegin;
  PetscCall(fetch_rows(comm, old, std::vector<double>(values->begin(), values->end()), width, from, &taken));
  values->assign(taken.begin(), taken.end());
  PetscFunctionReturn(0);
}

/// The particles that stay, divided among the ranks anew. Their ids are the rows that they had.
PetscErrorCode take_particles(MPI_Comm comm, const std::vector<std::uint8_t>& gone, const Rows& now, Lattice* l) {
  const Rows old = l->particles;
  Chunks chunks;
  std::vector<std::int64_t> stay, from;
  PetscFunctionBegin;
  for (std::size_t p = 0; p < gone.size(); ++p)
    if (!gone[p]) stay.push_back(old.first + static_cast<std::int64_t>(p));
  const int size = size_of(comm);
  for (int r = 0; r < size; ++r) chunks.begin.push_back(split_rows(now.total, r, size).first);
  PetscCall(exchange(
      comm, stay.size(), [&](std::size_t k) { return static_cast<std::size_t>(chunks.owner(now.first + static_cast<std::int64_t>(k))); },
      [&](std::size_t k) { return stay[k]; }, &from));
  PetscCall(take_rows(comm, old, from, l->dim, &l->position));
  PetscCall(take_rows(comm, old, from, l->dim, &l->velocity));
  PetscCall(take_rows(comm, old, from, 1, &l->mass));
  PetscCall(take_rows(comm, old, from, 1, &l->fixed));
  for (Column& one : l->particle_columns) PetscCall(take_rows(comm, old, from, 1, &one.value));
  for (Group& one : l->groups) PetscCall(take_rows(comm, old, from, 1, &one.member));
  l->id = from;
  l->particles = split_rows(now.total, rank_of(comm), size);
  PetscFunctionReturn(0);
}

/// Rows of particles become those they have now; keep[k]: whether all `width` of row k stay.
PetscErrorCode renumber(MPI_Comm comm, const Rows& old, const std::vector<double>& row_now, std::size_t width, std::vector<std::int64_t>* rows,
                        std::vector<std::uint8_t>* keep) {
  std::vector<double> now;
  PetscFunctionBegin;
  PetscCall(fetch_rows(comm, old, row_now, 1, *rows, &now));
  keep->assign(rows->size() / width, 1);
  for (std::size_t k = 0; k < now.size(); ++k) {
    if (now[k] < 0) (*keep)[k / width] = 0;
    (*rows)[k] = static_cast<std::int64_t>(now[k]);
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode prune_particles(MPI_Comm comm, const GeneratorSpec& spec, Lattice* l) {
  std::vector<std::uint8_t> gone, keep;
  PetscFunctionBegin;
  if (spec.prune == PruneRule::none) PetscFunctionReturn(0);
  PetscCall(number_rows(comm, &l->springs));
  PetscCall(find_gone(comm, spec.prune, *l, &gone));
  const Rows old = l->particles;
  Rows now;
  now.count = std::count(gone.begin(), gone.end(), 0);
  PetscCall(number_rows(comm, &now));
  if (now.total == 0)
    PetscCall(fail(comm, Exit::input,
                   std::string("-bs_lattice_prune ") + prune_rule_names()[static_cast<std::size_t>(spec.prune)] +
                       ": no particle is left: remove fewer springs, or write -bs_lattice_prune none"));
  std::vector<double> row_now(gone.size());
  std::int64_t next = now.first;
  for (std::size_t p = 0; p < gone.size(); ++p) row_now[p] = gone[p] ? -1.0 : static_cast<double>(next++);
  PetscCall(renumber(comm, old, row_now, 2, &l->pairs, &keep));
  keep_springs(keep, l);
  if (!l->interactions.empty()) {
    PetscCall(renumber(comm, old, row_now, 3, &l->interactions[0].ends, &keep));
    keep_angles(keep, l);
  }
  PetscCall(take_particles(comm, gone, now, l));
  l->source += format(", %" PRId64 " of %" PRId64 " particles pruned", old.total - now.total, old.total);
  PetscFunctionReturn(0);
}

}  // namespace bs
