#include "solvers/newton/search/searches.hpp"
#include <petsc/private/linesearchimpl.h>
#include "solvers/newton/search/energy.hpp"

namespace bs {
namespace {

constexpr const char* POLICY = "backspring_newton";
constexpr const char *GUARDED = "guarded", *ENERGY = "energy";

/// The policy tied to the SNES of a search.
PetscErrorCode policy_of(SNESLineSearch line, NewtonPolicy** newton) {
  SNES snes;
  PetscContainer holder = nullptr;
  void* found = nullptr;
  PetscFunctionBegin;
  PetscCall(SNESLineSearchGetSNES(line, &snes));
  PetscCall(PetscObjectQuery(reinterpret_cast<PetscObject>(snes), POLICY, reinterpret_cast<PetscObject*>(&holder)));
  PetscCheck(holder, PetscObjectComm(reinterpret_cast<PetscObject>(line)), PETSC_ERR_ARG_WRONGSTATE,
             "the line searches guarded and energy work only within the time stepper's own Newton solver");
  PetscCall(PetscContainerGetPointer(holder, &found));
  *newton = static_cast<NewtonPolicy*>(found);
  PetscFunctionReturn(0);
}

PetscErrorCode apply_guarded(SNESLineSearch line) {
  NewtonPolicy* newton = nullptr;
  PetscFunctionBegin;
  PetscCall(policy_of(line, &newton));
  PetscCall(guarded_search(line, *newton));
  PetscFunctionReturn(0);
}

PetscErrorCode create_guarded(SNESLineSearch line) {
  PetscFunctionBegin;
  line->ops->apply = apply_guarded;
  PetscFunctionReturn(0);
}

PetscErrorCode apply_energy(SNESLineSearch line) {
  NewtonPolicy* newton = nullptr;
  EnergyLimits limits = *static_cast<EnergyLimits*>(line->data);
  PetscFunctionBegin;
  PetscCall(policy_of(line, &newton));
  limits.damping = line->damping;
  limits.min_lambda = line->steptol;
  limits.most = line->max_its;
  limits.order = line->order;
  limits.monitor = line->monitor;
  PetscCall(energy_search(line, *newton, limits));
  PetscFunctionReturn(0);
}

PetscErrorCode energy_options(SNESLineSearch line, PetscOptionItems* PetscOptionsObject) {
  EnergyLimits* limits = static_cast<EnergyLimits*>(line->data);
  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "Line search by energy");
  PetscCall(PetscOptionsReal("-snes_linesearch_alpha",
                             "fraction of the slope by which the energy must decrease; forces without a potential are searched by residual norms", "",
                             limits->alpha, &limits->alpha, nullptr));
  PetscCall(PetscOptionsReal("-snes_linesearch_full_step_rtol",
                             "a full step that reduces the residual to this fraction is accepted without computing the energy; 0: compute it always",
                             "", limits->full_step, &limits->full_step, nullptr));
  PetscOptionsHeadEnd();
  PetscFunctionReturn(0);
}

PetscErrorCode destroy_energy(SNESLineSearch line) {
  PetscFunctionBegin;
  delete static_cast<EnergyLimits*>(line->data);
  line->data = nullptr;
  PetscFunctionReturn(0);
}

PetscErrorCode create_energy(SNESLineSearch line) {
  PetscFunctionBegin;
  line->data = new EnergyLimits;
  line->max_its = EnergyLimits{}.most;
  line->order = EnergyLimits{}.order;
  line->ops->apply = apply_energy;
  line->ops->setfromoptions = energy_options;
  line->ops->destroy = destroy_energy;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_searches() {
  PetscFunctionBegin;
  PetscCall(SNESLineSearchRegister(GUARDED, create_guarded));
  PetscCall(SNESLineSearchRegister(ENERGY, create_energy));
  PetscFunctionReturn(0);
}

PetscErrorCode set_search_policy(SNES snes, NewtonPolicy* newton) {
  PetscContainer holder;
  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(snes)), &holder));
  PetscCall(PetscContainerSetPointer(holder, newton));
  PetscCall(PetscObjectCompose(reinterpret_cast<PetscObject>(snes), POLICY, reinterpret_cast<PetscObject>(holder)));
  PetscCall(PetscContainerDestroy(&holder));
  PetscFunctionReturn(0);
}

PetscErrorCode describe_search(SNES snes, std::string* text) {
  SNESLineSearch line;
  SNESLineSearchType type = nullptr;
  PetscFunctionBegin;
  PetscCall(SNESGetLineSearch(snes, &line));
  PetscCall(SNESLineSearchGetType(line, &type));
  *text = type ? type : "default";
  if (*text == GUARDED) *text += " (full steps, then backtracking)";
  if (*text != ENERGY) PetscFunctionReturn(0);
  NewtonPolicy* newton = nullptr;
  PetscCall(policy_of(line, &newton));
  const std::string lack = lacks_energy(newton->settings());
  if (!lack.empty()) *text += " (residual norms: " + lack + " has no potential)";
  PetscFunctionReturn(0);
}

}  // namespace bs
