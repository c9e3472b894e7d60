// How the stress of a relaxed periodic lattice changes with the free components of its box.
#pragma once
#include <vector>
#include "tasks/strain_relaxation.hpp"

namespace bs {

/// L = dF F^-1 of a unit change of F's component (row, column), (d, d) row by row.
void flow_of(const FreeStrain& one, const double* gradient, int d, double* L);

/// Whether energy is needed for every small change of the free strains under their stresses (stable), for none (neutral), or set free by one.
enum class BoxState { stable, neutral, unstable };

/// With the stress sigma and the relaxed stiffness C, a change dF of the box, L = dF F^-1 = e + w (symmetric and antisymmetric), gives
///   d sigma = C:e + (sigma e + e sigma)/2 - tr(e) sigma + w sigma - sigma w
/// matrix: (n, n) row by row, d sigma of the component of free strain a per change of free strain b. The state is by the signs of L_a:d sigma_b.
BoxState box_tangent(const StrainRelaxation& relaxed, const std::vector<FreeStrain>& free, int d, std::vector<double>* matrix);

/// The strains of StrainResponse that `free` have a part in, at the gradient of the box.
std::vector<bool> strains_of(const std::vector<FreeStrain>& free, const double* gradient, int d);

/// x solves A x = b; false where A is singular.
bool solve_small(const std::vector<double>& A, std::vector<double> b, std::vector<double>* x);

}  // namespace bs
