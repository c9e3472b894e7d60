// A mass-spring lattice as it was read or generated: one rank's chunk of rows, in the input's order.
// Plain data, free of MPI and PETSc.
#pragma once
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "base/text.hpp"
#include "lattice/box.hpp"

namespace bs {

/// A contiguous chunk [first, first + count) of `total` rows.
struct Rows {
  std::int64_t first = 0, count = 0, total = 0;
};

/// The chunk of `total` rows that rank `rank` of `size` holds; chunks differ by at most one row.
inline Rows split_rows(std::int64_t total, int rank, int size) {
  const std::int64_t base = total / size, rest = total % size;
  return {rank * base + (rank < rest ? rank : rest), base + (rank < rest ? 1 : 0), total};
}

/// A number of each particle or spring that some law takes or carries.
struct Column {
  std::string name;           ///< of the dataset /particles/NAME or /springs/NAME
  std::string path;           ///< where it was read, or the option that gave it, for messages
  std::vector<double> value;  ///< (count of rows); of a vector (count of rows, d)
};

/// Rows of one kind of interaction of several particles; its law says how many ends and parameters a row has.
struct InteractionRows {
  Rows rows;
  std::vector<std::int64_t> ends;     ///< (count, ends) rows of particles, 0-based
  std::vector<double> parameter;      ///< (count, parameters)
  std::vector<std::int64_t> shift;    ///< (count, ends, d) the box each end is in; empty: no periodic box
  std::vector<Column> break_columns;  ///< of lattice/columns.hpp; the same names in the same order on every rank
};

/// Places in the registry of laws (physics/pair/springs/registry.hpp), of which there are more: these are named because the program asks
/// for them.
enum class SpringLaw : int { hooke, strain };
enum class DampingLaw : int { axial, simple };

/// The column of that name, or null.
inline const Column* find_column(const std::vector<Column>& columns, const std::string& name) {
  for (const Column& one : columns)
    if (one.name == name) return &one;
  return nullptr;
}

/// Puts `column` in the place of that of its name, or at the end.
inline void set_column(std::vector<Column>* columns, Column column) {
  for (Column& one : *columns)
    if (one.name == column.name) {
      one = std::move(column);
      return;
    }
  columns->push_back(std::move(column));
}

/// Particles chosen under a name.
struct Group {
  std::string name;
  std::vector<std::uint8_t> member;  ///< (count of particles) 1: it belongs to the group
};

/// What a chunk of a lattice and arrays in memory (lattice/lattice_arrays.hpp) hold alike, rows behind one another; columns and groups have the same
/// names in the same order on every rank. Units: SI unless the user thinks otherwise; the program never converts.
struct LatticeNumbers {
  int dim = 3;  ///< d = 1, 2, 3
  // of particles
  std::vector<double> position;          ///< (count, d) [m]
  std::vector<double> velocity;          ///< (count, d) [m/s]
  std::vector<double> mass;              ///< (count) [kg]
  std::vector<std::uint8_t> fixed;       ///< (count) 1: fixed; while the network is built, 2: moves as given
  std::vector<std::int64_t> id;          ///< (count) the user's numbers, or empty: the rows, counted from 0
  std::vector<Column> particle_columns;  ///< of lattice/columns.hpp: radius, drag (count), force (count, d)
  std::vector<Group> groups;             ///< particles under a name
  // of springs
  std::vector<double> stiffness;       ///< (count) hooke [N/m], strain [N], zero rest length [N/m]
  std::vector<double> rest_length;     ///< (count) [m]; NaN: the initial distance, filled in later
  std::vector<double> damping;         ///< (count) [kg/s]
  std::vector<std::int64_t> shift;     ///< (count, d) the box the second end is in; empty: no periodic box
  std::vector<Column> spring_columns;  ///< (count) what laws of springs take and carry (lattice/spring_laws.hpp)
  std::vector<Column> break_columns;   ///< (count) critical_strain, critical_force, critical_energy, and broken: 1 or 0
  PeriodicBox box;                     ///< without periodic directions: none
  bool rest_at_zero_length = false;    ///< a spring of zero length exerts no force instead of being an error
  /// Options that go with it ("-bs_gravity", "0,-9.8"): in force where the user set none. Values by %.17g.
  std::vector<std::pair<std::string, std::string>> implied_options;
};

struct Lattice : LatticeNumbers {
  std::string source;  ///< file or generator, for messages
  /// Whether it comes from an HDF5 file, by the name of that.
  bool has_datasets() const { return ends_with(source, ".h5") || ends_with(source, ".hdf5"); }
  std::int64_t springs_generated = 0, springs_removed = 0;  ///< by a generator that dilutes: those before, and those of them that went
  Rows particles;
  // springs; ends are rows of the whole lattice, 0-based
  Rows springs;
  std::vector<std::int64_t> pairs;        ///< (count, 2)
  bool law_by_row = false;                ///< spring_laws holds a law for each spring; the same on every rank
  std::vector<std::uint8_t> spring_laws;  ///< (count) places in the registry, or empty: all obey spring_law
  Column area;                            ///< (count) cross-sections, for stresses [m^2]; of no name where the lattice has none
  bool has_area() const { return !area.name.empty(); }
  // springs to fixed points (or to points that move as given)
  Rows anchors;
  std::vector<std::int64_t> anchor_particle;                                 ///< (count)
  std::vector<double> anchor_point;                                          ///< (count, d)
  std::vector<double> anchor_stiffness, anchor_rest_length, anchor_damping;  ///< (count)
  // interactions of several particles, by kind (physics/interactions/registry.hpp); kinds left out have no rows
  std::vector<InteractionRows> interactions;
  // how the springs are to be understood
  SpringLaw spring_law = SpringLaw::hooke;  ///< of springs without a law of their own, and of anchors
  DampingLaw damping_law = DampingLaw::axial;
  bool spring_law_given = false, damping_law_given = false;  ///< said by the file, not assumed
  std::vector<std::string> warnings;                         ///< one line each, reported once
};

// Numbers of a lattice that may be given anew while systems made of it live.

/// Squares of what is given are summed: they must not overflow. False for what is no number.
inline bool usable(double value) { return std::abs(value) <= 1e150; }

struct InteractionSchema;

/// Where the numbers of one name lie in a lattice: a column of a table.
struct NumberColumn {
  std::vector<double>* table = nullptr;
  std::size_t first = 0, width = 1;  ///< its place among the columns of the table, and how many these are
  int kind = -1;                     ///< of interactions; -1: of springs or particles
  explicit operator bool() const { return table != nullptr; }
  std::size_t size() const { return table->size() / width; }
  double& operator[](std::size_t row) const { return (*table)[row * width + first]; }
  std::vector<double> values() const;
  void assign(const std::vector<double>& values) const;
};

/// The numbers of that name: stiffness, rest_length, damping, or what the springs' laws take beyond these, of every spring; mass, of every particle;
/// angle_stiffness, angle_rest_angle, hinge_stiffness and their like, of every interaction of that group. False: there are none, or they cannot be
/// changed.
NumberColumn changeable_numbers(Lattice* lattice, const std::string& name);
/// The names of what interactions take, of all kinds that this lattice has.
std::vector<std::string> interaction_numbers(const Lattice& lattice);
/// The name of a number that interactions of a kind take: that of their group and its own.
std::string number_name(const InteractionSchema& schema, std::size_t place);
/// Back: the kind that takes a number of that name (-1: none does), and its place among what the kind takes.
struct InteractionNumber {
  int kind = -1;
  std::size_t place = 0;
};
InteractionNumber interaction_number(const std::string& name);

/// Gives them anew; `all`: of the whole lattice, which `lattice` holds. False, and why, where they are no numbers of that lattice, are out of their
/// range, or would make another system of it: springs of rest length 0 or without damper stay such, others may lose their damper.
bool change_numbers(Lattice* lattice, const std::string& name, const std::vector<double>& all, std::string* why);

}  // namespace bs
