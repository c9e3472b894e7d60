#include "systems/particles/physics_impl.hpp"

namespace bs {

template std::unique_ptr<PairForces> create_pair_forces_of<1>(const Network&, const ParticleLaws&, const Motion&, const RowPattern&);

}  // namespace bs
