#include <cmath>
#include "base/error.hpp"
#include "base/text.hpp"
#include "input/matrix_load.hpp"
#include "input/text_file.hpp"
#include "systems/linear/system.hpp"

namespace bs {

void SystemOptions::read(Section& o, bool help) {
  o.file("-bs_linear_G", "matrix G of G x + C x' = B u(t): Matrix Market text or PETSc binary (.bin, .petsc, .dat)", G);
  o.file("-bs_linear_C", "matrix C, which may be singular", C);
  o.file("-bs_linear_B", "matrix B, with one column for every source", B);
  o.choice("-bs_linear_type", "origin of the matrices: files, or a built-in system", {"files", "rc_ladder", "rlc", "heat1d", "heat2d"}, type);
  o.integers("-bs_linear_size", "rc_ladder, heat1d: number of states; heat2d: cells along x,y", size);
  resistance_given = o.real("-bs_linear_resistance", "resistance; rc_ladder: of the first resistor, default 100; rlc: default 20 [ohm]", resistance,
                            Range::positive);
  capacitance_given =
      o.real("-bs_linear_capacitance", "capacitance; rc_ladder: mean value, default 1e-8; rlc: default 1e-6 [F]", capacitance, Range::positive);
  o.real("-bs_linear_inductance", "rlc: inductance [H]", inductance, Range::positive);
  o.real("-bs_linear_vary", "rc_ladder: relative variation vary, below 1, of R_i = R (1 + vary sin 1.7 i) and C_i = C (1 + vary cos 0.9 i)", vary,
         Range::nonnegative);
  o.real("-bs_linear_conductivity", "heat1d, heat2d: kappa of T' = kappa Laplace T on the unit interval or square [1/s]", conductivity,
         Range::positive);
  o.file("-bs_linear_x0", "initial state: Matrix Market, PETSc binary, or CSV (on each line a number, or name,value); default 0", x0);
  o.file("-bs_linear_labels", "text file with a name for every state, one per line", labels);
  if (help && type == 0 && (G.empty() || C.empty())) type = 2;
  if (vary >= 1) o.fail("option -bs_linear_vary: give a number below 1, or some resistance is not positive");
  if (type > 0 && !(G + C + B).empty()) o.fail("option -bs_linear_type: a built-in system takes no -bs_linear_G, -bs_linear_C, -bs_linear_B");
  if (type == 0 && (G.empty() || C.empty()))
    o.fail(std::string("option ") + (G.empty() ? "-bs_linear_G" : "-bs_linear_C") +
           " is missing: name a matrix file, or choose -bs_linear_type rc_ladder");
}

namespace {

std::string size_text(const std::string& what, PetscInt rows, PetscInt columns) {
  return format("%s is %lld x %lld", what.c_str(), static_cast<long long>(rows), static_cast<long long>(columns));
}

PetscErrorCode load_files(MPI_Comm comm, const SystemOptions& o, LinearSystem* out) {
  PetscInt n, m, rows, columns;
  PetscFunctionBegin;
  PetscCall(load_matrix(comm, o.G, "-bs_linear_G", out->G.out()));
  PetscCall(MatGetSize(out->G, &n, &m));
  if (n != m) PetscCall(fail(comm, Exit::input, o.G + ": " + size_text("G", n, m) + ": it must be square"));
  PetscCall(load_matrix(comm, o.C, "-bs_linear_C", out->C.out()));
  PetscCall(MatGetSize(out->C, &rows, &columns));
  if (rows != n || columns != n)
    PetscCall(fail(comm, Exit::input, o.C + ": " + size_text("C", rows, columns) + ", " + size_text("G", n, n) + ": they must have one size"));
  if (!o.B.empty()) {
    PetscCall(load_matrix(comm, o.B, "-bs_linear_B", out->B.out()));
    PetscCall(MatGetSize(out->B, &rows, &columns));
    if (rows != n)
      PetscCall(fail(comm, Exit::input, o.B + ": " + size_text("B", rows, columns) + ", " + size_text("G", n, n) + ": B must have as many rows"));
  }
  out->origin = o.G + ", " + o.C + (o.B.empty() ? "" : ", " + o.B);
  PetscFunctionReturn(0);
}

PetscErrorCode read_labels(MPI_Comm comm, const std::string& path, PetscInt n, std::vector<std::string>* names) {
  std::string text;
  PetscFunctionBegin;
  PetscCall(read_text_file(comm, path, &text));
  names->clear();
  for (const std::string& line : split(text, '\n')) names->push_back(line);
  while (!names->empty() && names->back().empty()) names->pop_back();
  if (static_cast<PetscInt>(names->size()) != n)
    PetscCall(fail(comm, Exit::input,
                   format("option -bs_linear_labels: %s has %zu lines for %lld states: write one a state", path.c_str(), names->size(),
                          static_cast<long long>(n))));
  PetscFunctionReturn(0);
}

/// A state that occurs in no equation, or an equation without a state: the pencil is singular whatever the step.
PetscErrorCode check_rows(MPI_Comm comm, const LinearSystem& s) {
  PetscInt first, last;
  PetscFunctionBegin;
  Error fault;
  PetscCall(MatGetOwnershipRange(s.G, &first, &last));
  for (PetscInt i = first; i < last && !fault; ++i) {
    double sum = 0;
    for (Mat A : {s.G.get(), s.C.get()}) {
      PetscInt count;
      const PetscScalar* values;
      PetscCall(MatGetRow(A, i, &count, nullptr, &values));
      for (PetscInt k = 0; k < count; ++k) sum += std::abs(values[k]);
      PetscCall(MatRestoreRow(A, i, &count, nullptr, &values));
    }
    if (sum == 0)
      fault.note(
          i,
          (s.origin.empty() ? "" : s.origin + ": ") +
              format(
                  "the pencil sC + G is singular: row %lld of both G and C is empty and determines nothing: remove this state or give it an equation",
                  static_cast<long long>(i) + 1));
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode load_system(MPI_Comm comm, const SystemOptions& o, LinearSystem* out) {
  PetscInt n, first, last;
  PetscFunctionBegin;
  if (o.type > 0) PetscCall(generate_system(comm, o, out));
  else PetscCall(load_files(comm, o, out));
  PetscCall(check_rows(comm, *out));
  PetscCall(MatCreateVecs(out->G, out->x0.out(), nullptr));
  PetscCall(VecZeroEntries(out->x0));
  PetscCall(VecGetSize(out->x0, &n));
  PetscCall(VecGetOwnershipRange(out->x0, &first, &last));
  std::vector<std::string> names;
  if (!o.x0.empty()) PetscCall(load_vector(comm, o.x0, "-bs_linear_x0", out->x0, &names));
  if (!o.labels.empty()) PetscCall(read_labels(comm, o.labels, n, &names));
  if (!names.empty()) out->labels.assign(names.begin() + first, names.begin() + last);
  PetscFunctionReturn(0);
}

}  // namespace bs
