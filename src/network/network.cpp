#include "network/network.hpp"
#include <petscmat.h>
#include <petscsf.h>
#include <algorithm>
#include <numeric>
#include "base/arrays.hpp"
#include "base/collective.hpp"
#include "base/options.hpp"
#include "network/migrate.hpp"
#include "network/partition.hpp"

namespace bs {

namespace {

/// Reverse Cuthill-McKee order of the springs among owned particles, whose rows `rows` has: position -> index among these.
PetscErrorCode order_locally(const RowIndex& rows, const std::vector<HalfSpring>& springs, const std::vector<PetscInt>& start, int ordering,
                             std::vector<PetscInt>* order) {
  const PetscInt n = static_cast<PetscInt>(start.size()) - 1;
  PetscFunctionBegin;
  order->resize(static_cast<std::size_t>(n));
  std::iota(order->begin(), order->end(), 0);
  if (ordering != 0 || n < 3) PetscFunctionReturn(0);
  std::vector<PetscInt> ia(static_cast<std::size_t>(n) + 1, 0), ja;
  ja.reserve(springs.size() + static_cast<std::size_t>(n));
  for (PetscInt i = 0; i < n; ++i) {
    PetscInt last = -1;
    ja.push_back(i);
    const std::size_t begin = ja.size() - 1;
    for (PetscInt e = start[i]; e < start[i + 1]; ++e) {
      const PetscInt j = springs[e].spring < 0 ? -1 : rows.find(image::row(springs[e].other));
      if (j < 0) continue;
      if (j != last && j != i) ja.push_back(j);
      last = j;
    }
    std::sort(ja.begin() + begin, ja.end());
    ia[i + 1] = static_cast<PetscInt>(ja.size());
  }
  std::vector<PetscScalar> ones(ja.size(), 1);
  MatHandle graph;
  ISHandle first, columns;
  PetscCall(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, n, n, ia.data(), ja.data(), ones.data(), graph.out()));
  PetscCall(MatGetOrdering(graph, MATORDERINGRCM, first.out(), columns.out()));
  const PetscInt* index = nullptr;
  PetscCall(ISGetIndices(first, &index));
  order->assign(index, index + n);
  PetscCall(ISRestoreIndices(first, &index));
  PetscFunctionReturn(0);
}

/// Global index, whether fixed and where it starts, of the particles in `rows`: asked of the chunks of the input.
PetscErrorCode fetch_particle_data(MPI_Comm comm, const Lattice& lattice, const std::vector<std::int64_t>& owned,
                                   const std::vector<std::int64_t>& ghosts, Network* net) {
  const PetscInt count = static_cast<PetscInt>(lattice.particles.count);
  const int d = lattice.dim;
  PetscFunctionBegin;
  LayoutHandle layout;
  PetscCall(PetscLayoutCreateFromSizes(comm, count, PETSC_DECIDE, 1, layout.out()));
  std::vector<PetscInt> rows(owned.begin(), owned.end());
  SFHandle mine, all;
  PetscCall(PetscSFCreate(comm, mine.out()));
  PetscCall(PetscSFSetGraphLayout(mine, layout, static_cast<PetscInt>(rows.size()), nullptr, PETSC_COPY_VALUES, rows.data()));
  std::vector<PetscInt> global_of(static_cast<std::size_t>(count)), numbers(owned.size());
  std::iota(numbers.begin(), numbers.end(), net->first);
  PetscCall(PetscSFReduceBegin(mine, MPIU_INT, numbers.data(), global_of.data(), MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(mine, MPIU_INT, numbers.data(), global_of.data(), MPI_REPLACE));

  for (const std::int64_t ghost : ghosts) {
    rows.push_back(static_cast<PetscInt>(image::row(ghost)));
    for (int k = 0; k < d && net->box.active(); ++k) net->image.push_back(image::shift(ghost, k));
  }
  PetscCall(PetscSFCreate(comm, all.out()));
  PetscCall(PetscSFSetGraphLayout(all, layout, static_cast<PetscInt>(rows.size()), nullptr, PETSC_COPY_VALUES, rows.data()));
  net->global.resize(rows.size());
  net->fixed.resize(rows.size());
  net->held.resize(rows.size() * d);
  net->mass.resize(rows.size());
  PetscCall(fetch_roots(all, 1, global_of, &net->global));
  PetscCall(fetch_roots(all, 1, lattice.fixed, &net->fixed));
  PetscCall(fetch_roots(all, 1, lattice.mass, &net->mass));
  PetscCall(fetch_roots(all, d, lattice.position, &net->held));
  net->inertia.assign(net->mass.begin(), net->mass.begin() + static_cast<std::ptrdiff_t>(owned.size()));
  std::vector<std::uint8_t> chosen(rows.size());
  for (const Group& group : lattice.groups) {
    NetworkGroup found{group.name, 0, {}};
    PetscCall(fetch_roots(all, 1, group.member, &chosen));
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (chosen[i]) found.member.push_back(static_cast<PetscInt>(i));
    found.total = std::count(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(owned.size()), 1);
    PetscCall(sum_over_ranks(comm, &found.total));
    net->groups.push_back(std::move(found));
  }
  PetscFunctionReturn(0);
}

std::vector<std::int64_t> rows_of(const std::vector<ParticleRecord>& particles) {
  std::vector<std::int64_t> rows;
  rows.reserve(particles.size());
  for (const ParticleRecord& p : particles) rows.push_back(p.row);
  return rows;
}

/// Rows of `springs` that begin each particle; particles and springs are sorted by row.
std::vector<PetscInt> row_starts(const std::vector<ParticleRecord>& particles, const std::vector<HalfSpring>& springs) {
  std::vector<PetscInt> start(particles.size() + 1, 0);
  std::size_t e = 0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    while (e < springs.size() && springs[e].self == particles[i].row) ++e;
    start[i + 1] = static_cast<PetscInt>(e);
  }
  return start;
}

/// Fills the owned part of `net` in the order given.
void lay_out(const std::vector<ParticleRecord>& particles, const std::vector<HalfSpring>& springs, const std::vector<AnchorRecord>& anchors,
             const RowIndex& rows, const std::vector<PetscInt>& start, const std::vector<PetscInt>& order, const std::vector<std::int64_t>& ghosts,
             Network* net) {
  const int d = net->dim;
  std::vector<PetscInt> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<PetscInt>(i);
  const auto owned_index = [&](std::int64_t row) -> PetscInt {
    const PetscInt at = rows.find(row);
    return at < 0 ? -1 : place[static_cast<std::size_t>(at)];
  };
  Links& links = net->links;
  links.start.assign(1, 0);
  links.other.reserve(springs.size());
  links.stiffness.reserve(springs.size());
  links.rest_length.reserve(springs.size());
  const bool damped = std::any_of(springs.begin(), springs.end(), [](const HalfSpring& s) { return s.damping != 0; });
  if (damped) links.damping.reserve(springs.size());
  links.spring.reserve(springs.size());
  links.start.reserve(order.size() + 1);
  net->velocity.reserve(order.size() * d);
  for (const PetscInt k : order) {
    const ParticleRecord& p = particles[k];
    net->id.push_back(p.id);
    net->row.push_back(p.row);
    for (int c = 0; c < d; ++c) net->velocity.push_back(p.v[c]);
    for (PetscInt e = start[k]; e < start[k + 1]; ++e) {
      const HalfSpring& s = springs[e];
      PetscInt j = image::shifted(s.other) ? -1 : owned_index(image::row(s.other));
      if (j < 0) j = net->n + static_cast<PetscInt>(std::lower_bound(ghosts.begin(), ghosts.end(), s.other) - ghosts.begin());
      links.other.push_back(j);
      links.stiffness.push_back(s.stiffness);
      links.rest_length.push_back(s.rest_length);
      if (damped) links.damping.push_back(s.damping);
      links.spring.push_back(s.spring);
    }
    links.start.push_back(static_cast<PetscInt>(links.other.size()));
  }
  for (const AnchorRecord& a : anchors) {
    net->anchors.particle.push_back(owned_index(a.particle));
    net->anchors.point.insert(net->anchors.point.end(), a.point, a.point + 3);
    net->anchors.stiffness.push_back(a.stiffness);
    net->anchors.rest_length.push_back(a.rest_length);
    net->anchors.damping.push_back(a.damping);
    net->anchors.row.push_back(a.row);
  }
}

/// Keys of the other ends of `springs` that are none of the particles in `rows`, ascending.
std::vector<std::int64_t> ghost_keys(const RowIndex& rows, const std::vector<HalfSpring>& springs) {
  std::vector<std::int64_t> ghosts;
  for (const HalfSpring& s : springs)
    if (image::shifted(s.other) || rows.find(image::row(s.other)) < 0) ghosts.push_back(s.other);
  std::sort(ghosts.begin(), ghosts.end());
  ghosts.erase(std::unique(ghosts.begin(), ghosts.end()), ghosts.end());
  return ghosts;
}

/// Which rank each particle of this chunk goes to, by the springs at it.
PetscErrorCode assign_ranks(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, const Chunks& chunks, std::vector<int>* rank_of,
                            Network* net) {
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  RowGraph graph;
  if (needs_graph(lattice, options.partition, size)) PetscCall(collect_graph(comm, lattice, options, chunks, &graph));
  PetscCall(partition_rows(comm, lattice, &graph, options.partition, rank_of, &net->partition));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_network_options(MPI_Comm comm, NetworkOptions* out) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Parallel layout", [&](Section& o) {
    o.choice("-bs_partition",
             "how particles are divided among ranks: graph (MatPartitioning, few springs cut), geometric (coordinate bisection) or rows (order of "
             "the input)",
             {"graph", "geometric", "rows"}, out->partition);
    o.choice("-bs_ordering", "order of the particles on a rank: rcm (reverse Cuthill-McKee, for use of the cache) or rows (order of the input)",
             {"rcm", "rows"}, out->ordering);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode build_network(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, Network* net) {
  PetscFunctionBegin;
  net->comm = comm;
  net->dim = lattice.dim;
  net->total = static_cast<PetscInt>(lattice.particles.total);
  net->springs_total = lattice.springs.total;
  net->anchors_total = lattice.anchors.total;
  net->spring_law = lattice.spring_law;
  net->damping_law = lattice.damping_law;
  net->rest_at_zero_length = lattice.rest_at_zero_length;
  net->source = lattice.source;
  net->box = lattice.box;

  Chunks chunks;
  std::vector<HalfSpring> springs;
  PetscCall(gather_chunks(comm, lattice, &chunks));
  std::vector<int> rank_of;
  PetscCall(assign_ranks(comm, lattice, options, chunks, &rank_of, net));

  std::vector<ParticleRecord> particles;
  std::vector<AnchorRecord> anchors;
  PetscCall(collect_half_springs(comm, lattice, options, chunks, rank_of, &springs));
  std::vector<std::vector<InteractionRecord>> interactions;
  PetscCall(collect_interactions(comm, lattice, chunks, rank_of, &interactions));
  add_couplings(interactions, &springs);
  PetscCall(migrate(comm, lattice, chunks, rank_of, &particles, &anchors));
  const std::vector<PetscInt> start = row_starts(particles, springs);
  std::vector<PetscInt> order;
  const RowIndex rows(rows_of(particles));
  PetscCall(order_locally(rows, springs, start, options.ordering, &order));

  const std::vector<std::int64_t> ghosts = ghost_keys(rows, springs);
  net->n = static_cast<PetscInt>(particles.size());
  net->ghosts = static_cast<PetscInt>(ghosts.size());
  for (const std::int64_t ghost : ghosts) net->ghost_row.push_back(image::row(ghost));
  PetscInt last = 0;
  PetscCallMPI(MPI_Scan(&net->n, &last, 1, MPIU_INT, MPI_SUM, comm));
  net->first = last - net->n;
  lay_out(particles, springs, anchors, rows, start, order, ghosts, net);
  lay_out_interactions(lattice, interactions, ghosts, net);
  release(springs);
  PetscCall(give_laws(comm, lattice, net));
  PetscCall(give_columns(comm, lattice, net));
  PetscCall(fetch_particle_data(comm, lattice, net->row, ghosts, net));
  std::int64_t fixed = 0;
  for (PetscInt i = 0; i < net->n; ++i) fixed += net->fixed[i] != 0;
  PetscCallMPI(MPI_Allreduce(&fixed, &net->fixed_total, 1, MPI_INT64_T, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

// Links of a particle to another and to its images follow each other. Both ends find the same: each has as many boxes.
PetscInt Network::coupled_image(PetscInt i, PetscInt e) const {
  const PetscInt j = links.other[e], particle = global[j] - first;
  if (particle < 0 || particle >= n) return j;
  const auto elsewhere = [&](PetscInt k) { return links.other[k] != j && global[links.other[k]] == global[j]; };
  PetscInt before = e, behind = e;
  while (before > links.start[i] && links.other[before] == j) --before;
  while (behind + 1 < links.start[i + 1] && links.other[behind] == j) ++behind;
  return elsewhere(before) || elsewhere(behind) ? j : particle;
}

}  // namespace bs
