// What a linear system shows: header lines, observables, fields of a frame, labels.
#include <algorithm>
#include "base/error.hpp"
#include "base/row_sum.hpp"
#include "systems/linear/linear_model.hpp"

namespace bs {

std::vector<std::string> LinearModel::describe() const {
  PetscInt n = 0;
  MatInfo G = {}, C = {};
  (void)MatGetSize(system_.G, &n, nullptr);
  (void)MatGetInfo(system_.G, MAT_GLOBAL_SUM, &G);
  (void)MatGetInfo(system_.C, MAT_GLOBAL_SUM, &C);
  std::vector<std::string> lines;
  lines.push_back(format("linear system G x + C x' = B u: %lld states, %.0f nonzeros in G, %.0f in C, from %s", static_cast<long long>(n), G.nz_used,
                         C.nz_used, system_.origin.c_str()));
  lines.push_back(std::string("C: ") +
                  (diagonal_    ? "diagonal"
                   : symmetric_ ? "symmetric"
                                : "not symmetric") +
                  (zero_rows_ > 0 ? format(", %lld empty rows (algebraic equations)", static_cast<long long>(zero_rows_)) : std::string()));
  lines.push_back("sources: " + sources_.describe());
  if (dc_) lines.push_back("initial state: operating point G x = B u");
  if (startup_steps_ > 0) lines.push_back(format("first %lld steps by backward Euler", static_cast<long long>(startup_steps_)));
  return lines;
}

std::vector<Tally> LinearModel::tallies() const {
  if (fillings_ > 0)
    return {{"matrix_setups",
             fillings_ == 1 ? "set-up of the step's matrix (factored as often, where it is)"
                            : "set-ups of the step's matrix (factored as often, where it is)",
             fillings_}};
  return {{"matrix_setups", diagonal_ ? "factorisations: C is diagonal" : "factorisation of C", diagonal_ ? 0 : 1}};
}

// 1/2 x'C x, the energy held in capacitors and inductors, where C is symmetric
PetscErrorCode LinearModel::observe(double, Vec y, std::vector<Observable>* out) {
  PetscScalar energy;
  PetscFunctionBegin;
  out->clear();
  if (!symmetric_) PetscFunctionReturn(0);
  PetscCall(MatMult(system_.C, y, work_));
  PetscCall(VecDot(work_, y, &energy));
  out->push_back({"energy", {0.5 * energy}});
  PetscFunctionReturn(0);
}

// E = x.C x/2 with C symmetric has dE/dt = x.(B u - G x): what the sources and active elements supply. Types that are stable at any step do not make
// energy.
PetscErrorCode LinearModel::energy_supply(double t, Vec y, EnergySupply* out, bool* has) {
  PetscScalar inner = 0, power = 0;
  VecHandle change;
  PetscFunctionBegin;
  *has = may_grow_ && symmetric_;
  if (!*has) PetscFunctionReturn(0);
  PetscCall(VecDuplicate(y, change.out()));
  PetscCall(MatMult(system_.C, y, change));
  PetscCall(VecDot(change, y, &inner));
  PetscCall(MatMult(system_.G, y, change));
  PetscCall(VecScale(change, -1));
  PetscCall(add_sources(t, 1, change));
  PetscCall(VecDot(change, y, &power));
  out->inner = 0.5 * inner;
  out->power = std::max(0.0, power);
  *has = !(inner < 0);
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::fields(double t, Vec y, std::vector<Field>* out) {
  PetscFunctionBegin;
  *out = {{"/states", y, true}};
  if (system_.B) {
    PetscCall(set_sources(t));
    out->push_back({"/sources", u_, true});
  }
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::take_constants(std::vector<Dataset>* out) {
  PetscInt n, first;
  unsigned long long width = 0;
  PetscFunctionBegin;
  out->clear();
  for (const std::string& label : system_.labels) width = std::max<unsigned long long>(width, label.size());
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &width, 1, MPI_UNSIGNED_LONG_LONG, MPI_MAX, comm_));
  if (width == 0) PetscFunctionReturn(0);
  PetscCall(VecGetSize(system_.x0, &n));
  PetscCall(VecGetOwnershipRange(system_.x0, &first, nullptr));
  Words words;
  words.width = static_cast<std::size_t>(width);
  for (std::string label : system_.labels) {
    label.resize(words.width, '\0');
    words.text += label;
  }
  out->push_back({"/states/labels", first, n, 0, std::move(words)});
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::gather_state(Vec y, std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  PetscCall(VecCopy(y, work_));
  *parts = {{"states", work_}};
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::scatter_state(Vec y) {
  PetscFunctionBegin;
  PetscCall(VecCopy(work_, y));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::fingerprint(std::uint64_t* value) {
  RowSum sum;
  PetscFunctionBegin;
  std::uint64_t table = 0;
  for (Mat matrix : {system_.G.get(), system_.C.get(), system_.B.get()}) {
    table += 2;
    if (!matrix) continue;
    PetscInt first, last;
    PetscCall(MatGetOwnershipRange(matrix, &first, &last));
    for (PetscInt i = first; i < last; ++i) {
      PetscInt n;
      const PetscInt* columns;
      const PetscScalar* values;
      PetscCall(MatGetRow(matrix, i, &n, &columns, &values));
      sum.add(table, i, 1, static_cast<int>(n), columns);
      sum.add(table + 1, i, 1, static_cast<int>(n), values);
      PetscCall(MatRestoreRow(matrix, i, &n, &columns, &values));
    }
  }
  *value = sum.value();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 1, MPI_UINT64_T, MPI_SUM, comm_));
  PetscFunctionReturn(0);
}

}  // namespace bs
