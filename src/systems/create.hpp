// Creation of a model from the options.
#pragma once
#include <memory>
#include "lattice/lattice.hpp"
#include "systems/model.hpp"

namespace bs {

/// Registers the preconditioners that models bring with them; once, after PetscInitialize.
PetscErrorCode register_models();

/// Collective. Reads -bs_model and creates the model it names from the options. `given`: its lattice, whole and the same on every rank; null: the
/// options name one.
PetscErrorCode create_model(MPI_Comm comm, std::unique_ptr<Model>* out, const Lattice* given = nullptr);

/// Collective. Reads -bs_model and loads the lattice that the options name, of which no model is made; `user`, for messages: what asks for it. Error
/// (exit 2): a linear system. `given`: as above.
PetscErrorCode load_particles(MPI_Comm comm, const char* user, Lattice* out, const Lattice* given = nullptr);

}  // namespace bs
