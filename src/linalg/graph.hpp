// What linear algebra knows of a system: points with d unknowns each, which rank owns them, where they are and what holds them.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace bs {

/// Where owned point i is at present, d numbers.
using Places = std::function<const double*(PetscInt)>;

/// Local points are the n owned ones, then ghosts: points of other ranks and, in periodic systems, images of any point, with its global
/// index. What is referred to must outlive the graph.
struct Graph {
  const std::vector<PetscInt>& global;     ///< (n + ghosts) global indices; owned ones are consecutive
  const std::vector<std::uint8_t>& fixed;  ///< (n + ghosts) not 0: no unknowns, rows and columns hold the diagonal alone
  const std::vector<double>& start;        ///< (n + ghosts, d) where they start
  const std::vector<double>& mass;         ///< (n)
  MPI_Comm comm = MPI_COMM_NULL;
  int dim = 3;
  PetscInt n = 0, ghosts = 0, total = 0;  ///< owned, of other ranks, on all ranks
  PetscInt free = 0;                      ///< not fixed, on all ranks
  bool interactions = false;              ///< of more than two points, on some rank
  bool periodic = false;                  ///< ghosts may be images
  bool holds = false;                     ///< some point of some rank is held in part of its components
  std::vector<std::uint8_t> held = {};    ///< (n + ghosts) bit c: component c of a point that is not fixed; empty: none here
  std::vector<PetscInt> holders = {};     ///< owned points with such components, ascending
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
