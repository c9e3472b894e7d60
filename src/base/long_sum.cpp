#include "base/long_sum.hpp"
#include <algorithm>

namespace bs {

PetscErrorCode sum_over_ranks(MPI_Comm comm, double* values, std::size_t count, std::size_t piece) {
  PetscFunctionBegin;
  for (std::size_t at = 0; at < count; at += piece) {
    const PetscMPIInt some = static_cast<PetscMPIInt>(std::min(piece, count - at));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, values + at, some, MPI_DOUBLE, MPI_SUM, comm));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
