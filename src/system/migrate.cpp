#include "system/migrate.hpp"
#include "system/exchange.hpp"

namespace bs {

PetscErrorCode gather_chunks(MPI_Comm comm, const Lattice& lattice, Chunks* chunks) {
  int size = 1;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  chunks->begin.resize(static_cast<std::size_t>(size) + 1);
  const long long first = lattice.particles.first;
  std::vector<long long> all(static_cast<std::size_t>(size));
  PetscCallMPI(MPI_Allgather(&first, 1, MPI_LONG_LONG, all.data(), 1, MPI_LONG_LONG, comm));
  std::copy(all.begin(), all.end(), chunks->begin.begin());
  chunks->begin.back() = lattice.particles.total;
  PetscFunctionReturn(0);
}

PetscErrorCode collect_half_springs(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options,
                                    const Chunks& chunks, std::vector<HalfSpring>* mine) {
  PetscFunctionBegin;
  // half spring 2 k + side
  const auto dest = [&](std::size_t half) { return chunks.owner(lattice.pairs[half]); };
  const auto make = [&](std::size_t half) {
    const std::size_t k = half / 2;
    return HalfSpring{lattice.pairs[half], lattice.pairs[half ^ 1], lattice.springs.first + static_cast<std::int64_t>(k),
                      lattice.stiffness[k], lattice.rest_length[k], lattice.damping[k]};
  };
  PetscCall(exchange(comm, 2 * static_cast<std::size_t>(lattice.springs.count), dest, make, [] {}, mine));
  for (std::int64_t k = 0; k < lattice.particles.count; ++k) {
    const std::int64_t self = lattice.particles.first + k;
    if (options.all_to_all) {
      for (std::int64_t other = 0; other < lattice.particles.total; ++other)
        if (other != self) mine->push_back({self, other, -1, 0, 0, 0});
    } else if (options.center_row >= 0 && options.center_row != self) {
      mine->push_back({self, options.center_row, -1, 0, 0, 0});
    }
  }
  std::sort(mine->begin(), mine->end(), before);
  PetscFunctionReturn(0);
}

namespace {

/// In place, since they are the bulk of a lattice; on one rank they stay where they are.
PetscErrorCode move_springs(MPI_Comm comm, const std::vector<int>& rank_of, std::int64_t first, std::vector<HalfSpring>* springs) {
  int size = 1;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (size == 1) PetscFunctionReturn(0);
  std::vector<HalfSpring> moved;
  PetscCall(exchange(comm, springs->size(), [&](std::size_t e) { return rank_of[(*springs)[e].self - first]; },
                     [&](std::size_t e) { return (*springs)[e]; }, [&] { *springs = {}; }, &moved));
  *springs = std::move(moved);
  std::sort(springs->begin(), springs->end(), before);
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode migrate(MPI_Comm comm, const Lattice& lattice, const Chunks& chunks, const std::vector<int>& rank_of,
                       std::vector<HalfSpring>* springs, std::vector<ParticleRecord>* particles,
                       std::vector<AnchorRecord>* anchors) {
  const std::int64_t first = lattice.particles.first;
  const int d = lattice.dim;
  PetscFunctionBegin;
  std::vector<ParticleRecord> sent(static_cast<std::size_t>(lattice.particles.count));
  for (std::int64_t k = 0; k < lattice.particles.count; ++k) {
    ParticleRecord& p = sent[k];
    p = {first + k, lattice.id.empty() ? first + k : lattice.id[k], lattice.mass[k],
         lattice.radius.empty() ? 0.0 : lattice.radius[k], {0, 0, 0}, {0, 0, 0}, lattice.fixed[k]};
    for (int c = 0; c < d; ++c) p.x[c] = lattice.position[k * d + c];
    for (int c = 0; c < d; ++c) p.v[c] = p.fixed ? 0.0 : lattice.velocity[k * d + c];
  }
  PetscCall(exchange(comm, sent, rank_of, particles));
  std::sort(particles->begin(), particles->end(), [](const auto& a, const auto& b) { return a.row < b.row; });

  PetscCall(move_springs(comm, rank_of, first, springs));

  std::vector<AnchorRecord> near, there(static_cast<std::size_t>(lattice.anchors.count));
  std::vector<int> dest(there.size(), 0);
  for (std::int64_t k = 0; k < lattice.anchors.count; ++k) {
    AnchorRecord& a = there[k];
    a = {lattice.anchor_particle[k], lattice.anchors.first + k, {0, 0, 0}, lattice.anchor_stiffness[k],
         lattice.anchor_rest_length[k], lattice.anchor_damping[k]};
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

}  // namespace bs
