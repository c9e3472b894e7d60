// What linear algebra knows of a system: points with d unknowns each, which rank owns them, where they are and what holds them.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace bs {

/// The present position of owned point i, d numbers.
using Places = std::function<const double*(PetscInt)>;

/// Local points are the n owned ones, then ghosts: points of other ranks and, in periodic systems, images of any point, with its global
/// index. The arrays referred to must outlive the graph.
struct Graph {
  const std::vector<PetscInt>& global;     ///< (n + ghosts) global indices; owned ones are consecutive
  const std::vector<std::uint8_t>& fixed;  ///< (n + ghosts) not 0: the point has no unknowns; its rows and columns hold only the diagonal
  const std::vector<double>& start;        ///< (n + ghosts, d) initial positions
  const std::vector<double>& mass;         ///< (n)
  MPI_Comm comm = MPI_COMM_NULL;
  int dim = 3;
  PetscInt n = 0, ghosts = 0, total = 0;  ///< points owned, of other ranks, on all ranks
  PetscInt free = 0;                      ///< points that are not fixed, on all ranks
  bool interactions = false;              ///< some rank has interactions of more than two points
  bool periodic = false;                  ///< ghosts may be images
  bool holds = false;                     ///< some point of some rank has components that are held
  std::vector<std::uint8_t> held = {};    ///< (n + ghosts) bit c: component c of a point that is not fixed is held; empty: none on this rank
  std::vector<PetscInt> holders = {};     ///< owned points with held components, ascending
  double softest = 0, stiffest = 0;       ///< stiffness of this rank's couplings; 0: it has none
  std::string source = {};                ///< what the system was made of, for messages

  std::uint8_t mask(PetscInt i) const { return held.empty() ? std::uint8_t{0} : held[static_cast<std::size_t>(i)]; }
  /// visit(k) for every held component k of owned points, among (n, d) numbers.
  template <class Visit>
  void for_held(Visit visit) const {
    for (const PetscInt i : holders)
      for (int c = 0; c < dim; ++c)
        if (mask(i) >> c & 1) visit(static_cast<std::size_t>(i * dim + c));
  }
  /// Sets held components of owned points to 0; values: (n, d).
  void clear_held(double* values) const {
    for_held([values](std::size_t k) { values[k] = 0; });
  }
};

}  // namespace bs
