// Strain, tension and stress of every spring as fields of the trajectory, in the order of the input.
#pragma once
#include <vector>
#include "lattice/lattice.hpp"
#include "systems/particles/spring_table.hpp"
#include "systems/particles/terms.hpp"
#include "systems/system.hpp"

namespace bs {

class SpringFields {
 public:
  /// Collective. Reads -bs_output_strain and -bs_output_springs. The lattice's chunk must still be in memory; `net` must outlive the object.
  PetscErrorCode create(const Network& net, const Lattice& lattice);
  /// Whether frames have any of these fields.
  bool active() const { return strain_ || carried_; }
  /// Collective. Appends the fields at the states gathered last: strain [1], tension [N], and stress [Pa] where the lattice has cross-sections. They
  /// are NaN where a spring is broken or can exert no force; so is the strain of a spring of rest length 0. The vectors remain this object's.
  PetscErrorCode fields(const Terms& terms, const LocalState& state, std::vector<Field>* out);

 private:
  PetscErrorCode add_carried(std::vector<Field>* out);
  const Network* net_ = nullptr;
  Rows rows_;
  bool strain_ = false, carried_ = false;  ///< the two options
  std::vector<double> area_;               ///< cross-sections of this rank's rows; empty on all ranks where the lattice has none
  bool stressed_ = false;                  ///< the lattice has cross-sections
  SpringTable table_;
  VecHandle strains_, tensions_, stresses_;
};

}  // namespace bs
