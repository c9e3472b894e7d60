// Motions of a periodic lattice that meet no resistance.
#pragma once
#include <petscsys.h>
#include "systems/mechanics.hpp"

namespace bs {

/// Collective. The eigenvalues omega^2 of -K q = omega^2 M q at the state that `lin` is linearised at with |omega^2| < delta, less the d
/// translations, by Sylvester's law of inertia: the negative pivots of -K - delta M less those of -K + delta M. delta is 1e-9 of the mean omega^2. K
/// must be symmetric. -1: MUMPS, which factors both, is not there or failed.
PetscErrorCode count_zero_modes(Linearisation& lin, PetscInt* count);

}  // namespace bs
