#include "model/create.hpp"
#include "base/options.hpp"
#include "input/load.hpp"
#include "model/particles/particle_model.hpp"

namespace bs {

PetscErrorCode create_model(MPI_Comm comm, std::unique_ptr<Model>* out) {
  PetscFunctionBegin;
  Lattice lattice;
  PetscCall(load_lattice(comm, &lattice));
  PetscCall(ParticleModel::create(comm, std::move(lattice), out));
  PetscFunctionReturn(0);
}

}  // namespace bs
