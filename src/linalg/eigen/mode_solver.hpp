// Eigenpairs of the free vibrations of a linearised system, by SLEPc: dense for small systems, shift-and-invert by sparse
// factors where these stay small, a Davidson method with block factors and a coarse grid for large ones. Krylov and Davidson
// methods can pass over copies of a multiple omega^2: none is known to be missing before that is shown (Completeness).
#pragma once
#include <slepceps.h>
#include <string>
#include <vector>
#include "linalg/eigen/standard_form.hpp"

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

/// What is known of modes that a list may lack.
enum class Completeness {
  unknown,   ///< copies of a multiple omega^2 may be missing
  searched,  ///< another search beside the modes found none that belongs among them, which is no proof
  counted    ///< as many omega^2 lie there as the signs of a factorisation's pivots count, or all of the system's are known
};

struct Mode {
  double omega_squared = 0, residual = 0;  ///< residual: |A u - omega^2 u|, which bounds the distance to an exact omega^2 [1/s^2]
  bool zero = false;                       ///< not told from 0
  VecHandle u;                             ///< of length 1
};

struct Modes {
  std::vector<Mode> mode;                           ///< ascending
  PetscInt rigid = 0;                               ///< motions of the whole as a rigid body, with omega^2 = 0
  PetscInt zero = 0;                                ///< all that were met with omega^2 = 0, rigid ones among them
  PetscInt unstable = 0;                            ///< with omega^2 < 0
  bool zero_exact = false, unstable_exact = false;  ///< counted; else there may be more
  PetscInt iterations = 0;
  Completeness completeness = Completeness::unknown;  ///< of the list
  std::string method;
};

class ModeSolver {
 public:
  /// `form` must outlive the object.
  ModeSolver(StandardForm& form, const ModeRequest& request) : form_(form), request_(request) {}
  /// Collective. Reads -eps_*, -st_* and makes the solver; says which one.
  PetscErrorCode create(std::string* method);
  /// Collective. Fewer than asked for are given where the system has no more. `why` says what is wrong where the solver
  /// did not find all of them.
  PetscErrorCode solve(Modes* out, std::string* why);
  /// Frees the basis, matrices and factors of the search; the modes stay.
  void release();

 private:
  /// Modes sought beyond those that are asked for or missing.
  static constexpr PetscInt GUARD = 3;
  PetscErrorCode choose();
  PetscErrorCode create_solver();
  PetscErrorCode create_dense();
  PetscErrorCode create_direct();
  PetscErrorCode create_iterative();
  PetscInt basis_for(PetscInt modes) const;
  PetscErrorCode set_sparse_factors(KSP ksp) const;
  PetscErrorCode place_shift();
  PetscErrorCode measure();
  PetscErrorCode run_solver(bool* exhausted);
  PetscErrorCode find_more(PetscInt more, std::string* why);
  PetscErrorCode find_some(PetscInt more, bool* all, std::string* why);
  PetscErrorCode judge(Mode* mode);
  PetscErrorCode separate(Vec u, bool* fresh);
  bool good(const Mode& mode) const;
  PetscErrorCode keep_rigid();
  PetscErrorCode search(std::string* why);
  PetscErrorCode count(bool* done, std::string* why);
  PetscErrorCode search_again(bool* done);
  PetscInt wanted() const;
  PetscInt left() const;
  PetscErrorCode finish(Modes* out, std::string* why);
  PetscErrorCode count_unstable(Modes* out);

  /// Of omega^2 in the order in which modes are wanted: the K with the smallest are.
  double distance(double omega_squared) const;
  /// A distance, and how many of the omega^2 known so far are nearer.
  struct Edge {
    double at = 0;
    PetscInt within = 0;
  };
  Edge edge() const;
  PetscErrorCode count_within(double edge, PetscInt* count);
  PetscErrorCode refuse_failed_factors(PC pc) const;
  PetscErrorCode negative_pivots(double shift, Vec raise, PetscInt* count);
  PetscErrorCode count_below(double shift, PetscInt* count);

  StandardForm& form_;
  ModeRequest request_;
  EPSHandle eps_;
  MatHandle A_;
  MatHandle shifted_;  ///< of counts
  KSPHandle counter_;  ///< its factors; their order is found once
  VecHandle sizes_;    ///< of A (StandardForm::sizes)
  std::vector<VecHandle> rigid_;
  std::vector<Mode> found_;
  Completeness completeness_ = Completeness::unknown;
  double edge_ = 0;    ///< no omega^2 nearer than this is missing, as completeness_ says
  double size_ = 0;    ///< geometric mean of sizes_ [1/s^2]
  double widest_ = 0;  ///< its largest entry
  PetscInt iterations_ = 0;
  bool exhausted_ = false;                                      ///< the last search ended without telling what it had found
  PetscInt left_ = 0;                                           ///< eigenvalues of A that are not known at the end
  PetscInt basis_ = PETSC_DEFAULT, projected_ = PETSC_DEFAULT;  ///< -eps_ncv, -eps_mpd
};

}  // namespace bs
