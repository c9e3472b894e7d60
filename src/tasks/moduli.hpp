// Elastic moduli of a periodic lattice: -bs_task moduli.
#pragma once
#include <petscts.h>
#include <vector>
#include "systems/equilibrium.hpp"
#include "tasks/result.hpp"

namespace bs {

/// The stiffness of the equilibrium at hand, its stresses included: the second derivatives of the energy by homogeneous strains x -> (I + e) x, all
/// particles relaxed,
///   C_ab = (d2 E/(d e_a d e_b) - X_a.(-K)^-1 X_b)/V,   X_a = df/d e_a at particles that follow the strain, K = df/dx
/// by the components xx; xx, yy, xy; or xx, yy, zz, yz, xz, xy with engineering shears [N/m^(d-1)]. Parts that no load reaches move
/// without a force: they carry nothing.
class Moduli {
 public:
  /// Collective. The moduli are wanted; motions without stiffness are counted in systems of up to `unknowns`. Errors (exit 2): no periodic box, or
  /// particles that are held.
  PetscErrorCode begin(Equilibrium& model, std::int64_t unknowns);
  bool wanted() const { return count_ > 0; }
  /// The tables of a trajectory, whose numbers are known only at the end: NaN and -1 before.
  void add_tables(PetscMPIInt rank, std::vector<Dataset>* out) const;
  /// Collective. At the equilibrium y of time t, by the linear solver of `ts` with the matrix J.
  PetscErrorCode find(TS ts, Mat J, Equilibrium& model, double t, Vec y, FinalResults* out);

  /// After find(), which may have failed.
  void copy_results(Result* out) const {
    out->stiffness = value_;
    out->zero_modes = floppy_;
  }

 private:
  void put(PetscMPIInt rank, const StrainResponse& strained, FinalResults* out) const;
  PetscErrorCode count_floppy(Equilibrium& model);
  std::vector<std::string> names_;  ///< of the components
  int count_ = 0, dim_ = 0;
  std::int64_t most_ = 0;      ///< unknowns up to which zero modes are counted
  PetscInt floppy_ = -1;       ///< zero modes beyond the translations; -1: not counted
  std::vector<double> value_;  ///< (q, q), row by row
};

}  // namespace bs
