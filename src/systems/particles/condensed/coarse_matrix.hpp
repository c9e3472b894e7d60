// E = Z^T S Z of rigid motions, spring by spring.
#pragma once
#include "systems/particles/condensed/group_motions.hpp"
#include "systems/particles/condensed/spring_matrix.hpp"

namespace bs {

/// Collective. E as an AIJ matrix whose rows are laid out as the ranks' groups. Unknowns that move nothing have 1 on the diagonal. The
/// rows of Z that belong to held components of rollers are zero.
PetscErrorCode create_coarse_matrix(SpringMatrix& S, const GroupMotions& motions, Mat* E);

}  // namespace bs
