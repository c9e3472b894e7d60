// Whether S is factored or solved with by iterations: by predicted work at the start, by measured work during a run.
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/condensed/inner_solver.hpp"

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

PetscErrorCode InnerSolver::choose_solver() {
  char type[64] = "", krylov[64] = KSPPREONLY;
  PetscBool method = PETSC_FALSE;
  DirectChoice choice;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, prefix_.c_str(), "-pc_type", type, sizeof type, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, prefix_.c_str(), "-ksp_type", krylov, sizeof krylov, &method));
  const std::string own = type;
  direct_ = own == PCLU || own == PCCHOLESKY;
  const bool open = own.empty() && std::string(krylov) == KSPPREONLY;
  open_ = open && !method && own_storage_ < 0;
  if (direct_ || open) PetscCall(choose_direct(*tangent_, &choice));
  flops_ = choice.flops;
  if (open) {
    direct_ = choice.direct || method;
    if (!method) why_ = choice.words();
  }
  const bool springs = own.empty() ? !direct_ : own == "bicc" || own == PCJACOBI || own == PCNONE;
  storage_ = springs ? CondensedStorage::springs : own == PCICC ? CondensedStorage::sbaij : CondensedStorage::aij;
  if (own_storage_ >= 0) storage_ = static_cast<CondensedStorage>(own_storage_);
  PetscFunctionReturn(0);
}

/// Nothing of the other kind of solver stays.
PetscErrorCode InnerSolver::change_solver(bool direct) {
  CondensedCounts counts;
  PetscFunctionBegin;
  PetscCall(add_counts(&counts));
  shifts_before_ = counts.shifts;
  if (direct) ++factored_;
  for (KSPHandle* solver : {&ksp_, &fallback_}) solver->reset();
  for (MatHandle* matrix : {&S_, &exact_, &positive_}) matrix->reset();
  absolute_ = AbsoluteSolve();
  correction_ = ExactCorrection();
  direct_ = measured_ = direct;
  storage_ = direct ? CondensedStorage::aij : CondensedStorage::springs;
  why_ = direct ? "iterations took more work than Cholesky factors" : "";
  PetscCall(create_solver());
  renew_factors();
  built_ = false;
  PetscFunctionReturn(0);
}

// Stiffnesses that differ much, or springs that nearly leave a mechanism, take conjugate gradients hundreds of iterations, and factors the work
// that they always take. Both works are counted, not timed, so that a run does the same whenever it is repeated. Only a preconditioner made for
// this S is judged, or one whose iterations ran out. In the time of one operation of iterations factors do seven, in dense blocks, and they take
// that of 5e4 more for each unknown (a cube of 16^3: 0.36 s and 0.50 ms an iteration, 4.7 Gflop predicted and 2.7 Mflop; of 24^3: 2.9 s and 4 ms, 61
// Gflop and 9.8 Mflop). Iterations take the less time the more ranks share them; factors took 0.39 s on two ranks, so that theirs counts in full.
PetscErrorCode InnerSolver::compare_with_factors(PetscInt iterations) {
  constexpr PetscInt MANY = 200, UNKNOWNS = 1000000;
  constexpr double DENSE = 7, UNKNOWN = 5e4;
  double work = work_;
  PetscFunctionBegin;
  if (!open_ || direct_ || factors_wanted_ || iterations < MANY || tangent_->unknowns() > UNKNOWNS) PetscFunctionReturn(0);
  PetscCall(max_over_ranks(tangent_->comm(), &work));
  if (flops_ < 0) PetscCall(tangent_->factor_flops(&flops_));
  PetscCall(PetscInfo(ksp_.get(), "%" PetscInt_FMT " iterations took %.3g Mflop; Cholesky factors: %.3g Mflop predicted\n", iterations, work / 1e6,
                      flops_ / 1e6));
  if (flops_ / DENSE + UNKNOWN * static_cast<double>(tangent_->unknowns()) > work) PetscFunctionReturn(0);
  factors_wanted_ = true;
  PetscFunctionReturn(0);
}

}  // namespace bs
