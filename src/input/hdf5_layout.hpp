// Where lattices and trajectories keep what in an HDF5 file, and what the file says about itself.
#pragma once
#include <petscsys.h>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>
#include "input/hdf5_file.hpp"
#include "lattice/columns.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

/// Where a kind of file keeps what.
struct Hdf5Layout {
  bool trajectory;
  /// Where particles keep what stays, what moves, and the numbers of lattice/columns.hpp.
  std::string particle(const std::string& name) const { return (trajectory ? "/particles/trajectory/" : "/particles/") + name; }
  std::string motion(const std::string& name) const { return particle(name) + (trajectory ? "/value" : ""); }
  std::string particle_column(const ParticleParameter& one) const { return particle(trajectory ? one.in_trajectory() : one.name); }
  /// What is there where springs are; their ends, their numbers, and what laws carry from step to step.
  std::string springs() const { return trajectory ? "/connectivity/bonds" : "/springs"; }
  std::string pairs() const { return springs() + (trajectory ? "" : "/pairs"); }
  std::string column(const std::string& name) const { return (trajectory ? "/connectivity/bonds_" : "/springs/") + name; }
  std::string history(const std::string& name) const { return trajectory ? "/backspring/" + name + "/value" : "/springs/" + name; }
  /// Springs to given points; a trajectory that is read has none.
  std::string anchor(const std::string& name) const { return (trajectory ? "/backspring/anchors/" : "/anchors/") + name; }
};

/// Collective. This rank's part of `rows.total` rows of `width` numbers, 0 one, of the dataset `path`; `frames`: of their last frame; `row_name`: how
/// messages call the number of rows; `truths`: truth values may stand for integers.
template <class T>
PetscErrorCode read_rows(const Hdf5File& file, const std::string& path, const Rows& rows, const char* row_name, bool frames, std::vector<T>* out,
                         int width = 0, bool truths = false) {
  Table table;
  TableShape shape;
  PetscFunctionBegin;
  shape.integers = std::is_integral_v<T>;
  shape.truths = truths;
  shape.rows = rows.total;
  shape.row_name = row_name;
  shape.frames = frames;
  shape.columns = width;
  PetscCall(file.find(path, shape, &table));
  PetscCall(file.read(table, rows.first, rows.count, 0, out));
  PetscFunctionReturn(0);
}

/// Collective. Reads `column` from its path so and keeps it, where the file holds it.
PetscErrorCode add_column(const Hdf5File& file, Column column, const Rows& rows, const char* row_name, bool frames, std::vector<Column>* out,
                          int width = 0);

/// Of a trajectory whose box is strained: its L = F' F^-1 (d, d) in every frame, whose velocities contain the flow L x. Those of lattices do not.
inline const char* const BOX_FLOW = "/particles/trajectory/box/velocity_gradient";

/// That of trajectories, or of lattices.
inline Hdf5Layout hdf5_layout(bool trajectory) { return {trajectory}; }

/// The layout of `file`: a trajectory's where it has frames, else a lattice's.
Hdf5Layout layout_of(const Hdf5File& file);

/// Local. d of a trajectory whose positions have `columns` components: those written as padding do not count.
int lattice_dimension(const Hdf5File& file, int columns);

/// Collective. Sets the lattice's laws, and whether the file gives them. Error (exit 2): unknown law.
PetscErrorCode read_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* lattice);

/// Collective. The law of each spring, where the file gives one, into the lattice's chunk; whose rows are known. Errors (exit 2):
/// no names or unknown ones, numbers that name none.
PetscErrorCode read_row_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* lattice);

/// What the program reads of a lattice file: its groups but /groups, whose members have names of the user's, and the datasets in them.
std::vector<std::pair<std::string, std::vector<std::string>>> lattice_members();

/// Attributes of / of a lattice: what an .xsp scene says beyond its masses and springs. Options it implies, "NAME VALUE NAME VALUE ...", and
/// whether a spring whose ends meet exerts no force ("none") or is an error ("error", as where the attribute is not there).
inline constexpr const char *IMPLIED_OPTIONS = "implied_options", *FORCE_AT_ZERO_LENGTH = "force_at_zero_length";

