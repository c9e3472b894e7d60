// Changes that options make to a lattice read from a file, anchors that they add to any lattice, laws of springs, groups; and the conditions that
// every lattice must meet.
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

/// Collective. Warns of -bs_lattice_ options that are set but have no meaning for a lattice from a file.
PetscErrorCode warn_of_idle_options(MPI_Comm comm, const std::string& source);

/// Springs from particles to fixed points that options ask for, in addition to those of the file.
struct AnchorSpec {
  std::vector<std::int64_t> particles;  ///< rows of the lattice, 0-based
  std::string group;                    ///< further particles: the members of this group
  std::vector<double> point;            ///< (d) [m]; empty: each particle's initial place
  double stiffness = 0;                 ///< [N/m], strain law with a rest length: [N]
  double rest_length = 0;               ///< [m]
  double damping = 0;                   ///< [kg/s]

  void options(Section& section);
};

/// Collective. Appends the anchors of `spec` to those of the lattice. Errors (exit 2): unknown particles or group, a point that
/// has not d coordinates, no stiffness, anchor options without particles.
PetscErrorCode add_anchors(MPI_Comm comm, const AnchorSpec& spec, Lattice* lattice);

// The laws that the springs of a lattice obey, and the numbers they need, from options and from the lattice itself.

/// Laws and parameters that options give to all springs.
struct SpringOptions {
  struct Constant {
    SpringParameter parameter;
    std::string option;  ///< name of the option
    double value = 0;
    bool given = false;
  };
  int spring_law = -1, damping_law = -1;  ///< indices in the registries; -1: not given
  std::vector<Constant> constants;        ///< one for every parameter of some law

  void read(Section& section);
};

/// Collective. Applies the options to the lattice: afterwards it has the columns that its springs' laws need, with values in range for the springs
/// that use them and 0 for the others. Warns of numbers that no spring uses. Errors (exit 2): a number that a law needs is not given, or is out of
/// its range; a law for all springs where the file has one for each.
PetscErrorCode apply_spring_options(MPI_Comm comm, const SpringOptions& options, Lattice* lattice);

/// Collective. Error (exit 2): a rest length that is not above 0 where the spring's law needs that. Rest lengths must have been filled in.
PetscErrorCode check_rest_lengths(MPI_Comm comm, const Lattice& lattice);

// Groups of particles that options or a lattice file name.

/// Names of groups with the texts of their options.
using GroupTexts = std::vector<std::pair<std::string, std::string>>;

/// Reads every -bs_group_NAME.
void read_group_options(Section& section, GroupTexts* out);

/// Collective. Evaluates these texts for a lattice of `total` particles in `dim` dimensions that extend along the first `axes` axes. Error (exit 2):
/// a text that is none of the known selections.
PetscErrorCode parse_groups(MPI_Comm comm, const GroupTexts& texts, int dim, int axes, std::int64_t total, std::vector<GroupSpec>* out);

/// Collective. Reads /groups/NAME, integer rows of particles, of a lattice, or of a trajectory whose particles' rows are known. Errors (exit 2):
/// invalid names, rows that do not exist.
PetscErrorCode read_hdf5_groups(MPI_Comm comm, const Hdf5File& file, Lattice* lattice);

/// Collective. Error (exit 2): the lattice has no group of one of these names, which were given by `option`.
PetscErrorCode require_groups(MPI_Comm comm, const std::string& option, const std::vector<std::string>& names, const Lattice& lattice);

/// Collective. Errors (exit 2): a group without particles; two groups whose names differ only in capitals, which options ignore.
PetscErrorCode check_groups(MPI_Comm comm, const Lattice& lattice);

/// Index of a group of the lattice, and the text of its option.
using GroupOptions = std::vector<std::pair<std::size_t, std::string>>;

/// Collective. The options that begin with `begin` ("bs_motion_") and go on with a group's name, in the order of the groups; `title` and `help`: for
/// -help. Error (exit 2): there is no group of that name.
PetscErrorCode read_options_of_groups(MPI_Comm comm, const Lattice& lattice, const std::string& begin, const char* title, const char* help,
                                      GroupOptions* out);

// Conditions that every lattice must meet, wherever it comes from. All errors are the user's: exit 2.

/// Collective, with the same arguments on every rank. Checks that the numbers of rows fit PETSc's indices and are not 0.
PetscErrorCode check_sizes(MPI_Comm comm, const std::string& source, std::int64_t particles, int dim, std::int64_t springs, std::int64_t anchors);

/// Collective. Checks sizes, the numbers of particles, springs and anchors, ends, lengths and interactions; rest lengths that are NaN become the
/// initial distance.
PetscErrorCode validate(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
