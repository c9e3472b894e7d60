// Which laws the springs of a lattice obey, and what these need: from options and from what the lattice brings along.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>
#include "base/options.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

/// What the options say of all springs.
struct SpringOptions {
  struct Constant {
    SpringParameter parameter;
    std::string option;  ///< its name
    double value = 0;
    bool given = false;
  };
  int spring_law = -1, damping_law = -1;  ///< places in the registry; -1: not given
  std::vector<Constant> constants;        ///< one for every parameter of some law

  void read(Section& section);
};

/// Collective. Puts the options into the lattice: afterwards its columns are those that its springs' laws take, with values in range
/// where a spring takes them and 0 elsewhere. Warns of numbers that no spring takes. Errors (exit 2): a number a law needs is not
/// given, or out of its range; a law for all springs where the file has one for each.
PetscErrorCode apply_spring_options(MPI_Comm comm, const SpringOptions& options, Lattice* lattice);

/// Collective. Rest lengths, which are filled in, must be above 0 where a spring's law needs that (exit 2).
PetscErrorCode check_rest_lengths(MPI_Comm comm, const Lattice& lattice);

}  // namespace bs
