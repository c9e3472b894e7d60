// The options that are given, also those whose names the user makes up.
#pragma once
#include <petscsys.h>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// Names (without dash) and values of all options, in their order in PETSc's table, which is the same on every rank.
PetscErrorCode options_in_force(std::vector<std::pair<std::string, std::string>>* options);

/// What follows `begin` (without the dash) in the names of the options that begin with it and are given, in their order in PETSc's
/// table, which is the same on every rank.
PetscErrorCode option_endings(const std::string& begin, std::vector<std::string>* endings);

}  // namespace bs
