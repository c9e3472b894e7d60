// Motions of a periodic lattice that meet no resistance.
#pragma once
#include <petscsys.h>
#include "systems/mechanics.hpp"

namespace bs {

/// Collective. Independent motions q with |q.K q| < delta q.s q at the state that `lin` is linearised at, less the d translations, by Sylvester's
/// law of inertia: the negative pivots of -K - delta diag(s) less those of -K + delta diag(s). delta is 1e-9, s the stiffness of all springs at
/// each particle, so that neither masses nor springs that are stiff elsewhere count. K must be symmetric. -1: MUMPS, which factors both, is not there
/// or failed.
PetscErrorCode count_zero_modes(Linearisation& lin, PetscInt* count);

}  // namespace bs
