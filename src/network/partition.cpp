#include "network/partition.hpp"
#include <dlfcn.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include "base/arrays.hpp"
#include "base/collective.hpp"
#include "base/handle.hpp"

namespace bs {
namespace {

// Why graphs are not cut; empty where they are. PTScotch in the 64-bit-index PETSc of Debian is the 32-bit library: it crashes. ParMETIS, which
// Debian's has not, comes first where there is one, as in PETSc itself; nobody has tried it with this program yet.
#if defined(PETSC_HAVE_PARMETIS) || (defined(PETSC_HAVE_PTSCOTCH) && !defined(PETSC_USE_64BIT_INDICES))
constexpr std::string_view NO_GRAPH;
#elif defined(PETSC_HAVE_PTSCOTCH)
constexpr std::string_view NO_GRAPH = "the PTScotch of this PETSc with 64-bit indices may be that of 32 bits, and is not used";
#else
constexpr std::string_view NO_GRAPH = "this PETSc has neither ParMETIS nor PTScotch, which cut graphs";
#endif

bool worth_a_graph(const Lattice& lattice, int kind, int size) { return size > 1 && kind == 0 && lattice.particles.total >= std::int64_t{8} * size; }

/// PTScotch's random numbers go on from one partition of a process to the next: they begin anew, so that a lattice is divided as by a process of its
/// own. Found by name, for PETSc may be without PTScotch.
void renew_random_numbers() {
  if (void* const reset = dlsym(RTLD_DEFAULT, "SCOTCH_randomReset")) reinterpret_cast<void (*)()>(reset)();
}

using PartitioningHandle = Handle<MatPartitioning, MatPartitioningDestroy>;

/// Weight of a spring in the cut: its rate against the typical one (geometric mean), 1 to 1000. A boundary through stiff
/// springs ruins preconditioners that work rank by rank.
PetscErrorCode edge_weights(MPI_Comm comm, const RowGraph& graph, std::vector<PetscInt>* weights) {
  constexpr double LARGEST = 1000;
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  for (const double rate : graph.rate)
    if (rate > 0) {
      sums[0] += std::log(rate);
      sums[1] += 1;
    }
  PetscCall(sum_over_ranks(comm, sums, 2));
  const double typical = sums[1] > 0 ? std::exp(sums[0] / sums[1]) : 1;
  weights->reserve(graph.rate.size());
  for (const double rate : graph.rate) weights->push_back(static_cast<PetscInt>(std::clamp(std::round(rate / typical), 1.0, LARGEST)));
  PetscFunctionReturn(0);
}

/// Work of a particle: vectors take as long as about OWN springs, then its own springs. Null where the sum would not fit the partitioner's
/// integers. The result belongs to PETSc's allocator.
PetscErrorCode vertex_weights(MPI_Comm comm, const RowGraph& graph, PetscInt n, PetscInt** weights) {
  constexpr PetscInt OWN = 12;
  constexpr double MOST = 1e9;
  PetscFunctionBegin;
  double sum = static_cast<double>(OWN) * static_cast<double>(n) + static_cast<double>(graph.other.size());
  PetscCall(sum_over_ranks(comm, &sum));
  *weights = nullptr;
  if (sum > MOST) PetscFunctionReturn(0);
  PetscCall(PetscMalloc1(n + 1, weights));
  for (PetscInt i = 0; i < n; ++i) (*weights)[i] = OWN + static_cast<PetscInt>(graph.start[i + 1] - graph.start[i]);
  PetscFunctionReturn(0);
}

/// Minimises the cut of the spring graph by MatPartitioning, with equal shares of the work.
PetscErrorCode by_graph(MPI_Comm comm, const Lattice& lattice, RowGraph* graph, std::vector<int>* rank_of, std::string* used) {
  PetscFunctionBegin;
  const PetscInt n = static_cast<PetscInt>(lattice.particles.count);
  PetscInt *ia = nullptr, *ja = nullptr, *weight = nullptr, *work = nullptr;
  std::vector<PetscInt> weights;
  PetscCall(edge_weights(comm, *graph, &weights));
  PetscCall(vertex_weights(comm, *graph, n, &work));
  PetscCall(PetscMalloc1(n + 1, &ia));
  PetscCall(PetscMalloc1(graph->other.size() + 1, &ja));
  PetscCall(PetscMalloc1(graph->other.size() + 1, &weight));
  PetscInt entries = 0;
  ia[0] = 0;
  for (PetscInt i = 0; i < n; ++i) {
    // springs are sorted by the other end: several between one pair stand side by side
    std::int64_t last = -1;
    for (std::int64_t e = graph->start[i]; e < graph->start[i + 1]; ++e) {
      if (graph->other[e] != last) {
        weight[entries] = 0;
        ja[entries++] = static_cast<PetscInt>(graph->other[e]);
      }
      weight[entries - 1] += weights[static_cast<std::size_t>(e)];
      last = graph->other[e];
    }
    ia[i + 1] = entries;
  }
  *graph = {};
  release(weights);
  MatHandle adjacency;
  PartitioningHandle partitioning;
  ISHandle target;
  PetscCall(MatCreateMPIAdj(comm, n, static_cast<PetscInt>(lattice.particles.total), ia, ja, weight, adjacency.out()));
  PetscCall(MatPartitioningCreate(comm, partitioning.out()));
  PetscCall(MatPartitioningSetAdjacency(partitioning, adjacency));
  PetscCall(MatPartitioningSetUseEdgeWeights(partitioning, PETSC_TRUE));
  if (work) PetscCall(MatPartitioningSetVertexWeights(partitioning, work));  // which frees it
  PetscCall(MatPartitioningSetFromOptions(partitioning));
  renew_random_numbers();
  PetscCall(MatPartitioningApply(partitioning, target.out()));
  const PetscInt* rank = nullptr;
  PetscCall(ISGetIndices(target, &rank));
  rank_of->assign(rank, rank + n);
  PetscCall(ISRestoreIndices(target, &rank));
  MatPartitioningType type = nullptr;
  PetscCall(MatPartitioningGetType(partitioning, &type));
  *used = std::string("graph (") + (type ? type : "default") + ")";
  PetscFunctionReturn(0);
}

/// One box of recursive bisection: ranks [begin, end) share it.
struct Box {
  int begin, end, axis;
  double low, high, cut;
};

/// Coordinate along `axis`, with a tiny slope in the others and in the row so that lattice planes can be divided.
double key(const Lattice& lattice, std::int64_t k, int axis) {
  double value = lattice.position[k * lattice.dim + axis], rest = 0;
  for (int c = 0; c < lattice.dim; ++c) rest += c == axis ? 0 : (c + 1) * lattice.position[k * lattice.dim + c];
  const double row = static_cast<double>(lattice.particles.first + k) / static_cast<double>(lattice.particles.total);
  return value + 1e-6 * rest + 1e-9 * row * (1 + std::abs(value));
}

/// Cuts each box of `box_of` along its longest side so that both halves hold their ranks' share: 60 bisections on the
/// counts, all boxes at once.
PetscErrorCode cut_boxes(MPI_Comm comm, const Lattice& lattice, const std::vector<int>& box_of, std::vector<Box>& boxes) {
  PetscFunctionBegin;
  const std::size_t many = boxes.size();
  const int d = lattice.dim;
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<double> low(many * 3, inf), high(many * 3, -inf);
  std::vector<long long> count(many, 0);
  for (std::size_t k = 0; k < box_of.size(); ++k) {
    ++count[box_of[k]];
    for (int c = 0; c < d; ++c) {
      const double x = key(lattice, static_cast<std::int64_t>(k), c);
      low[box_of[k] * 3 + c] = std::min(low[box_of[k] * 3 + c], x);
      high[box_of[k] * 3 + c] = std::max(high[box_of[k] * 3 + c], x);
    }
  }
  const int numbers = static_cast<int>(many);
  PetscCall(min_over_ranks(comm, low.data(), 3 * numbers));
  PetscCall(max_over_ranks(comm, high.data(), 3 * numbers));
  PetscCall(sum_over_ranks(comm, count.data(), numbers));
  for (std::size_t b = 0; b < many; ++b) {
    boxes[b].axis = 0;
    for (int c = 1; c < d; ++c)
      if (high[b * 3 + c] - low[b * 3 + c] > high[b * 3 + boxes[b].axis] - low[b * 3 + boxes[b].axis]) boxes[b].axis = c;
    boxes[b].low = low[b * 3 + boxes[b].axis];
    boxes[b].high = high[b * 3 + boxes[b].axis];
  }
  for (int iteration = 0; iteration < 60; ++iteration) {
    std::vector<long long> below(many, 0);
    for (Box& box : boxes) box.cut = 0.5 * (box.low + box.high);
    for (std::size_t k = 0; k < box_of.size(); ++k) {
      const Box& box = boxes[box_of[k]];
      if (key(lattice, static_cast<std::int64_t>(k), box.axis) < box.cut) ++below[box_of[k]];
    }
    PetscCall(sum_over_ranks(comm, below.data(), numbers));
    for (std::size_t b = 0; b < many; ++b) {
      const int ranks = boxes[b].end - boxes[b].begin, left = ranks / 2;
      const long long wanted = count[b] * left / ranks;
      (below[b] < wanted ? boxes[b].low : boxes[b].high) = boxes[b].cut;
    }
  }
  PetscFunctionReturn(0);
}

/// Recursive coordinate bisection: needs no graph and no library, and is deterministic.
PetscErrorCode by_geometry(MPI_Comm comm, const Lattice& lattice, std::vector<int>* rank_of) {
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  std::vector<Box> boxes = {{0, size, 0, 0, 0, 0}};
  std::vector<int> box_of(static_cast<std::size_t>(lattice.particles.count), 0);
  for (bool divided = true; divided;) {
    divided = std::any_of(boxes.begin(), boxes.end(), [](const Box& b) { return b.end - b.begin > 1; });
    if (!divided) break;
    PetscCall(cut_boxes(comm, lattice, box_of, boxes));
    std::vector<Box> halves;
    std::vector<std::array<int, 2>> child(boxes.size());
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      const int middle = boxes[b].begin + (boxes[b].end - boxes[b].begin) / 2;
      child[b] = {static_cast<int>(halves.size()), static_cast<int>(halves.size())};
      if (middle > boxes[b].begin) {
        halves.push_back({boxes[b].begin, middle, 0, 0, 0, 0});
        child[b][1] = static_cast<int>(halves.size());
      }
      halves.push_back({middle, boxes[b].end, 0, 0, 0, 0});
    }
    for (std::size_t k = 0; k < box_of.size(); ++k) {
      const Box& box = boxes[box_of[k]];
      const bool right = key(lattice, static_cast<std::int64_t>(k), box.axis) >= box.high;
      box_of[k] = child[box_of[k]][right];
    }
    boxes = std::move(halves);
  }
  for (std::size_t k = 0; k < box_of.size(); ++k) (*rank_of)[k] = boxes[box_of[k]].begin;
  PetscFunctionReturn(0);
}

}  // namespace

bool needs_graph(const Lattice& lattice, int kind, int size) { return NO_GRAPH.empty() && worth_a_graph(lattice, kind, size); }

PetscErrorCode partition_rows(MPI_Comm comm, const Lattice& lattice, RowGraph* graph, int kind, std::vector<int>* rank_of, std::string* used) {
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  rank_of->assign(static_cast<std::size_t>(lattice.particles.count), 0);
  if (size == 1) {
    *used = "one rank";
  } else if (needs_graph(lattice, kind, size)) {
    PetscCall(by_graph(comm, lattice, graph, rank_of, used));
  } else if (kind <= 1) {
    PetscCall(by_geometry(comm, lattice, rank_of));
    *used = "coordinate bisection";
    if (worth_a_graph(lattice, kind, size)) *used += " (" + std::string(NO_GRAPH) + ")";
  } else {
    for (std::size_t k = 0; k < rank_of->size(); ++k) {
      const std::int64_t row = lattice.particles.first + static_cast<std::int64_t>(k);
      (*rank_of)[k] = static_cast<int>(row * size / lattice.particles.total);
    }
    *used = "rows";
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
