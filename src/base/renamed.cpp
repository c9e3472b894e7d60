#include "base/renamed.hpp"
#include <string>
#include <vector>
#include "base/fault.hpp"
#include "base/recalled.hpp"

namespace bs {
namespace {

struct Renamed {
  const char *old_name, *name;
};

constexpr Renamed TABLE[] = {
    {"-bs_attraction", "-bs_xsp_attraction"},
    {"-bs_attraction_center", "-bs_xsp_attraction_center"},
    {"-bs_attraction_exponent", "-bs_xsp_attraction_exponent"},
    {"-bs_center_of_mass", "-bs_xsp_center_of_mass"},
    {"-bs_center_of_mass_damping", "-bs_xsp_center_of_mass_damping"},
    {"-bs_center_particle", "-bs_xsp_center_particle"},
    {"-bs_walls", "-bs_xsp_walls"},
    {"-bs_walls_box", "-bs_xsp_walls_box"},
    {"-bs_walls_exponent", "-bs_xsp_walls_exponent"},
    {"-bs_walls_sides", "-bs_xsp_walls_sides"},
    {"-snes_linesearch_unasked", "-snes_linesearch_full_step_rtol"},
};

}  // namespace

PetscErrorCode rename_old_options(MPI_Comm comm) {
  PetscFunctionBegin;
  for (const Renamed& option : TABLE) {
    PetscBool old_given = PETSC_FALSE, given = PETSC_FALSE;
    std::vector<char> value(PETSC_MAX_OPTION_NAME * 16);
    PetscCall(PetscOptionsGetString(nullptr, nullptr, option.old_name, value.data(), value.size(), &old_given));
    if (!old_given) PetscCall(PetscOptionsHasName(nullptr, nullptr, option.old_name, &old_given));
    if (!old_given) continue;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, option.name, &given));
    if (!given) PetscCall(PetscOptionsSetValue(nullptr, option.name, value.data()));
    rename_recalled(option.old_name, option.name);
    PetscCall(PetscOptionsClearValue(nullptr, option.old_name));
    PetscCall(warn(comm, format("option %s is now called %s; the old name will be removed in the next version", option.old_name, option.name)));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
