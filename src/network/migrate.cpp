#include "network/migrate.hpp"
#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/memory.hpp"
#include "base/text.hpp"

namespace bs {

PetscErrorCode gather_chunks(MPI_Comm comm, const Lattice& lattice, Chunks* chunks) {
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  chunks->begin.resize(static_cast<std::size_t>(size) + 1);
  const long long first = lattice.particles.first;
  std::vector<long long> all(static_cast<std::size_t>(size));
  PetscCallMPI(MPI_Allgather(&first, 1, MPI_LONG_LONG, all.data(), 1, MPI_LONG_LONG, comm));
  std::copy(all.begin(), all.end(), chunks->begin.begin());
  chunks->begin.back() = lattice.particles.total;
  PetscFunctionReturn(0);
}

PetscErrorCode fetch_rows(MPI_Comm comm, const Rows& rows, const std::vector<double>& values, int width, const std::vector<std::int64_t>& wanted,
                          std::vector<double>* out) {
  const std::vector<PetscInt> roots(wanted.begin(), wanted.end());
  LayoutHandle layout;
  SFHandle sf;
  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(comm, static_cast<PetscInt>(rows.count), PETSC_DECIDE, 1, layout.out()));
  PetscCall(PetscSFCreate(comm, sf.out()));
  PetscCall(PetscSFSetGraphLayout(sf, layout, static_cast<PetscInt>(roots.size()), nullptr, PETSC_COPY_VALUES, roots.data()));
  out->resize(wanted.size() * static_cast<std::size_t>(width));
  PetscCall(fetch_roots(sf, width, values, out));
  PetscFunctionReturn(0);
}

namespace {

/// The springs of this rank's chunk, each seen from both of its ends: half spring 2 k + side is spring k seen from its end `side`.
struct Halves {
  const Lattice& lattice;
  std::size_t count() const { return 2 * static_cast<std::size_t>(lattice.springs.count); }
  std::int64_t self(std::size_t half) const { return lattice.pairs[half]; }
  /// The far end; seen from the second end, the shift of the first has the opposite sign.
  std::int64_t other(std::size_t half) const {
    const std::int64_t row = lattice.pairs[half ^ 1];
    if (lattice.shift.empty()) return image::key(row);
    return image::key(row, lattice.shift.data() + half / 2 * static_cast<std::size_t>(lattice.dim), lattice.dim, half % 2 ? -1 : 1);
  }
  HalfSpring operator()(std::size_t half) const {
    const std::size_t k = half / 2;
    return {lattice.pairs[half],    other(half),       lattice.springs.first + static_cast<std::int64_t>(k), lattice.stiffness[k],
            lattice.rest_length[k], lattice.damping[k]};
  }
};

/// Sorts all half springs: each is put among those of its particle first, of which there are few to sort.
void put_in_order(const Halves& halves, std::int64_t particles, std::vector<HalfSpring>* out) {
  std::vector<std::size_t> at(static_cast<std::size_t>(particles) + 1, 0);
  for (std::size_t k = 0; k < halves.count(); ++k) ++at[static_cast<std::size_t>(halves.self(k)) + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  out->resize(halves.count());
  for (std::size_t k = 0; k < halves.count(); ++k) (*out)[at[static_cast<std::size_t>(halves.self(k))]++] = halves(k);
  std::size_t begin = 0;
  for (std::int64_t i = 0; i < particles; ++i) {  // at[i] is now the end of the half springs of particle i
    const std::size_t end = at[static_cast<std::size_t>(i)];
    std::sort(out->begin() + static_cast<std::ptrdiff_t>(begin), out->begin() + static_cast<std::ptrdiff_t>(end), before);
    begin = end;
  }
}

/// Calls keep(coupling) for each coupling without a spring that `options` asks for at the particles of this chunk.
template <class Keep>
void for_each_coupling(const Lattice& lattice, const NetworkOptions& options, Keep&& keep) {
  const std::array<std::int64_t, 2> first{lattice.particles.first, 0};
  for (auto one = std::lower_bound(options.couples.begin(), options.couples.end(), first);
       one != options.couples.end() && (*one)[0] < lattice.particles.first + lattice.particles.count; ++one)
    keep(HalfSpring{(*one)[0], image::key((*one)[1]), -1, 0, 0, 0});
  for (std::int64_t k = 0; k < lattice.particles.count; ++k) {
    const std::int64_t self = lattice.particles.first + k;
    if (options.all_to_all) {
      for (std::int64_t other = 0; other < lattice.particles.total; ++other)
        if (other != self) keep(HalfSpring{self, image::key(other), -1, 0, 0, 0});
    } else if (options.center_row >= 0 && options.center_row != self) {
      keep(HalfSpring{self, image::key(options.center_row), -1, 0, 0, 0});
    }
  }
}

/// An edge of the spring graph on its way to the partitioner.
struct Edge {
  std::int64_t self, other;
  double rate;  ///< stiffness by the spring's law [N/m]
};

}  // namespace

PetscErrorCode collect_graph(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, const Chunks& chunks, RowGraph* graph) {
  PetscFunctionBegin;
  const Halves halves{lattice};
  const SpringRows rows(lattice);
  const auto edge = [&](std::size_t half) {
    const HalfSpring s = halves(half);
    return Edge{s.self, image::row(s.other), rows.rate(half / 2)};
  };
  std::vector<Edge> edges;
  edges.reserve(halves.count() * 11 / 10);
  PetscCall(exchange_in_slices<Edge>(
      comm, halves.count(), options.slice, [&](std::size_t k) { return chunks.owner(halves.self(k)); }, [&](std::size_t k) { return edge(k); },
      [&](const std::vector<Edge>& received) {
        edges.insert(edges.end(), received.begin(), received.end());
        return PetscErrorCode(0);
      }));
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return std::tie(a.self, a.other, a.rate) < std::tie(b.self, b.other, b.rate); });
  graph->start.assign(1, 0);
  graph->other.reserve(edges.size());
  graph->rate.reserve(edges.size());
  std::size_t e = 0;
  for (std::int64_t k = 0; k < lattice.particles.count; ++k) {
    for (; e < edges.size() && edges[e].self == lattice.particles.first + k; ++e) {
      if (edges[e].other == edges[e].self) continue;  // the spring joins a particle to its own image
      graph->other.push_back(edges[e].other);
      graph->rate.push_back(edges[e].rate);
    }
    graph->start.push_back(static_cast<std::int64_t>(graph->other.size()));
  }
  PetscFunctionReturn(0);
}

