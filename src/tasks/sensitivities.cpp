#include "tasks/sensitivities.hpp"
#include <algorithm>
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/vec_array.hpp"
#include "tasks/tangent_solve.hpp"

namespace bs {
namespace {

PetscErrorCode refuse_without_adjoint(Equilibrium& model, double t) {
  MPI_Comm comm = model.comm();
  PetscFunctionBegin;
  if (!model.mechanics()->linearisation().symmetric_at_rest())
    PetscCall(fail(comm, Exit::input, "sensitivities: forces whose tangent is not symmetric have no adjoint here: leave them out"));
  if (!model.mechanics()->linearisation().complete())
    PetscCall(fail(comm, Exit::input,
                   "sensitivities: forces that are computed outside change with the places by their tangent: give it, or leave them out"));
  if (!model.free_strains(t).empty())
    PetscCall(fail(comm, Exit::input, "sensitivities: a box under given stresses is not followed: give its strains (-bs_box_strain)"));
  if (model.free_bodies() > 0)
    PetscCall(fail(comm, Exit::input, "sensitivities: bodies that are tied to nothing may be anywhere: fix a particle of each"));
  PetscFunctionReturn(0);
}

/// r = dJ/dx in the places of v, 0 where components are held.
PetscErrorCode lay_out(Equilibrium& model, const std::vector<double>& slope, Vec r) {
  Mechanics& mechanics = *model.mechanics();
  const Layout& at = mechanics.layout();
  std::vector<StatePart> parts;
  VecHandle places;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(r, places.out()));
  PetscCall(VecZeroEntries(r));
  PetscCall(model.gather_state(r, &parts));  // zeros
  std::copy(slope.begin(), slope.end(), WriteArray(parts[0].vec).data());
  PetscCall(model.scatter_state(places));
  const ReadArray from(places);
  const WriteArray to(r);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c)
      if (mechanics.linearisation().moves(i, c)) to[at.v(i, c)] = from[at.x(i, c)];
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode find_adjoint(TS ts, Mat J, Equilibrium& model, double t, Vec y, const std::vector<double>& slope, Vec lambda) {
  constexpr double GOOD = 1e-7;
  VecHandle load;
  TangentSolve solve;
  double left = 0;
  PetscFunctionBegin;
  PetscCall(refuse_without_adjoint(model, t));
  PetscCall(VecDuplicate(y, load.out()));
  PetscCall(lay_out(model, slope, load));
  PetscCall(solve.prepare(ts, J, model, t, y));
  PetscCall(solve.solve(load, lambda, GOOD, &left));
  PetscCall(solve.restore_solver());
  if (!(left <= GOOD))
    PetscCall(fail(model.comm(), Exit::solve,
                   solve.memory_lack().yes
                       ? "sensitivities: " + solve.memory_lack().said()
                       : "sensitivities: the quantity changes along a motion that meets no resistance: hold it, or leave its particles out"));
  PetscFunctionReturn(0);
}

}  // namespace bs
