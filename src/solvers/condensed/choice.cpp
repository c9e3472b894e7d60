#include "solvers/condensed/choice.hpp"
#include <algorithm>
#include "base/fault.hpp"

namespace bs {
namespace {

/// Unknowns of S up to which a direct method is thought of, and the same where S has blocks that no pair makes: stiff bending takes
/// incomplete factors of pairs thousands of iterations.
constexpr PetscInt UNKNOWNS = 6000, UNKNOWNS_BENT = 20000;

/// Floating-point operations of a factorisation, for each unknown, up to which S is solved directly. Measured against conjugate gradients with
/// bicc, h omega_max 5 to 25, user time of 5 to 30 steps: chain of 2,000 (80) 0.17 and 0.21 s, net of 50 x 50 (3.6e3) 0.4 and 0.24 s, cloth of 24 x
/// 24 (1.1e4) 2.0 and 0.8 s, plate of 2 x 30 x 30 (1.7e4) 0.9 and 0.19 s, cube of 7^3 (1.9e4) 0.19 and 0.09 s, of 10^3 (9.3e4) 0.56 and 0.14 s. Where
/// stiffnesses differ much or springs push, the time of the iterations grows and that of the factors does not.
constexpr double FLOPS = 5e3, FLOPS_BENT = 2e5;

/// The same of a whole factorisation: milliseconds.
constexpr double FEW = 3e6;

}  // namespace

std::string DirectChoice::words() const { return flops < 0 ? "" : format("Cholesky factors: %.3g Mflop predicted", flops / 1e6); }

PetscErrorCode choose_direct(Tangent& tangent, DirectChoice* choice) {
  const bool pairs = tangent.pairwise();
  const double unknowns = static_cast<double>(tangent.unknowns());
  PetscFunctionBegin;
  *choice = {};
  if (tangent.unknowns() > (pairs ? UNKNOWNS : UNKNOWNS_BENT)) PetscFunctionReturn(0);
  PetscCall(tangent.factor_flops(&choice->flops));
  choice->direct = !tangent.has_inertia() || choice->flops <= std::max(FEW, (pairs ? FLOPS : FLOPS_BENT) * unknowns);
  PetscFunctionReturn(0);
}

}  // namespace bs