// Half springs are sent first to the ranks whose chunks hold their ends, since only those know the new owners.
PetscErrorCode collect_half_springs(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, const Chunks& chunks,
                                    const std::vector<int>& rank_of, std::vector<HalfSpring>* mine) {
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  const Halves halves{lattice};
  const std::int64_t first = lattice.particles.first;
  const auto owner = [&](const HalfSpring& s) { return rank_of[static_cast<std::size_t>(s.self - first)]; };
  const auto forward = [&](const std::vector<HalfSpring>& items) {
    std::vector<HalfSpring> received;
    PetscFunctionBegin;
    PetscCall(exchange(
        comm, items.size(), [&](std::size_t k) { return owner(items[k]); }, [&](std::size_t k) { return items[k]; }, &received));
    mine->insert(mine->end(), received.begin(), received.end());
    PetscFunctionReturn(0);
  };
  if (size == 1) {
    put_in_order(halves, lattice.particles.count, mine);
  } else {
    // reserves a tenth more than the average; pages that are never written take no memory
    mine->reserve(static_cast<std::size_t>(2 * lattice.springs.total / size * 11 / 10));
    PetscCall(exchange_in_slices<HalfSpring>(
        comm, halves.count(), options.slice, [&](std::size_t k) { return chunks.owner(halves.self(k)); }, halves, forward));
  }
  std::vector<HalfSpring> couplings;
  for_each_coupling(lattice, options, [&](const HalfSpring& s) { couplings.push_back(s); });
  const std::size_t sorted = size == 1 ? mine->size() : 0;
  PetscCall(forward(couplings));
  if (mine->size() > sorted) std::sort(mine->begin(), mine->end(), before);
  PetscFunctionReturn(0);
}

