// What options change of a lattice that was read from a file, and the anchors that they add to any.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/options.hpp"
#include "lattice/generator.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Adds the groups of `spec`, fixes more particles (faces of the bounding box, single ones), gives all a radius, replaces the initial
/// velocities, each where `spec` asks for it; fixed particles are at rest whatever the file says. Errors (exit 2): see check_particle_data.
PetscErrorCode adjust_lattice(MPI_Comm comm, const GeneratorSpec& spec, Lattice* lattice);

/// Collective. Warns of -bs_lattice_ options that are set but say nothing about a lattice from a file.
PetscErrorCode warn_of_idle_options(MPI_Comm comm, const std::string& source);

/// Springs from particles to fixed points that options ask for, beside those of the file.
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
