// What options change of a lattice that was read from a file, the anchors that they add to any, laws of springs, groups; and what every lattice must
// fulfil.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "base/options.hpp"
#include "input/hdf5_file.hpp"
#include "lattice/generator.hpp"
#include "lattice/groups.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"

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

// Which laws the springs of a lattice obey, and what these need: from options and from what the lattice brings along.

/// What the options say of all springs.
struct SpringOptions {
  struct Constant {
    SpringParameter parameter;
    std::string option;  ///< its name
    double value = 0;
    bool given = false;
  };
  int spring_law = -1, damping_law = -1;  ///< places in the registry; -1: not given
  std::vector<Constant> constants;        ///< one for every parameter of some law

  void read(Section& section);
};

/// Collective. Puts the options into the lattice: afterwards its columns are those that its springs' laws take, with values in range
/// where a spring takes them and 0 elsewhere. Warns of numbers that no spring takes. Errors (exit 2): a number a law needs is not
/// given, or out of its range; a law for all springs where the file has one for each.
PetscErrorCode apply_spring_options(MPI_Comm comm, const SpringOptions& options, Lattice* lattice);

/// Collective. Rest lengths, which are filled in, must be above 0 where a spring's law needs that (exit 2).
PetscErrorCode check_rest_lengths(MPI_Comm comm, const Lattice& lattice);

// Groups of particles that options or a lattice file name.

/// Names of groups with the texts of their options.
using GroupTexts = std::vector<std::pair<std::string, std::string>>;

/// Reads every -bs_group_NAME.
void read_group_options(Section& section, GroupTexts* out);

/// Collective. What they mean for a lattice of `total` particles in `dim` dimensions that extend along the first `axes` axes. Error (exit 2):
/// a text that chooses nothing known.
PetscErrorCode parse_groups(MPI_Comm comm, const GroupTexts& texts, int dim, int axes, std::int64_t total, std::vector<GroupSpec>* out);

/// Collective. /groups/NAME: rows of particles, integers, of a lattice or a trajectory whose particles' rows are known. Errors (exit 2):
/// names that are none, rows that are not there.
PetscErrorCode read_hdf5_groups(MPI_Comm comm, const Hdf5File& file, Lattice* lattice);

/// Collective. Error (exit 2): the lattice has no group of one of these names, which `option` gives.
PetscErrorCode require_groups(MPI_Comm comm, const std::string& option, const std::vector<std::string>& names, const Lattice& lattice);

/// Collective. Errors (exit 2): a group without particles; two whose names differ by capitals alone, which options do not know.
PetscErrorCode check_groups(MPI_Comm comm, const Lattice& lattice);

/// Place of a group among the lattice's, and the text of its option.
using GroupOptions = std::vector<std::pair<std::size_t, std::string>>;

/// Collective. The options that begin with `begin` ("bs_motion_") and go on with a group's name, in the order of the groups; `title` and `help`: for
/// -help. Error (exit 2): there is no group of that name.
PetscErrorCode read_options_of_groups(MPI_Comm comm, const Lattice& lattice, const std::string& begin, const char* title, const char* help,
                                      GroupOptions* out);

// What every lattice must fulfil, wherever it comes from. All faults are of the user's making: exit 2.

/// Collective, the same arguments on every rank. Whether the numbers of rows fit PETSc's indices (and are not 0).
PetscErrorCode check_sizes(MPI_Comm comm, const std::string& source, std::int64_t particles, int dim, std::int64_t springs, std::int64_t anchors);

/// Collective. Sizes, numbers of particles, springs and anchors, their ends and lengths, interactions; rest lengths that are NaN become the initial
/// distance.
PetscErrorCode validate(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
