// The energies of a lattice as it is given, without a step: energy_of_lattice -bs_lattice_file beam.h5 -bs_gravity 0,-9.81
#include <petscts.h>

#include <memory>

#include "base/error.hpp"
#include "base/options.hpp"
#include "systems/create.hpp"

static PetscErrorCode run() {
  std::unique_ptr<bs::Model> model;
  std::vector<bs::Observable> observables;

  PetscFunctionBegin;
  PetscCall(bs::create_model(PETSC_COMM_WORLD, &model));
  PetscCall(bs::reject_unknown_options(PETSC_COMM_WORLD));
  PetscCall(model->observe(0, model->initial_state(), &observables));
  for (const bs::Observable& o : observables)
    if (o.value.size() == 1) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s %.17g\n", o.name.c_str(), o.value[0]));
  PetscFunctionReturn(0);
}

int main(int argc, char** argv) {
  if (PetscInitialize(&argc, &argv, nullptr, nullptr)) return 2;
  PetscErrorCode status = 0;
  {
    const bs::PetscErrors errors(PETSC_COMM_WORLD);
    status = run();
  }
  const bs::Error error = bs::last_error(PETSC_COMM_WORLD);
  if (status) (void)PetscPrintf(PETSC_COMM_WORLD, "%s\n", error.text.c_str());
  return PetscFinalize() ? 4 : status ? static_cast<int>(error.exit) : 0;
}
