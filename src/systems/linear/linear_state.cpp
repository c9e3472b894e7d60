// The state of a linear system in the input's order, which is its own, and what tells the system from others.
#include "base/row_sum.hpp"
#include "systems/linear/linear_model.hpp"

namespace bs {

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
