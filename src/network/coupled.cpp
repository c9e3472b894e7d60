#include "network/network.hpp"

namespace bs {

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
