// The parts of an H5MD 1.1 file that are written once (layout: README.md).
#pragma once
#include <petscsys.h>

#include <string>

#include "base/powers.hpp"
#include "output/h5.hpp"
#include "output/trajectory.hpp"

namespace bs {

/// Collective over `comm`, as everything here: the ranks that have the file open. /h5md, and with `units` its module of units (system SI).
PetscErrorCode write_h5md(hid_t file, MPI_Comm comm, bool units);

/// Collective. /particles/trajectory/box of `dim` dimensions; boundary: along each edge, none where it says nothing.
PetscErrorCode write_box(hid_t file, int dim, std::vector<std::string> boundary);

/// Collective. /parameters: versions and the run's `ranks`; /parameters/options: every option in force, as strings.
PetscErrorCode write_parameters(hid_t file, PetscMPIInt ranks);

/// Unit of that dimension in H5MD's notation; empty without units.
std::string unit_of(const Powers& powers, OutputUnits units);

/// Unit of a quantity by its name ("position", "kinetic_energy", ...) in H5MD's notation; empty if unknown or without units.
std::string unit_of_quantity(const std::string& name, OutputUnits units);

}  // namespace bs
