#include "session/lattices.hpp"
#include "base/option_names.hpp"
#include "input/remote.hpp"
#include "session/inside.hpp"
#include "session/tasks.hpp"
#include "systems/create.hpp"
#include "tasks/generate.hpp"
#include "tasks/run_options.hpp"
#include "tasks/unused_options.hpp"

namespace bs {

namespace {

/// body(comm) on a duplicate of `comm`, with the options of `settings` and `more`; what went wrong.
template <class Body>
Error aside(MPI_Comm comm, const Settings& settings, const Settings& more, std::vector<std::string>* warnings, Body&& body) {
  OptionTable options;
  MPI_Comm own = own_communicator(comm, [warnings](const std::string& text) {
    if (warnings) warnings->push_back(text);
  });
  Error error = filled(own, settings, more, &options);
  if (!error) {
    const Inside inside(own, options);
    const PetscErrorCode code = take_up_options(own);
    error = outcome(own, code ? code : body(own));
  }
  MPI_Comm_free(&own);
  return error;
}

PetscErrorCode read(MPI_Comm comm, LatticeArrays* out) {
  Lattice chunk, whole;
  PetscFunctionBegin;
  PetscCall(load_particles(comm, "a lattice that is read", &chunk));
  for (const auto& [name, value] : chunk.implied_options) (void)is_given(name);  // the arrays keep them
  PetscCall(read_program_options(comm));
  PetscCall(refuse_misspelt_options(comm));
  PetscCall(gather_whole(comm, chunk, &whole));
  *out = arrays_of(std::move(whole));
  PetscFunctionReturn(0);
}

}  // namespace

Error read_lattice(MPI_Comm comm, const Settings& settings, LatticeArrays* out, std::vector<std::string>* warnings) {
  return aside(comm, settings, {}, warnings, [out](MPI_Comm own) { return read(own, out); });
}

Error write_lattice(MPI_Comm comm, const LatticeArrays& lattice, const Settings& settings, const std::string& file,
                    std::vector<std::string>* warnings) {
  Lattice whole;
  Error error;
  if (!lattice_of(lattice, &whole, &error.text)) return error;
  return aside(comm, settings, {{"-bs_output", file}}, warnings, [&whole](MPI_Comm own) { return write_lattice(own, &whole); });
}

}  // namespace bs
