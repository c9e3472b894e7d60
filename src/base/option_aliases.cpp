#include "base/option_aliases.hpp"
#include <algorithm>
#include <utility>
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

/// Names that are kept with every version of PETSc, so that trajectories and checkpoints do not depend on it, and PETSc's own names since 3.25.
constexpr const char* const KEPT[][2] = {
    {"-ts_dt", "-ts_time_step"}, {"-ts_max_reject", "-ts_max_step_rejections"}, {"-ts_ssp_nstages", "-ts_ssp_num_stages"}};

// The names before PETSc 3.24, and those since.
constexpr const char* const LONGEST[] = {"-snes_linesearch_maxstep", "-snes_linesearch_maxlambda"};
constexpr const char* const SECANT[] = {"l2", "secant"};
constexpr int NOW = PETSC_VERSION_LT(3, 24, 0) ? 0 : 1;

}  // namespace

std::string kept_name(const std::string& name) {
  const std::string small = lower(name);
  for (const auto& [kept, other] : KEPT)
    if (small == other) return kept;
  return small == LONGEST[1 - NOW] ? LONGEST[NOW] : name;
}

std::string known_value(const std::string& name, const std::string& value) {
  return lower(name) == "-snes_linesearch_type" && value == SECANT[1 - NOW] ? SECANT[NOW] : value;
}

void translate_old_and_new_names(int argc, char** argv) {
  static std::vector<std::vector<char>> names;  // argv points into these texts
  for (int k = 1; k < argc; ++k) {
    const std::string kept = kept_name(argv[k]);
    if (kept == argv[k]) continue;
    names.emplace_back(kept.c_str(), kept.c_str() + kept.size() + 1);
    argv[k] = names.back().data();
  }
}

PetscErrorCode unify_option_names(MPI_Comm comm, const std::vector<std::string>& words) {
  std::vector<std::pair<std::string, std::string>> options;
  PetscFunctionBegin;
  PetscCall(options_in_force(&options));
  for (const auto& [word, value] : options) {
    const std::string name = "-" + word, kept = kept_name(name), known = known_value(name, value);
    if (kept == name && known == value) continue;
    const auto same = [&kept = kept](const std::string& one) { return lower(one) == kept; };
    const bool both = kept != name && std::any_of(options.begin(), options.end(), [&same](const auto& one) { return same("-" + one.first); });
    const bool first = both && std::any_of(words.begin(), words.end(), same);
    if (both && !first) PetscCall(fail(comm, Exit::input, "options " + kept + " and " + name + " are two names of one option: give one of them"));
    if (kept != name) PetscCall(PetscOptionsClearValue(nullptr, name.c_str()));
    if (!first) PetscCall(PetscOptionsSetValue(nullptr, kept.c_str(), known.empty() ? nullptr : known.c_str()));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode with_names_of_petsc(MPI_Comm comm, const std::function<PetscErrorCode()>& read) {
  PetscFunctionBegin;
  if (PETSC_VERSION_LT(3, 25, 0)) {
    PetscCall(read());
    PetscFunctionReturn(0);
  }
  for (const auto& [kept, other] : KEPT) {
    if (!is_given(kept)) continue;
    const std::string value = value_of(kept);
    PetscCall(PetscOptionsClearValue(nullptr, kept));
    PetscCall(PetscOptionsSetValue(nullptr, other, value.empty() ? nullptr : value.c_str()));
  }
  PetscCall(read());
  PetscCall(unify_option_names(comm));
  for (const auto& both : KEPT) (void)is_given(both[0]);  // so that they count as used
  PetscFunctionReturn(0);
}

}  // namespace bs