/// Collective. These two into the lattice. Errors (exit 2): options that are none of a scene's, another word.
PetscErrorCode read_scene_attributes(MPI_Comm comm, const Hdf5File& file, Lattice* lattice);

/// Local. Warns of members of a lattice's groups that are none of the schema: a misspelt name of an optional dataset
/// would otherwise go unseen.
void note_unknown_members(const Hdf5File& file, Lattice* lattice);

// Lattices in HDF5: the program's own schema, or the last frame of a trajectory it wrote.

/// Collective. Each rank reads its rows of the lattice in file `path`, and no others.
///
/// /particles/position (N,d), /particles/mass (N); optional velocity (N,d), fixed (N) of 0 and 1, id (N), and the columns (N) of
/// lattice/columns.hpp by their names (radius, drag; force (N,d)).
/// /springs, optional: pairs (M,2) 0-based, stiffness (M); optional rest_length (M; absent: NaN), damping (M).
/// Optional, too: law (M), places in the list of names that is the attribute spring_laws of /; columns (M) of what the laws take
/// and carry, by their names in physics/pair/springs/registry.hpp (stiffness_2, yield_force, plastic_stretch, ...); area (M).
/// /anchors, optional: particle (A), point (A,d), stiffness (A); optional rest_length (A; absent: 0), damping (A).
/// /angles, optional: triples (A,3), the middle particle second, stiffness (A), rest_angle (A).
/// Attributes of /: spring_law and damping_law, names from physics/pair/springs/registry.hpp.
/// A file with /particles/trajectory/position/value is a trajectory: its last frame, with velocities without the flow of the box,
/// /connectivity/bonds, /connectivity/angles, and the laws among its /parameters/options, or of each spring in /connectivity/bonds_law.
///
/// Errors (exit 2): what cannot be opened, shapes, types, sizes, unknown laws, `fixed` that is not 0 or 1, rest lengths
/// that are not finite. Other values are left to validate().
PetscErrorCode read_hdf5_lattice(MPI_Comm comm, const std::string& path, Lattice* out);

// The periodic box of a lattice: read from a file, and the box that the second end of each spring is in.

/// Collective. /box (attribute boundary, dataset edges) and /springs/shift into the lattice, whose rows of springs are known; of a trajectory its box
/// at the last frame and /connectivity/bonds_shift. Errors (exit 2): words other than periodic and none, edges of the wrong shape or without volume,
/// shifts beyond 63 or across what is not periodic.
PetscErrorCode read_hdf5_box(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& names, Lattice* lattice);

/// Collective. The same errors about the shifts of a lattice that was read from no file.
PetscErrorCode check_shifts(MPI_Comm comm, Lattice* lattice);

/// Collective. Where the lattice has a periodic box and no shifts, each spring joins the nearest images of its ends. Error (exit 2): two images are
/// equally near. Springs joining a particle to itself need a shift. The same of interactions, whose ends are the images nearest to one of them.
PetscErrorCode choose_images(MPI_Comm comm, Lattice* lattice);

// Interactions of several particles in HDF5 files (interactions.cpp), and what they must fulfil. Errors: exit 2.

/// Paths of the datasets of one kind: the rows of particles, and a parameter.
std::string topology_path(const InteractionSchema& schema, bool trajectory);
std::string parameter_path(const InteractionSchema& schema, const std::string& name, bool trajectory);
/// That of the flags of what is broken, of a trajectory one frame after the other.
std::string broken_path(const InteractionSchema& schema, bool trajectory);

/// Collective. Each rank reads its rows of every kind the file has (/angles of a lattice, /connectivity/angles of a trajectory),
/// once the particles are known.
PetscErrorCode read_interactions(MPI_Comm comm, const Hdf5File& file, bool trajectory, Lattice* lattice);

/// Collective. Ends that exist and differ, parameters the law allows, places where it has a force.
PetscErrorCode check_interactions(MPI_Comm comm, const Lattice& lattice);

}  // namespace bs
