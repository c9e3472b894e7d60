// The matrices of G x + C x' = B u(t), from files or a generator.
#pragma once
#include <petscmat.h>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "base/options.hpp"

namespace bs {

struct LinearSystem {
  MatHandle G, C, B;  ///< MATAIJ, n x n, n x n, n x k; B is null without sources
  VecHandle x0;
  std::vector<std::string> labels;  ///< of this rank's states; empty on every rank if there are none
  std::string origin;               ///< for the header
  std::string source;               ///< u(t) where the user gives none; empty: must be given
};

struct SystemOptions {
  std::string G, C, B, x0, labels;
  int type = 0;  ///< 0: files
  std::vector<std::int64_t> size;
  double resistance = 100, capacitance = 1e-8, inductance = 1e-3, vary = 0, conductivity = 1;
  bool resistance_given = false, capacitance_given = false;
  /// With `help`, a missing system is replaced by a small one: the options are only to be listed.
  void read(Section& section, bool help);
};

/// Collective. Builds or reads the system; wrong sizes, and rows that are empty in both G and C, end the run with exit code 2.
PetscErrorCode load_system(MPI_Comm comm, const SystemOptions& options, LinearSystem* out);

/// Collective. G, C, B, labels of a built-in system.
PetscErrorCode generate_system(MPI_Comm comm, const SystemOptions& options, LinearSystem* out);

/// The index of a descriptor system: whether its algebraic equations determine their unknowns.
struct PencilIndex {
  bool higher = false;         ///< it is 2 or more
  std::vector<PetscInt> rows;  ///< (up to 3, ascending, from 0) rows with most part in what is missing; empty for large systems
};

/// Collective; the same on every rank. With bases W, N of the left and right null space of C the index is 0 or 1 just where W'G N is
/// regular. `higher` stays false where this test is too expensive: beyond 100,000 states, or where C couples more than 300 rows with
/// each other.
PetscErrorCode find_index(Mat G, Mat C, PencilIndex* out);

}  // namespace bs
