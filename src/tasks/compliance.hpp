// What a structure yields to unit loads on groups of its particles: -bs_compliance_groups.
#pragma once
#include <petscts.h>
#include <string>
#include <vector>
#include "systems/equilibrium.hpp"
#include "tasks/result.hpp"

namespace bs {

/// At an equilibrium with K = df/dx, a unit load on group h along e, spread evenly over its n_h particles, displaces them by
///   K u = -f,   f_j = 1/n_h along e for all j of h
/// and C[(g, c), (h, e)] is the mean of u along c over group g [m/N]. C is symmetric where K is. What holds a component bears its part of
/// the load, and the component stays where it is.
class Compliance {
 public:
  /// Collective. Of the groups of these names in `model`, which has begun; errors (exit 2): groups that do not exist, bodies tied to nothing.
  PetscErrorCode begin(Equilibrium& model, const std::vector<std::string>& names);
  bool wanted() const { return !groups_.empty(); }
  /// The table of a trajectory, whose numbers are known only at the end: NaN before.
  Dataset table(PetscMPIInt rank) const;
  /// Collective. At the equilibrium y of time t, by the linear solver of `ts` with the matrix J.
  PetscErrorCode find(TS ts, Mat J, Equilibrium& model, double t, Vec y, FinalResults* out);

 private:
  PetscErrorCode set_load(Mechanics& mechanics, std::size_t group, PetscInt component, Vec load) const;
  PetscErrorCode is_resisted(Equilibrium& model, Vec load, Vec u, bool* yes) const;
  PetscErrorCode add_means(MPI_Comm comm, Vec u, std::size_t column);
  void put(PetscMPIInt rank, FinalResults* out) const;

  std::vector<ParticleGroup> groups_;
  int dim_ = 0;
  std::vector<double> value_;  ///< (groups d, groups d), row by row; NaN before it is known
};

}  // namespace bs
