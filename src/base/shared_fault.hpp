// A fault that ends no run yet.
#pragma once
#include <string>

#include "base/fault.hpp"

namespace bs {

/// Collective. The text of the fault with the smallest `where` (then rank) on every rank; empty if no rank has one. Nothing is reported.
PetscErrorCode shared_fault(MPI_Comm comm, const Fault& fault, std::string* text);

}  // namespace bs
