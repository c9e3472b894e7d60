#include "systems/particles/condensed/coarse_choice.hpp"
#include <algorithm>
#include <limits>

namespace bs {

namespace {

constexpr double THIN = 10;
constexpr double UNEVEN = 100;
constexpr double LINE = 1e-6;  // of its length: what a line may be off straight

}  // namespace

PetscErrorCode prefers_rigid_motions(const Network& net, bool* rigid) {
  const int d = net.dim;
  double low[8];  // lower and minus upper corner, smallest and minus largest stiffness
  double shortest = std::numeric_limits<double>::max(), longest = 0, second = 0;
  PetscFunctionBegin;
  std::fill_n(low, 8, std::numeric_limits<double>::max());
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < d; ++c) {
      const double x = net.held[static_cast<std::size_t>(i * d + c)];
      low[c] = std::min(low[c], x);
      low[3 + c] = std::min(low[3 + c], -x);
    }
  for (const double k : net.links.stiffness)
    if (k > 0) {
      low[6] = std::min(low[6], k);
      low[7] = std::min(low[7], -k);
    }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, low, 8, MPI_DOUBLE, MPI_MIN, net.comm));
  for (int c = 0; c < d; ++c) {
    const double extent = -low[3 + c] - low[c];
    shortest = std::min(shortest, extent);
    second = std::max(second, std::min(extent, longest));
    longest = std::max(longest, extent);
  }
  const bool even = low[6] < std::numeric_limits<double>::max() && -low[7] <= UNEVEN * low[6], line = second <= LINE * longest;
  *rigid = d > 1 && even && !line && THIN * shortest <= longest;
  PetscFunctionReturn(0);
}

}  // namespace bs
