// How forces change with the numbers of springs: the derivative by which an adjoint state becomes a gradient.
#pragma once
#include <string>
#include <vector>
#include "systems/particles/spring_table.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

class Sensitivities {
 public:
  /// Collective. lambda . df/dp [J per unit of p] for p the number `name` (lattice/numbers.hpp) of each spring: of this rank's rows in the input's
  /// order, 0 where a spring's law has no such number or it is broken. `state` and `lambda` are gathered, the latter as a direction; `springs`: this
  /// rank's rows. Histories are taken as they are.
  PetscErrorCode find(const Network& net, const Rows& springs, const Terms& terms, const std::string& name, const LocalState& state,
                      const LocalState& lambda, std::vector<double>* out);

 private:
  SpringTable table_;
  VecHandle rows_;
};

}  // namespace bs
