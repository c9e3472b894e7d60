// Springs from particles to fixed points that options ask for, beside those of the file.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>

#include "base/options.hpp"
#include "lattice/lattice.hpp"

namespace bs {

struct AnchorSpec {
  std::vector<std::int64_t> particles;  ///< rows of the lattice, 0-based
  std::string group;                    ///< more of them: the members of this group
  std::vector<double> point;            ///< (d) [m]; empty: each particle's initial place
  double stiffness = 0;                 ///< [N/m], strain law with a rest length: [N]
  double rest_length = 0;               ///< [m]
  double damping = 0;                   ///< [kg/s]

  void options(Section& section);
};

/// Collective. Appends the anchors of `spec` to those of the lattice. Errors (exit 2): unknown particles or group, a point that
/// has not d coordinates, no stiffness, anchor options without particles.
PetscErrorCode add_anchors(MPI_Comm comm, const AnchorSpec& spec, Lattice* lattice);

}  // namespace bs
