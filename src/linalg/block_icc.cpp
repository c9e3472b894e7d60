#include "linalg/block_icc.hpp"
#include <petsc/private/pcimpl.h>  // of types of PC
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "base/memory.hpp"
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"
#include "linalg/coarse_choice.hpp"
#include "linalg/coarse_space.hpp"

namespace bs {
namespace {

constexpr char TYPE[] = "bicc";

struct BlockIcc {
  std::unique_ptr<BlockFactor> factor;
  PetscInt precision = 0;  ///< 0 auto, 1 single, 2 double
  bool in_single = true;
  PetscReal fill = 16;     ///< most fill-in of stiff pairs, in multiples of the blocks of the matrix
  PetscReal shift = 1e-3;  ///< shift of the diagonal that is tried first where a pivot fails
  PetscReal shifted = 0;   ///< shift of the diagonal in force
  PetscInt shifts = 0;
  PairMatrix* matrix = nullptr;
  const PairMatrix* laid_out_for = nullptr;  ///< the matrix whose pattern the factors have
  PetscInt coarse_unknowns = -1;             ///< largest number of them; -1: chosen by the size of the system
  PetscInt space = 2, chosen_space = 2;      ///< 0 hats, 1 rigid, 2 auto: not chosen yet
  CoarseSpace coarse;
  KeptParts kept = KeptParts::choices;  ///< what the next set-up keeps of the last one
  VecHandle residual, step;             ///< work vectors, used with rigid motions
};

/// Collective. Replaces auto by what suits the system.
PetscErrorCode choose_space(BlockIcc* self, const PairMatrix& S) {
  bool rigid = false;
  PetscFunctionBegin;
  if (self->chosen_space != 2) PetscFunctionReturn(0);
  if (self->space == 2) PetscCall(prefers_rigid_motions(S, &rigid));
  self->chosen_space = self->space == 2 ? rigid : self->space;
  PetscFunctionReturn(0);
}

/// Collective. Checks the memory for the factors, whose pattern is known.
PetscErrorCode reserve_factor(PC pc, const PairMatrix& S, bool single) {
  PetscFunctionBegin;
  const double area = S.dim() * S.dim(), real = single ? sizeof(float) : sizeof(double);
  const double blocks = static_cast<const BlockIcc*>(pc->data)->factor->blocks();
  PetscCall(reserve_memory(PetscObjectComm(reinterpret_cast<PetscObject>(pc)), {"the incomplete Cholesky factorisation (-condensed_pc_type bicc)",
                                                                                blocks * area * real, "give -condensed_pc_type jacobi"}));
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_coarse(PC pc) {
  BlockIcc* self = static_cast<BlockIcc*>(pc->data);
  PetscFunctionBegin;
  if (self->kept == KeptParts::coarse_space && self->coarse.active()) PetscFunctionReturn(0);
  PetscCall(self->coarse.create(*self->matrix, self->chosen_space == 1, self->coarse_unknowns));
  PetscFunctionReturn(0);
}

PetscErrorCode set_up(PC pc) {
  BlockIcc* self = static_cast<BlockIcc*>(pc->data);
  PetscFunctionBegin;
  self->matrix = PairMatrix::from(pc->pmat);
  PetscCheck(self->matrix, PetscObjectComm(reinterpret_cast<PetscObject>(pc)), PETSC_ERR_SUP,
             "-pc_type bicc factors matrices of springs only (-condensed_mat_type springs)");
  const LoggedTime logged(LogEvent::factor, pc);
  if (self->kept == KeptParts::none) {
    self->factor.reset();
    self->in_single = true;
    self->chosen_space = 2;
  }
  std::vector<double> diagonal;
  self->matrix->diagonal_blocks(&diagonal);
  constexpr double RATIO = 1e5;  // of stiffnesses, above which single precision would lose the soft pairs
  double ratio = 1;
  PetscCall(self->matrix->size_ratio(diagonal, &ratio));
  const bool single = self->precision == 1 || (self->precision == 0 && self->in_single && ratio <= RATIO);
  if (!self->factor || single != self->in_single || self->laid_out_for != self->matrix) {
    self->factor = create_block_factor(self->matrix->dim(), single);
    PetscCall(choose_space(self, *self->matrix));
    PetscCall(self->factor->lay_out(*self->matrix, self->fill, self->chosen_space == 1 && self->coarse_unknowns != 0));
    if (!self->laid_out_for) PetscCall(reserve_factor(pc, *self->matrix, single));
    self->laid_out_for = self->matrix;
  }
  self->in_single = single;
  PetscCall(self->factor->overlap().update(*self->matrix, &diagonal));
  constexpr int TRIES = 12;
  bool done = false;
  for (int k = 0; k < TRIES && !done; ++k) {
    self->shifted = k == 0 ? 0 : k == 1 ? self->shift : 4 * self->shifted;
    done = self->factor->factor(*self->matrix, diagonal, self->shifted);
    if (!done) ++self->shifts;
    PetscCall(PetscLogFlops(self->factor->flops()));
  }
  PetscCall(set_up_coarse(pc));
  pc->failedreason = done ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT;
  PetscFunctionReturn(0);
}

/// z = M^-1 r with the factors of this rank's part.
PetscErrorCode solve_triangles(PC pc, Vec r, Vec z) {
  BlockIcc* self = static_cast<BlockIcc*>(pc->data);
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::triangles, pc);
  Overlap& overlap = self->factor->overlap();
  if (overlap.active()) {
    PetscCall(overlap.apply(*self->matrix, r, z, [self](const double* in, double* out) { self->factor->solve(in, out); }));
  } else {
    const ReadArray ar(r);
    const WriteArray az(z);
    self->factor->solve(ar, az);
  }
  PetscCall(PetscLogFlops(4.0 * self->matrix->dim() * self->matrix->dim() * self->factor->blocks()));
  PetscFunctionReturn(0);
}

// With the factors M and Q = Z E^-1 Z^T
//   hats   z = (M^-1 + Q) r
//   rigid  z = Q r + (I - Q S) M^-1 (I - S Q) r, positive definite however old Q is
PetscErrorCode apply(PC pc, Vec r, Vec z) {
  BlockIcc* self = static_cast<BlockIcc*>(pc->data);
  PetscFunctionBegin;
  if (!self->coarse.active() || !self->coarse.rigid()) {
    PetscCall(solve_triangles(pc, r, z));
    PetscCall(self->coarse.add(r, z));
    PetscFunctionReturn(0);
  }
  for (VecHandle* v : {&self->residual, &self->step})
    if (!*v) PetscCall(VecDuplicate(r, v->out()));
  PetscCall(VecZeroEntries(z));
  PetscCall(self->coarse.add(r, z));
  PetscCall(self->matrix->multiply(z, self->residual));
  PetscCall(VecAYPX(self->residual, -1.0, r));
  PetscCall(solve_triangles(pc, self->residual, self->step));
  PetscCall(VecAXPY(z, 1.0, self->step));
  PetscCall(self->matrix->multiply(self->step, self->residual));
  PetscCall(VecScale(self->residual, -1.0));
  PetscCall(self->coarse.add(self->residual, z));
  PetscFunctionReturn(0);
}

PetscErrorCode set_from_options(PC pc, OptionItems PetscOptionsObject) {
  BlockIcc* self = static_cast<BlockIcc*>(pc->data);
  const char *const names[] = {"auto", "single", "double"}, *const spaces[] = {"hats", "rigid", "auto"};
  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "Block incomplete Cholesky of a spring matrix");
  PetscCall(PetscOptionsEList("-pc_bicc_precision", "precision in which the factors are stored; auto: single unless stiffnesses differ by 1e5", "",
                              names, 3, names[self->precision], &self->precision, nullptr));
  PetscCall(PetscOptionsReal("-pc_bicc_shift", "fraction of the diagonal that is added when a pivot fails, multiplied by four at every repetition",
                             "", self->shift, &self->shift, nullptr));
  PetscCall(PetscOptionsReal("-pc_bicc_fill",
                             "blocks that eliminating stiff pairs (10 times the mean and more, where some are 100 times it) may add to the factors, "
                             "times those of the matrix; "
                             "where there would be more none are added; 0: none [1]",
                             "", self->fill, &self->fill, nullptr));
  PetscCall(
      PetscOptionsInt("-pc_bicc_coarse",
                      "largest number of unknowns of the coarse grid, which corrects motions over many springs; 0: no coarse grid, -1: one for 60 "
                      "of the fine grid, for 12 where there are angle springs or hinges; hats at most 6000, or in bodies that fill their box 2200 or "
                      "(0.3 particles a rank)^0.75, rigid at most 20000",
                      "", self->coarse_unknowns, &self->coarse_unknowns, nullptr));
  PetscCall(PetscOptionsEList(
      "-pc_bicc_coarse_space",
      "functions of the coarse grid; hats: linear between its nodes, rigid: translations and rotations of groups of particles, "
      "auto: rigid where a body is at least 10 times as long as it is thick, stiffnesses differ by a factor of 100 at most and springs resist "
      "every uniform strain or nothing else acts",
      "", spaces, 3, spaces[self->space], &self->space, nullptr));
  PetscOptionsHeadEnd();
  PetscFunctionReturn(0);
}

PetscErrorCode view(PC pc, PetscViewer viewer) {
  const BlockIcc* self = static_cast<const BlockIcc*>(pc->data);
  PetscBool ascii = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(viewer), PETSCVIEWERASCII, &ascii));
  if (ascii)
    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "  block incomplete Cholesky, factors in %s precision, shift %g, %" PetscInt_FMT " shifts so far; "
                                     "coarse grid of %" PetscInt_FMT " unknowns (%s)\n",
                                     self->in_single ? "single" : "double", static_cast<double>(self->shifted), self->shifts,
                                     self->coarse.active() ? self->coarse.unknowns() : 0,
                                     self->chosen_space == 1 ? "rigid motions of groups" : "hats"));
  PetscFunctionReturn(0);
}

