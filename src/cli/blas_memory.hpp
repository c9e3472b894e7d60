// The work space of BLAS.
#pragma once
#include <petscsys.h>

namespace bs {

/// Local. The work space of BLAS is taken before anything else can use the memory up. OpenBLAS maps a work space (128 MB of addresses in Debian's
/// build) at its first large call, keeps it, and asks for it again and again without end where there is no memory. So the first call is made here,
/// watched by a clock of processor time: where it does not come back, the program ends with one line and Exit::input. Call after
/// install_crash_handler() and before anything large.
PetscErrorCode reserve_blas_memory();

}  // namespace bs
