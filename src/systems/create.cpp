#include "systems/create.hpp"
#include "base/error.hpp"
#include "base/memory.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "input/load.hpp"
#include "linalg/block_icc.hpp"
#include "systems/first_order.hpp"
#include "systems/linear/linear_model.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

PetscErrorCode register_models() {
  PetscFunctionBegin;
  PetscCall(register_block_icc());
  PetscFunctionReturn(0);
}

/// 0: particles; 1: a linear system.
static PetscErrorCode read_kind(MPI_Comm comm, int* kind) {
  PetscFunctionBegin;
  *kind = is_given("-bs_netlist") ? 1 : 0;
  PetscCall(read_memory_option(comm));
  PetscCall(read_section(comm, "Model", [kind](Section& o) {
    o.choice("-bs_model", "system to integrate: particles, or a linear system (its options: -bs_model linear -help)", {"particles", "linear"}, *kind);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode create_model(MPI_Comm comm, std::unique_ptr<Model>* out, const Lattice* given) {
  int kind = 0;
  PetscFunctionBegin;
  PetscCall(read_kind(comm, &kind));
  if (kind == 1 && given) PetscCall(fail(comm, Exit::input, "option -bs_model linear: the lattice in memory is of particles: leave the option out"));
  if (kind == 1) {
    PetscCall(LinearModel::create(comm, out));
    PetscFunctionReturn(0);
  }
  Lattice lattice;
  PetscCall(load_lattice(comm, &lattice, given));
  std::unique_ptr<Mechanics> particles;
  PetscCall(ParticleModel::create(comm, std::move(lattice), &particles));
  *out = std::make_unique<FirstOrder>(std::move(particles));
  PetscFunctionReturn(0);
}

PetscErrorCode load_particles(MPI_Comm comm, const char* user, Lattice* out, const Lattice* given) {
  int kind = 0;
  PetscFunctionBegin;
  PetscCall(read_kind(comm, &kind));
  if (kind == 1) PetscCall(fail(comm, Exit::input, std::string(user) + ": a linear system has no lattice: leave -bs_model and -bs_netlist out"));
  PetscCall(load_lattice(comm, out, given));
  PetscFunctionReturn(0);
}

}  // namespace bs
