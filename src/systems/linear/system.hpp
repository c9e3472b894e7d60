// The matrices of G x + C x' = B u(t), from files or a generator, its sources, and direct solvers for it.
#pragma once
#include <petscksp.h>
#include <petscmat.h>
#include <petscsys.h>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "base/options.hpp"
#include "lattice/csv_table.hpp"
#include "systems/linear/waveform.hpp"

namespace bs {

/// A circuit at the start, where capacitors keep their voltages and inductors their currents: G z = B u + b; z begins with the states.
struct StartSystem {
  /// What is to hold of z, but has no equation: z_a - z_b = value, -1 is ground; `fault`: why it does not.
  struct Check {
    PetscInt a, b;
    double value;
    std::string fault;
  };
  MatHandle G, B;  ///< G is null where there is none; B is null without sources
  VecHandle b;
  std::vector<Check> checks;
};

struct LinearSystem {
  MatHandle G, C, B;  ///< MATAIJ, n x n, n x n, n x k; B is null without sources
  VecHandle x0;
  std::vector<std::string> labels, units;                ///< of this rank's states; empty on every rank if there are none
  std::vector<std::string> source_labels, source_units;  ///< of this rank's columns of B, likewise
  std::string origin;                                    ///< for the header
  std::string source;                                    ///< u(t) where the user gives none; empty: must be given
  StartSystem start;
};

struct SystemOptions {
  std::string G, C, B, x0, labels, netlist;
  int type = 0;  ///< 0: files
  std::vector<std::int64_t> size;
  double resistance = 100, capacitance = 1e-8, inductance = 1e-3, vary = 0, conductivity = 1;
  bool resistance_given = false, capacitance_given = false;
  /// With `help`, a missing system is replaced by a small one: the options are only to be listed.
  void read(Section& section, bool help);
};

/// Local. Calls f(column, value) for the nonzeros of row i of this rank.
template <class F>
PetscErrorCode each_nonzero(Mat A, PetscInt i, F&& f) {
  PetscInt n;
  const PetscInt* columns;
  const PetscScalar* values;
  PetscFunctionBegin;
  PetscCall(MatGetRow(A, i, &n, &columns, &values));
  for (PetscInt k = 0; k < n; ++k)
    if (values[k] != 0) f(columns[k], values[k]);
  PetscCall(MatRestoreRow(A, i, &n, &columns, &values));
  PetscFunctionReturn(0);
}

/// Collective. Builds or reads the system; wrong sizes, and rows that are empty in both G and C, end the run with exit code 2.
PetscErrorCode load_system(MPI_Comm comm, const SystemOptions& options, LinearSystem* out);

/// Collective. G, C, B, labels, units and sources of a netlist of SPICE. Unknowns: the voltages of the nodes, then the currents of the V and L cards.
PetscErrorCode load_netlist(MPI_Comm comm, const std::string& path, LinearSystem* out);

/// Collective. G, C, B, labels of a built-in system.
PetscErrorCode generate_system(MPI_Comm comm, const SystemOptions& options, LinearSystem* out);

/// The index of a descriptor system: whether its algebraic equations determine their unknowns.
struct PencilIndex {
  bool higher = false;         ///< it is 2 or more
  std::vector<PetscInt> rows;  ///< (up to 3, ascending, from 0) rows with most part in what is missing; empty for large systems
};

/// A null vector by its entries, the largest 1.
struct SparseVector {
  std::vector<PetscInt> at;
  std::vector<double> value;
};

/// Bases W, N of the left and right null space of C: W'(G x - B u) = 0 are the algebraic equations of G x + C x' = B u.
struct NullSpaces {
  bool known = false;  ///< not where they are too expensive: beyond 100,000 states, or where C couples more than 300 rows with each other
  std::vector<SparseVector> left, right;
};

/// Collective; the same on every rank.
PetscErrorCode find_null_spaces(Mat C, NullSpaces* out);

/// Collective; the same on every rank. The index is 0 or 1 just where W'G N is regular; `higher` stays false where they are not known.
PetscErrorCode find_index(Mat G, const NullSpaces& of_C, PencilIndex* out);

// u(t) of a linear system: waveforms or a table, one column of B each.

class Sources {
 public:
  void options(Section& section);
  /// Collective. Reads what the options name, for `columns` columns of B; `preset` where no option was given (may be
  /// empty: then a source must be given if B has columns). Ends the run with exit code 2 if the numbers do not match.
  PetscErrorCode read(MPI_Comm comm, std::int64_t columns, const std::string& preset);
  std::size_t count() const { return waves_.empty() ? columns_ : waves_.size(); }
  /// u_k(t). A table holds its first and last value outside its times (covers() refuses such runs).
  double at(std::size_t column, double t) const;
  /// The limit of u_k from the left: another value than at() where it jumps.
  double before(std::size_t column, double t) const;
  /// The next time after t at which one of them jumps or bends.
  Knot next_knot(double t) const;
  /// Whether a source is written as a netlist of SPICE has it.
  bool as_spice(std::size_t column) const { return !waves_.empty() && waves_[column].as_spice(); }
  bool constant() const;
  /// Empty if the table reaches from `start` to `end`, or one line of error.
  std::string covers(double start, double end) const;
  std::string describe() const;

 private:
  std::size_t row_at(double t) const;

  std::string text_, file_;
  int hold_ = 0;
  std::vector<Waveform> waves_;
  CsvTable table_;
  std::size_t columns_ = 0;
};

// Direct solvers: one with pivoting, and a test for singular matrices.

/// Collective. `ksp` solves with `A` by one sparse LU with pivoting (MUMPS), options with `prefix`; set up on return.
PetscErrorCode create_direct(MPI_Comm comm, Mat A, const char* prefix, KSP* ksp);

/// Collective. Whether the direct solver of `ksp`, which is set up, has failed, or returns a known solution with not one
/// right digit in units in which A's columns have size 1: then A is singular to working precision. False for others.
PetscErrorCode is_singular(KSP ksp, bool* singular);

/// Collective. What a solver that takes its preconditioner for the inverse (preonly, none direct) leaves of a right side; 0 for others,
/// whose own test of convergence judges them.
PetscErrorCode trial_residual(KSP ksp, double* left);

/// Collective. The same as one line of error, empty if it solves. `prefix` of its options.
PetscErrorCode refusal_of(KSP ksp, const char* prefix, std::string* text);

}  // namespace bs