PetscErrorCode factor_shifts(PC pc, PetscInt* count) {
  PetscFunctionBegin;
  *count = static_cast<const BlockIcc*>(pc->data)->shifts;
  PetscFunctionReturn(0);
}

PetscErrorCode coarse_words(PC pc, const char** words) {
  BlockIcc* self = static_cast<BlockIcc*>(pc->data);
  const PairMatrix* S = pc->pmat ? PairMatrix::from(pc->pmat) : nullptr;
  PetscFunctionBegin;
  if (S) PetscCall(choose_space(self, *S));
  *words = self->chosen_space == 1 && self->coarse_unknowns != 0 ? "rigid motions of groups" : "";
  PetscFunctionReturn(0);
}

PetscErrorCode keep_parts(PC pc, KeptParts parts) {
  PetscFunctionBegin;
  static_cast<BlockIcc*>(pc->data)->kept = parts;
  PetscFunctionReturn(0);
}

PetscErrorCode destroy(PC pc) {
  PetscFunctionBegin;
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSKeepParts_C", nullptr));
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSCoarseDescription_C", nullptr));
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSFactorShifts_C", nullptr));
  delete static_cast<BlockIcc*>(pc->data);
  pc->data = nullptr;
  PetscFunctionReturn(0);
}

PetscErrorCode create(PC pc) {
  PetscFunctionBegin;
  pc->data = new BlockIcc;
  pc->ops->setup = set_up;
  pc->ops->apply = apply;
  pc->ops->applytranspose = apply;
  pc->ops->setfromoptions = set_from_options;
  pc->ops->view = view;
  pc->ops->destroy = destroy;
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSFactorShifts_C", factor_shifts));
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSCoarseDescription_C", coarse_words));
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSKeepParts_C", keep_parts));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_block_icc() {
  PetscFunctionBegin;
  PetscCall(PCRegister(TYPE, create));
  PetscFunctionReturn(0);
}

}  // namespace bs
