#include "network/footprint.hpp"

#include "base/memory.hpp"
#include "base/text.hpp"
#include "network/migrate.hpp"

namespace bs {

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
  PetscMPIInt ranks;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  MemoryNeed need;
  need.what = format("%s: setting up %lld particles and %lld springs", source.c_str(), static_cast<long long>(size.particles),
                     static_cast<long long>(size.springs));
  need.bytes = lattice_bytes(size, ranks);
  PetscCall(reserve_memory(comm, need));
  PetscFunctionReturn(0);
}

}  // namespace bs
