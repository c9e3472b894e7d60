// Pairs of S of a particle that is tied by springs alone to free particles of its rank, four at a time.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>
#include "network/network.hpp"
#include "systems/particles/condensed/lanes.hpp"

namespace bs {

/// Places of the links of owned particle i that are its pairs in S, those to higher particles. False where the links are not all to free particles of
/// this rank, or not one to a pair, or more than `room`.
inline bool list_pairs(const Network& net, PetscInt i, PetscInt pairs, PetscInt room, PetscInt* places) noexcept {
  const PetscInt begin = net.links.start[i], end = net.links.start[i + 1];
  if (end - begin > room) return false;
  PetscInt count = 0;
  bool held = false;
  for (PetscInt e = begin; e < end; ++e) {
    const PetscInt j = net.links.other[e];
    held = held || j >= net.n || net.fixed[j];
    places[count] = e;
    count += j > i;
  }
  return !held && count == pairs;
}

/// The numbers (w, t) of four pairs: B = t I + w w^T, t = c T/l, w = sqrt(c (T' - T/l)) dx/l, with the formulas of add_to_pair. `places`: of
/// their links; the first `count` are written to `to`. False, and nothing is written, where ends coincide.
template <class Spring, bool positive>
inline bool fill_four(const Links& links, const PetscInt* places, int count, lanes::Vector<3> here, const double* states, double c,
                      float* to) noexcept {
  using Four = lanes::Vector<3>;
  Four dx[4], l, K, L, root;
  for (int k = 0; k < 4; ++k) {
    const PetscInt e = places[std::min(k, count - 1)];
    dx[k] = here - lanes::load<3>(states + static_cast<std::size_t>(links.other[e]) * 6);
    K[k] = links.stiffness[e];
    L[k] = links.rest_length[e];
  }
  const Four a = __builtin_shufflevector(dx[0], dx[1], 0, 4, 2, 6), b = __builtin_shufflevector(dx[2], dx[3], 0, 4, 2, 6);
  const Four s = __builtin_shufflevector(dx[0], dx[1], 1, 5, 3, 7), u = __builtin_shufflevector(dx[2], dx[3], 1, 5, 3, 7);
  const Four x = __builtin_shufflevector(a, b, 0, 1, 4, 5), y = __builtin_shufflevector(s, u, 0, 1, 4, 5),
             z = __builtin_shufflevector(a, b, 2, 3, 6, 7);
  const Four square = x * x + y * y + z * z;
  for (int k = 0; k < 4; ++k) l[k] = std::sqrt(square[k]);
  if (!(l[0] > 0 && l[1] > 0 && l[2] > 0 && l[3] > 0)) return false;
  Four across = Spring::tension_over_length(l, K, L) * c;
  if (positive) across = across < 0 ? Four{} : across;
  Four along = Spring::stiffness(l, K, L) * c - across;
  along = along > 0 ? along : Four{};
  for (int k = 0; k < 4; ++k) root[k] = std::sqrt(along[k]);
  const Four scale = root / l;
  for (int k = 0; k < count; ++k) {
    Four numbers = dx[k] * scale[k];
    numbers[3] = across[k];
    const auto rounded = __builtin_convertvector(numbers, lanes::Register<float, 4>::type);
    std::memcpy(to + 4 * k, &rounded, sizeof rounded);
  }
  return true;
}

/// All pairs of owned particle i; false where they have to be made one by one. c: what the springs' rates are multiplied by; `to`: zeros, as after
/// false.
template <class Spring, bool positive>
inline bool fill_plain_pairs(const Network& net, PetscInt i, PetscInt pairs, const double* states, double c, float* to) noexcept {
  constexpr PetscInt ROOM = 64;
  PetscInt places[ROOM + 1];
  if (!list_pairs(net, i, pairs, ROOM, places)) return false;
  const lanes::Vector<3> here = lanes::load<3>(states + static_cast<std::size_t>(i) * 6);
  for (PetscInt k = 0; k < pairs; k += 4)
    if (!fill_four<Spring, positive>(net.links, places + k, static_cast<int>(std::min<PetscInt>(4, pairs - k)), here, states, c, to + 4 * k)) {
      std::fill_n(to, 4 * pairs, 0.0F);
      return false;
    }
  return true;
}

}  // namespace bs
