#include <algorithm>
#include <tuple>
#include "lattice/spring_laws.hpp"
#include "network/migrate.hpp"

namespace bs {

// By way of the chunks that hold the ends, since only those know the new owners.
PetscErrorCode collect_interactions(MPI_Comm comm, const Lattice& lattice, const Chunks& chunks, const std::vector<int>& rank_of,
                                    std::vector<std::vector<InteractionRecord>>* kinds) {
  const std::vector<InteractionSchema>& schemas = interaction_schemas();
  PetscFunctionBegin;
  kinds->clear();
  const std::size_t d = static_cast<std::size_t>(lattice.dim);
  std::int64_t any = 0;
  for (const InteractionRows& rows : lattice.interactions) any += rows.rows.total;
  if (any == 0) PetscFunctionReturn(0);
  kinds->resize(schemas.size());
  for (std::size_t kind = 0; kind < lattice.interactions.size(); ++kind) {
    const InteractionRows& from = lattice.interactions[kind];
    const std::size_t ends = static_cast<std::size_t>(schemas[kind].ends), numbers = schemas[kind].parameters.size();
    const auto make = [&](std::size_t item) {
      const std::size_t k = item / ends;
      InteractionRecord record{from.rows.first + static_cast<std::int64_t>(k), {}, {}, static_cast<int>(item % ends)};
      for (std::size_t a = 0; a < ends; ++a) {
        std::int64_t apart[3] = {0, 0, 0};
        for (std::size_t c = 0; c < d && !from.shift.empty(); ++c) apart[c] = from.shift[(k * ends + a) * d + c] - from.shift[item * d + c];
        record.end[a] = image::key(from.ends[k * ends + a], apart, lattice.dim, 1);
      }
      std::copy_n(from.parameter.begin() + static_cast<std::ptrdiff_t>(k * numbers), numbers, record.parameter);
      return record;
    };
    std::vector<InteractionRecord> near, &mine = (*kinds)[kind];
    PetscCall(exchange(
        comm, static_cast<std::size_t>(from.rows.count) * ends, [&](std::size_t item) { return chunks.owner(from.ends[item]); }, make, &near));
    PetscCall(exchange(
        comm, near.size(),
        [&](std::size_t k) { return rank_of[static_cast<std::size_t>(image::row(near[k].end[near[k].owned]) - lattice.particles.first)]; },
        [&](std::size_t k) { return near[k]; }, &mine));
    std::sort(mine.begin(), mine.end(), [](const auto& a, const auto& b) { return std::tie(a.row, a.owned) < std::tie(b.row, b.owned); });
  }
  PetscFunctionReturn(0);
}

void add_couplings(const std::vector<std::vector<InteractionRecord>>& kinds, std::vector<HalfSpring>* springs) {
  constexpr std::int64_t WANTED = -2;  // sorts before springs and other couplings of the same pair
  const std::size_t before_these = springs->size();
  for (std::size_t kind = 0; kind < kinds.size(); ++kind)
    for (const InteractionRecord& record : kinds[kind])
      for (int e = 0; e < interaction_schemas()[kind].ends; ++e)
        if (e != record.owned) springs->push_back({image::row(record.end[record.owned]), record.end[e], WANTED, 0, 0, 0});
  if (springs->size() == before_these) return;
  std::sort(springs->begin(), springs->end(), before);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < springs->size(); ++k) {
    HalfSpring s = (*springs)[k];
    const HalfSpring* next = k + 1 < springs->size() ? &(*springs)[k + 1] : nullptr;
    if (s.spring == WANTED && next && next->self == s.self && next->other == s.other) continue;
    if (s.spring == WANTED) s.spring = -1;
    (*springs)[kept++] = s;
  }
  springs->resize(kept);
}

void lay_out_interactions(const Lattice& lattice, const std::vector<std::vector<InteractionRecord>>& kinds, const std::vector<std::int64_t>& ghosts,
                          Network* net) {
  std::vector<std::pair<std::int64_t, PetscInt>> owned;
  if (!kinds.empty())
    for (PetscInt i = 0; i < net->n; ++i) owned.emplace_back(net->row[i], i);
  std::sort(owned.begin(), owned.end());
  const auto local = [&](std::int64_t key) {
    const auto at = std::lower_bound(owned.begin(), owned.end(), std::make_pair(image::row(key), PetscInt(0)));
    if (!image::shifted(key) && at != owned.end() && at->first == image::row(key)) return at->second;
    return net->n + static_cast<PetscInt>(std::lower_bound(ghosts.begin(), ghosts.end(), key) - ghosts.begin());
  };
  net->interactions.assign(kinds.size(), {});
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
    InteractionTable& table = net->interactions[kind];
    table.total = kind < lattice.interactions.size() ? lattice.interactions[kind].rows.total : 0;
    const std::size_t ends = static_cast<std::size_t>(interaction_schemas()[kind].ends);
    for (const InteractionRecord& record : kinds[kind]) {
      std::vector<PetscInt> end;
      for (std::size_t e = 0; e < ends; ++e) end.push_back(local(record.end[e]));
      bool known = false;
      for (std::size_t k = table.row.size(); k > 0 && table.row[k - 1] == record.row && !known; --k)
        known = std::equal(end.begin(), end.end(), table.end.begin() + static_cast<std::ptrdiff_t>((k - 1) * ends));
      if (known) continue;
      table.row.push_back(record.row);
      table.end.insert(table.end.end(), end.begin(), end.end());
      table.parameter.insert(table.parameter.end(), record.parameter, record.parameter + interaction_schemas()[kind].parameters.size());
    }
  }
}

}  // namespace bs
