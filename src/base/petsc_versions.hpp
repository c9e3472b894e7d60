// What differs between the versions of PETSc from 3.18 on: no other file asks which one it is. Names of options: option_aliases.hpp.
#pragma once
#include <petscsnes.h>
#include <type_traits>

// Exported and documented, but declared in a private header alone, which some files include.
// NOLINTNEXTLINE(readability-redundant-declaration)
PETSC_EXTERN PetscErrorCode PetscObjectStateGet(PetscObject, PetscObjectState*);

namespace bs {

/// What PetscOptionsBegin hands on: the address of a structure until 3.22, a pointer by itself since.
using OptionItems = std::conditional_t<std::is_pointer_v<PetscOptionItems>, PetscOptionItems, PetscOptionItems*>;

#if PETSC_VERSION_LT(3, 24, 0)
using ShellFunction = void (*)(void);
#else
using ShellFunction = PetscErrorCodeFn*;
#endif

#if PETSC_VERSION_LT(3, 25, 0)
constexpr SNESConvergedReason NORM_NOT_FINITE = SNES_DIVERGED_FNORM_NAN;
#else
constexpr SNESConvergedReason NORM_NOT_FINITE = SNES_DIVERGED_FUNCTION_NANORINF;
#endif

/// MatShellSetOperation with the cast that it wants.
template <class Function>
PetscErrorCode set_shell_operation(Mat shell, MatOperation operation, Function* function) {
  PetscFunctionBegin;
  PetscCall(MatShellSetOperation(shell, operation, reinterpret_cast<ShellFunction>(function)));
  PetscFunctionReturn(0);
}

// Members of PETSc's structures, for files that include the private header of the structure: templates, so that others need not.

template <class Line>
auto& least_lambda(Line line) {
#if PETSC_VERSION_LT(3, 24, 0)
  return line->steptol;
#else
  return line->minlambda;
#endif
}

template <class Line>
auto& most_trials(Line line) {
#if PETSC_VERSION_LT(3, 24, 0)
  return line->max_its;
#else
  return line->max_it;
#endif
}

/// What SNESSetFunctionDomainError noted.
template <class Solver>
auto& domain_error(Solver snes) {
#if PETSC_VERSION_LT(3, 25, 0)
  return snes->domainerror;
#else
  return snes->functiondomainerror;
#endif
}

}  // namespace bs
