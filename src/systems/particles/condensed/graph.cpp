#include "systems/particles/condensed/graph.hpp"
#include <algorithm>
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

Graph graph_of(const Network& net) {
  Graph graph{net.global, net.fixed, net.held, net.inertia};
  graph.comm = net.comm;
  graph.dim = net.dim;
  graph.n = net.n;
  graph.ghosts = net.ghosts;
  graph.total = net.total;
  graph.free = net.total - static_cast<PetscInt>(net.fixed_total);
  graph.interactions = !net.interactions.empty();
  graph.periodic = net.box.active();
  graph.source = net.source;
  for (const double k : net.links.stiffness)
    if (k > 0) {
      graph.softest = graph.stiffest > 0 ? std::min(graph.softest, k) : k;
      graph.stiffest = std::max(graph.stiffest, k);
    }
  if (!net.constraints->rolls()) return graph;
  graph.holds = true;
  for (PetscInt i = 0; i < net.n + net.ghosts; ++i) {
    graph.held.push_back(net.fixed[i] ? std::uint8_t{0} : net.constraints->held(i));
    if (i < net.n && graph.held.back()) graph.holders.push_back(i);
  }
  return graph;
}

PairPattern pairs_of(const Network& net) {
  const Links& links = net.links;
  PairPattern out;
  out.n = net.n;
  out.ghosts = net.ghosts;
  out.start.reserve(static_cast<std::size_t>(net.n) + 1);
  out.start.assign(1, 0);
  out.other.reserve(links.other.size() / 2 + 1);  // each spring between free particles of this rank once
  out.cut_start.assign(1, 0);
  for (PetscInt i = 0; i < net.n; ++i) {
    PetscInt last = -1;  // parallel springs follow each other
    for (PetscInt e = links.start[i]; e < links.start[i + 1] && !net.fixed[i]; ++e) {
      const PetscInt j = net.coupled(i, e);
      if (links.spring[e] < 0 || net.fixed[j] || j < i || j == last || net.own_image(i, links.other[e])) continue;
      if (j < net.n && j != links.other[e]) out.across.push_back(static_cast<PetscInt>(out.other.size()));
      if (j < net.n) out.other.push_back(j);
      else out.ghost.push_back(j - net.n);
      last = j;
    }
    out.start.push_back(static_cast<PetscInt>(out.other.size()));
    if (static_cast<PetscInt>(out.ghost.size()) > out.cut_start.back()) {
      out.cut_row.push_back(i);
      out.cut_start.push_back(static_cast<PetscInt>(out.ghost.size()));
    }
  }
  out.other.shrink_to_fit();
  out.ghost.shrink_to_fit();
  return out;
}

std::vector<PetscInt> coupled_ends(const Network& net) {
  std::vector<PetscInt> ends;
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1] && !net.fixed[i]; ++e)
      if (has_block(net, e)) ends.insert(ends.end(), {net.global[i], net.global[net.links.other[e]]});
  return ends;
}

}  // namespace bs
