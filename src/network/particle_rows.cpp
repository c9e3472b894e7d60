#include "network/particle_rows.hpp"
#include <petscsf.h>

namespace bs {

// One column at a time: what is in transit stays small beside what is kept.
PetscErrorCode give_columns(MPI_Comm comm, const Lattice& lattice, Network* net) {
  using LayoutHandle = Handle<PetscLayout, PetscLayoutDestroy>;
  ParticleColumns& columns = net->columns;
  const std::size_t n = static_cast<std::size_t>(net->n);
  LayoutHandle layout;
  SFHandle sf;
  PetscFunctionBegin;
  columns = {};
  columns.width = lattice.particle_columns.size();
  if (columns.width == 0) PetscFunctionReturn(0);
  const std::vector<PetscInt> rows(net->row.begin(), net->row.end());
  PetscCall(PetscLayoutCreateFromSizes(comm, static_cast<PetscInt>(lattice.particles.count), PETSC_DECIDE, 1, layout.out()));
  PetscCall(PetscSFCreate(comm, sf.out()));
  PetscCall(PetscSFSetGraphLayout(sf, layout, net->n, nullptr, PETSC_COPY_VALUES, rows.data()));
  columns.given.resize(n * columns.width);
  std::vector<double> received(n);
  for (std::size_t c = 0; c < columns.width; ++c) {
    const Column& column = lattice.particle_columns[c];
    columns.places[particle_parameter(column.name)] = static_cast<int>(c);
    PetscCall(PetscSFBcastBegin(sf, MPI_DOUBLE, column.value.data(), received.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(sf, MPI_DOUBLE, column.value.data(), received.data(), MPI_REPLACE));
    for (std::size_t i = 0; i < n; ++i) columns.given[i * columns.width + c] = received[i];
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
