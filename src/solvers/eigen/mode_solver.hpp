// Eigenpairs of the free vibrations of a linearised system, by SLEPc: dense for small systems, shift-and-invert by sparse
// factors where these stay small, a Davidson method with block factors and a coarse grid for large ones.
#pragma once
#include <slepceps.h>
#include <string>
#include <vector>
#include "solvers/eigen/standard_form.hpp"

namespace bs {

using EPSHandle = Handle<EPS, EPSDestroy>;

struct ModeRequest {
  enum Which { smallest, largest, target };
  enum Method { automatic, dense, direct, iterative };
  PetscInt count = 0;  ///< K
  int which = smallest;
  double near = 0;          ///< omega^2 of `target` [1/s^2]
  bool keep_rigid = false;  ///< zero modes count among the K
  int method = automatic;
};

struct Mode {
  double omega_squared = 0, residual = 0;  ///< residual: |A u - omega^2 u|, which bounds the distance to an exact omega^2 [1/s^2]
  bool zero = false;                       ///< not told from 0
  VecHandle u;                             ///< of length 1
};

struct Modes {
  std::vector<Mode> mode;  ///< ascending
  PetscInt rigid = 0;      ///< motions of the whole as a rigid body, with omega^2 = 0
  PetscInt zero = 0;       ///< all that were met with omega^2 = 0, rigid ones among them
  PetscInt unstable = 0;   ///< that were met with omega^2 < 0
  PetscInt iterations = 0;
  bool counted = false;  ///< the factors' signs confirm that none is missing
  std::string method;
};

class ModeSolver {
 public:
  /// `form` must outlive the object; `y`: the state it is linearised at.
  ModeSolver(StandardForm& form, Vec y, const ModeRequest& request) : form_(form), y_(y), request_(request) {}
  /// Collective. Reads -eps_*, -st_* and makes the solver; says which one.
  PetscErrorCode create(std::string* method);
  /// Collective. Fewer than asked for are given where the system has no more. `why` says what is wrong where the solver
  /// did not find all of them.
  PetscErrorCode solve(Modes* out, std::string* why);
  /// Frees the basis, matrices and factors of the search; the modes stay.
  void release();

 private:
  PetscErrorCode choose();
  PetscErrorCode create_dense();
  PetscErrorCode create_direct();
  PetscErrorCode create_iterative();
  PetscErrorCode set_sparse_factors(KSP ksp) const;
  PetscErrorCode place_shift();
  PetscErrorCode measure();
  PetscErrorCode negative_pivots(double shift, PetscInt* count);
  PetscErrorCode find_more(PetscInt more, std::string* why);
  PetscErrorCode judge(Mode* mode);
  PetscErrorCode count_all(bool* complete);
  PetscInt wanted() const;
  void sort();
  void finish(Modes* out);
  StandardForm& form_;
  Vec y_;
  ModeRequest request_;
  EPSHandle eps_;
  MatHandle A_;
  VecHandle diagonal_;
  std::vector<VecHandle> rigid_;
  std::vector<Mode> found_;
  double size_ = 0;    ///< geometric mean of A's diagonal [1/s^2]
  double widest_ = 0;  ///< its largest entry
  PetscInt iterations_ = 0;
  PetscInt basis_ = PETSC_DEFAULT, projected_ = PETSC_DEFAULT;  ///< -eps_ncv, -eps_mpd
};

}  // namespace bs