PetscErrorCode migrate(MPI_Comm comm, const Lattice& lattice, const Chunks& chunks, const std::vector<int>& rank_of,
                       std::vector<ParticleRecord>* particles, std::vector<AnchorRecord>* anchors) {
  const std::int64_t first = lattice.particles.first;
  const int d = lattice.dim;
  PetscFunctionBegin;
  std::vector<ParticleRecord> sent(static_cast<std::size_t>(lattice.particles.count));
  for (std::int64_t k = 0; k < lattice.particles.count; ++k) {
    ParticleRecord& p = sent[k];
    p = {first + k, lattice.id.empty() ? first + k : lattice.id[k], lattice.mass[k], {0, 0, 0}, {0, 0, 0}, lattice.fixed[k]};
    for (int c = 0; c < d; ++c) p.x[c] = lattice.position[k * d + c];
    for (int c = 0; c < d; ++c) p.v[c] = p.fixed ? 0.0 : lattice.velocity[k * d + c];
  }
  PetscCall(exchange(comm, sent, rank_of, particles));
  std::sort(particles->begin(), particles->end(), [](const auto& a, const auto& b) { return a.row < b.row; });

  std::vector<AnchorRecord> near, there(static_cast<std::size_t>(lattice.anchors.count));
  std::vector<int> dest(there.size(), 0);
  for (std::int64_t k = 0; k < lattice.anchors.count; ++k) {
    AnchorRecord& a = there[k];
    a = {lattice.anchor_particle[k],  lattice.anchors.first + k,     {0, 0, 0},
         lattice.anchor_stiffness[k], lattice.anchor_rest_length[k], lattice.anchor_damping[k]};
    for (int c = 0; c < d; ++c) a.point[c] = lattice.anchor_point[k * d + c];
    dest[k] = chunks.owner(a.particle);
  }
  PetscCall(exchange(comm, there, dest, &near));
  dest.assign(near.size(), 0);
  for (std::size_t k = 0; k < near.size(); ++k) dest[k] = rank_of[near[k].particle - first];
  PetscCall(exchange(comm, near, dest, anchors));
  std::sort(anchors->begin(), anchors->end(),
            [](const auto& a, const auto& b) { return a.particle != b.particle ? a.particle < b.particle : a.row < b.row; });
  PetscFunctionReturn(0);
}

double chunk_bytes(const LatticeSize& size, int ranks) {
  constexpr double NUMBER = sizeof(double);
  const double point = size.dim * NUMBER;
  const double particle = 2 * point + NUMBER + 1;               // position, velocity, mass, fixed
  const double spring = 2 * sizeof(std::int64_t) + 3 * NUMBER;  // ends, stiffness, rest length, damping
  const double anchor = sizeof(std::int64_t) + point + 3 * NUMBER;
  return (static_cast<double>(size.particles) * particle + static_cast<double>(size.springs) * spring + static_cast<double>(size.anchors) * anchor) /
         ranks;
}

double network_bytes(const LatticeSize& size, int ranks) {
  constexpr double NUMBER = sizeof(double), LINK = sizeof(PetscInt) + 2 * NUMBER + sizeof(std::int64_t);
  const double particle = sizeof(ParticleRecord) + 2 * sizeof(std::int64_t) + size.dim * NUMBER;  // velocity
  const double half = sizeof(HalfSpring) + LINK;
  return (static_cast<double>(size.particles) * particle + 2 * static_cast<double>(size.springs) * half) / ranks;
}

double lattice_bytes(const LatticeSize& size, int ranks) { return chunk_bytes(size, ranks) + (ranks > 1 ? 0.9 : 1.0) * network_bytes(size, ranks); }

PetscErrorCode reserve_lattice(MPI_Comm comm, const std::string& source, const LatticeSize& size) {
  PetscFunctionBegin;
  const PetscMPIInt ranks = size_of(comm);
  MemoryNeed need;
  need.what = source + ": setting up " + how_many(size.particles, "particle") + " and " + how_many(size.springs, "spring");
  need.bytes = lattice_bytes(size, ranks);
  PetscCall(reserve_memory(comm, need));
  PetscFunctionReturn(0);
}

}  // namespace bs
